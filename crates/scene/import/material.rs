//! Materials (glTF 2.0, 3.9), the KHR_materials extensions that we support, `extras.whitted` and `extras.priority`.

use glam::{Vec3, Vec4};
use gltf::json::material::AlphaMode as FileAlphaMode;
use gltf::json::validation::Checked;
use serde_json::Value;

use super::document::{Document, number};
use super::error::{Fault, Outcome, Warnings};
use super::texture::TextureTable;
use crate::model::{AlphaMode, Material, TextureRef, Volume, WhittedCoefficients};

/// More UV sets than any exporter writes; each costs as much memory as a quarter of all other attributes together.
const MAX_UV_SETS: usize = 16;

/// The materials `used` (`None`: glTF's default one), lengths still in metres; and for each UV set that they read the file's
/// number for it.
pub(super) fn load(
    document: &Document,
    used: impl Iterator<Item = Option<usize>>,
    textures: &mut TextureTable,
    warnings: &mut Warnings,
) -> Outcome<(Vec<Material>, Vec<u32>)> {
    let mut materials = used
        .map(|index| {
            index.map_or(Ok(Material::default()), |index| {
                load_one(document, index, textures, warnings)
            })
        })
        .collect::<Outcome<Vec<_>>>()?;
    let mut uv_sets: Vec<u32> = materials
        .iter()
        .flat_map(Material::texture_refs)
        .map(|texture| texture.uv_set)
        .collect();
    uv_sets.sort_unstable();
    uv_sets.dedup();
    if uv_sets.len() > MAX_UV_SETS {
        let problem = format!(
            "they read {} UV sets, at most {MAX_UV_SETS} are supported",
            uv_sets.len()
        );
        return Err(Fault::limit("materials", problem));
    }
    let slots = materials.iter_mut().flat_map(Material::texture_slots_mut);
    for texture in slots.flatten() {
        texture.uv_set = uv_sets.partition_point(|&set| set < texture.uv_set) as u32;
    }
    Ok((materials, uv_sets))
}

/// Reads one material.
struct Reader<'a> {
    document: &'a Document,
    json: &'a Value,
    place: String,
    textures: &'a mut TextureTable,
    warnings: &'a mut Warnings,
}

fn load_one(
    document: &Document,
    index: usize,
    textures: &mut TextureTable,
    warnings: &mut Warnings,
) -> Outcome<Material> {
    let file = &document.materials[index];
    let json = &document.elements("materials")[index];
    let mut read = Reader {
        document,
        json,
        place: document.place("materials", index),
        textures,
        warnings,
    };
    let mut material = Material {
        name: document
            .name("materials", index)
            .map_or_else(|| document.number("materials", index), str::to_owned),
        double_sided: file.double_sided,
        ..Material::default()
    };

    let pbr = &file.pbr_metallic_roughness;
    material.base_color = Vec4::from_array(read.units("baseColorFactor", pbr.base_color_factor.0)?);
    material.base_color_texture = read.texture("/pbrMetallicRoughness/baseColorTexture", true)?;
    material.metallic = read.unit("metallicFactor", pbr.metallic_factor.0)?;
    material.roughness = read.unit("roughnessFactor", pbr.roughness_factor.0)?;
    material.metallic_roughness_texture =
        read.texture("/pbrMetallicRoughness/metallicRoughnessTexture", false)?;

    material.normal_texture = read.texture("/normalTexture", false)?;
    let normal_scale = file
        .normal_texture
        .as_ref()
        .map_or(1.0, |texture| texture.scale);
    material.normal_scale = read.checked(
        "normalTexture.scale",
        normal_scale,
        f32::is_finite,
        "finite",
    )?;
    material.occlusion_texture = read.texture("/occlusionTexture", false)?;
    let strength = file
        .occlusion_texture
        .as_ref()
        .map_or(1.0, |texture| texture.strength.0);
    material.occlusion_strength = read.unit("occlusionTexture.strength", strength)?;
    material.emissive = Vec3::from_array(read.units("emissiveFactor", file.emissive_factor.0)?);
    material.emissive_texture = read.texture("/emissiveTexture", true)?;
    material.alpha_mode = match file.alpha_mode {
        Checked::Valid(FileAlphaMode::Opaque) => AlphaMode::Opaque,
        Checked::Valid(FileAlphaMode::Mask) => AlphaMode::Mask {
            cutoff: read.not_negative("alphaCutoff", file.alpha_cutoff.unwrap_or_default().0)?,
        },
        Checked::Valid(FileAlphaMode::Blend) => AlphaMode::Blend,
        Checked::Invalid => return Err(read.invalid("alphaMode is not one of OPAQUE, MASK, BLEND")),
    };
    read.extensions(&mut material, file.extensions.as_ref())?;
    material.priority = read.priority();
    material.whitted = read.whitted()?;
    Ok(material)
}

impl Reader<'_> {
    fn extensions(
        &mut self,
        material: &mut Material,
        extensions: Option<&gltf::json::extensions::material::Material>,
    ) -> Outcome<()> {
        let Some(extensions) = extensions else {
            return Ok(());
        };
        material.unlit = extensions.unlit.is_some();
        if let Some(emissive) = &extensions.emissive_strength {
            material.emissive *=
                self.not_negative("emissiveStrength", emissive.emissive_strength.0)?;
        }
        if let Some(transmission) = &extensions.transmission {
            material.transmission =
                self.unit("transmissionFactor", transmission.transmission_factor.0)?;
            material.transmission_texture = self.texture(
                "/extensions/KHR_materials_transmission/transmissionTexture",
                false,
            )?;
        }
        if let Some(ior) = &extensions.ior {
            material.ior = self.index_of_refraction(ior.ior.0)?;
        }
        if let Some(specular) = &extensions.specular {
            material.specular = self.unit("specularFactor", specular.specular_factor.0)?;
            material.specular_texture =
                self.texture("/extensions/KHR_materials_specular/specularTexture", false)?;
            let [r, g, b] = specular.specular_color_factor.0;
            material.specular_color = Vec3::new(
                self.not_negative("specularColorFactor", r)?,
                self.not_negative("specularColorFactor", g)?,
                self.not_negative("specularColorFactor", b)?,
            );
            material.specular_color_texture = self.texture(
                "/extensions/KHR_materials_specular/specularColorTexture",
                true,
            )?;
        }
        if let Some(volume) = &extensions.volume
            && self.not_negative("thicknessFactor", volume.thickness_factor.0)? > 0.0
        {
            let distance = self.attenuation_distance()?;
            material.volume = Some(Volume {
                attenuation_color: Vec3::from_array(
                    self.units("attenuationColor", volume.attenuation_color.0)?,
                ),
                attenuation_distance: distance,
            });
        }
        Ok(())
    }

    /// Metres; infinite where the file gives none. In f64, as other lengths: the `gltf` crate would round it.
    fn attenuation_distance(&self) -> Outcome<f64> {
        let volume = self.json.pointer("/extensions/KHR_materials_volume");
        let volume = volume.unwrap_or(&Value::Null);
        match number(volume, "attenuationDistance", &self.place)? {
            None => Ok(f64::INFINITY),
            Some(distance) if distance > 0.0 => Ok(distance),
            Some(distance) => Err(self.invalid(&format!(
                "attenuationDistance is {distance}, but must be above zero"
            ))),
        }
    }

    /// 0 stands for an infinite index (KHR_materials_ior).
    fn index_of_refraction(&mut self, ior: f32) -> Outcome<f32> {
        if ior == 0.0 {
            return Ok(f32::INFINITY);
        }
        self.checked(
            "ior",
            ior,
            |ior| (1.0..f32::INFINITY).contains(&ior),
            "0, or 1 and above",
        )
    }

    fn texture(&mut self, pointer: &str, srgb: bool) -> Outcome<Option<TextureRef>> {
        let Some(json) = self.json.pointer(pointer).filter(|json| !json.is_null()) else {
            return Ok(None);
        };
        let place = format!(
            "{}, {}",
            self.place,
            pointer.rsplit('/').next().unwrap_or_default()
        );
        self.textures
            .texture_ref(self.document, json, srgb, &place, self.warnings)
    }

    /// A factor that glTF limits to [0, 1]; brought there with a warning, as other programs do silently.
    fn unit(&mut self, field: &str, value: f32) -> Outcome<f32> {
        let value = self.checked(field, value, |value| !value.is_nan(), "a number")?;
        if !(0.0..=1.0).contains(&value) {
            let clamped = value.clamp(0.0, 1.0);
            self.warnings.push(
                &self.place,
                format!("{field} {value} is not within 0 and 1; {clamped} is used"),
            );
            return Ok(clamped);
        }
        Ok(value)
    }

    fn units<const N: usize>(&mut self, field: &str, mut values: [f32; N]) -> Outcome<[f32; N]> {
        for value in &mut values {
            *value = self.unit(field, *value)?;
        }
        Ok(values)
    }

    fn not_negative(&mut self, field: &str, value: f32) -> Outcome<f32> {
        self.checked(
            field,
            value,
            |value| (0.0..f32::INFINITY).contains(&value),
            "finite and not negative",
        )
    }

    fn checked(
        &self,
        field: &str,
        value: f32,
        fits: impl Fn(f32) -> bool,
        wanted: &str,
    ) -> Outcome<f32> {
        if fits(value) {
            Ok(value)
        } else {
            Err(self.invalid(&format!("{field} is {value}, but must be {wanted}")))
        }
    }

    fn invalid(&self, problem: &str) -> Fault {
        Fault::invalid(&self.place, problem)
    }

    /// Which solid is there where several overlap, our own addition to glTF. Others may use the name for something else, so what
    /// does not fit is no error.
    fn priority(&mut self) -> i32 {
        let Some(json) = self.json.pointer("/extras/priority") else {
            return 0;
        };
        let whole = json.as_i64().and_then(|whole| i32::try_from(whole).ok());
        whole.unwrap_or_else(|| {
            let problem =
                format!("extras.priority {json} is not a whole number of 32 bits; 0 is used");
            self.warnings.push(&self.place, problem);
            0
        })
    }

    /// The book's coefficients, our own addition to glTF.
    fn whitted(&mut self) -> Outcome<Option<WhittedCoefficients>> {
        const FIELDS: [&str; 6] = ["ka", "kd", "ks", "n", "kt", "ior"];
        let Some(json) = self.json.pointer("/extras/whitted") else {
            return Ok(None);
        };
        let Some(object) = json.as_object() else {
            return Err(self.invalid("extras.whitted is not an object"));
        };
        if let Some(unknown) = object.keys().find(|key| !FIELDS.contains(&key.as_str())) {
            let problem = format!(
                "extras.whitted has '{unknown}', which is none of {}; it is ignored",
                FIELDS.join(", ")
            );
            self.warnings.push(&self.place, problem);
        }
        let ior = self.coefficient(json, "ior")?;
        if ior.is_some_and(|ior| ior < 1.0) {
            return Err(self.invalid("extras.whitted.ior must be 1 or above"));
        }
        Ok(Some(WhittedCoefficients {
            ka: self.coefficient(json, "ka")?,
            kd: self.coefficient(json, "kd")?,
            ks: self.color(json, "ks")?,
            n: self.coefficient(json, "n")?,
            kt: self.color(json, "kt")?,
            ior,
        }))
    }

    fn coefficient(&mut self, json: &Value, field: &str) -> Outcome<Option<f32>> {
        let value = number(json, field, &format!("{}, extras.whitted", self.place))?;
        value
            .map(|value| self.not_negative(field, value as f32))
            .transpose()
    }

    /// A number for all three channels, or one for each.
    fn color(&mut self, json: &Value, field: &str) -> Outcome<Option<Vec3>> {
        let Some(channels) = json.get(field).and_then(Value::as_array) else {
            return Ok(self.coefficient(json, field)?.map(Vec3::splat));
        };
        let numbers: Option<Vec<f64>> = channels.iter().map(Value::as_f64).collect();
        let Some([r, g, b]) = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok()) else {
            return Err(self.invalid(&format!(
                "extras.whitted.{field} is neither a number nor three"
            )));
        };
        let mut channel = |value: f64| self.not_negative(field, value as f32);
        Ok(Some(Vec3::new(channel(r)?, channel(g)?, channel(b)?)))
    }
}
