//! Materials in a few words.

use serde_json::{Value, json};

use super::{TextureId, number, numbers};

/// A glTF material under construction. Colours are linear.
#[derive(Clone, Debug)]
pub struct Material(Value);

impl Material {
    /// No metal, roughness 1.
    #[must_use]
    pub fn matte(name: &str, color: [f64; 3]) -> Self {
        Self::glossy(name, color, 1.0)
    }

    /// No metal.
    #[must_use]
    pub fn glossy(name: &str, color: [f64; 3], roughness: f64) -> Self {
        Self::new(name, color, 0.0, roughness)
    }

    /// Metal; a mirror at roughness 0.
    #[must_use]
    pub fn metal(name: &str, color: [f64; 3], roughness: f64) -> Self {
        Self::new(name, color, 1.0, roughness)
    }

    /// A clear, smooth solid that refracts: for closed meshes.
    #[must_use]
    pub fn glass(name: &str, ior: f64) -> Self {
        Self::new(name, [1.0; 3], 0.0, 0.0)
            .extension(
                "KHR_materials_transmission",
                json!({ "transmissionFactor": 1.0 }),
            )
            .extension("KHR_materials_ior", json!({ "ior": ior }))
            .extension("KHR_materials_volume", json!({ "thicknessFactor": 1.0 }))
    }

    /// Any metallic-roughness material.
    #[must_use]
    pub fn new(name: &str, color: [f64; 3], metallic: f64, roughness: f64) -> Self {
        let [r, g, b] = color;
        Self(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": numbers(&[r, g, b, 1.0]),
                "metallicFactor": number(metallic),
                "roughnessFactor": number(roughness),
            },
        }))
    }

    /// Light that goes `distance` metres through the solid keeps `color` of itself. For [`Material::glass`].
    #[must_use]
    pub fn absorbing(mut self, color: [f64; 3], distance: f64) -> Self {
        let volume = &mut self.0["extensions"]["KHR_materials_volume"];
        volume["attenuationColor"] = numbers(&color);
        volume["attenuationDistance"] = number(distance);
        self
    }

    /// Multiplies the base colour by a texture.
    #[must_use]
    pub fn textured(mut self, texture: TextureId) -> Self {
        self.0["pbrMetallicRoughness"]["baseColorTexture"] = texture_info(texture);
        self
    }

    /// As [`Material::textured`], the texture turned, scaled and moved (KHR_texture_transform).
    #[must_use]
    pub fn textured_through(mut self, texture: TextureId, transform: Value) -> Self {
        let mut info = texture_info(texture);
        info["extensions"] = json!({ "KHR_texture_transform": transform });
        self.0["pbrMetallicRoughness"]["baseColorTexture"] = info;
        self
    }

    /// Multiplies roughness by G, metallic by B.
    #[must_use]
    pub fn metallic_roughness_map(mut self, texture: TextureId) -> Self {
        self.0["pbrMetallicRoughness"]["metallicRoughnessTexture"] = texture_info(texture);
        self
    }

    /// A tangent-space normal map.
    #[must_use]
    pub fn normal_map(self, texture: TextureId, scale: f64) -> Self {
        self.with(
            "normalTexture",
            json!({ "index": texture.0, "scale": number(scale) }),
        )
    }

    /// Ambient occlusion, read from a uv set.
    #[must_use]
    pub fn occlusion_map(self, texture: TextureId, uv_set: u32, strength: f64) -> Self {
        let info = json!({ "index": texture.0, "texCoord": uv_set, "strength": number(strength) });
        self.with("occlusionTexture", info)
    }

    /// Emitted radiance.
    #[must_use]
    pub fn emissive(self, color: [f64; 3]) -> Self {
        self.with("emissiveFactor", numbers(&color))
    }

    /// Multiplies the emission by a texture, read from a uv set.
    #[must_use]
    pub fn emissive_map(self, texture: TextureId, uv_set: u32) -> Self {
        self.with(
            "emissiveTexture",
            json!({ "index": texture.0, "texCoord": uv_set }),
        )
    }

    /// Cut out where alpha is below the cutoff.
    #[must_use]
    pub fn masked(self, cutoff: f64) -> Self {
        self.with("alphaMode", json!("MASK"))
            .with("alphaCutoff", number(cutoff))
    }

    /// Alpha is coverage; `alpha` multiplies the texture's.
    #[must_use]
    pub fn blended(mut self, alpha: f64) -> Self {
        self.0["pbrMetallicRoughness"]["baseColorFactor"][3] = number(alpha);
        self.with("alphaMode", json!("BLEND"))
    }

    /// Seen from both sides.
    #[must_use]
    pub fn double_sided(self) -> Self {
        self.with("doubleSided", json!(true))
    }

    /// `extras.whitted`: the book's own coefficients.
    #[must_use]
    pub fn whitted(self, coefficients: Value) -> Self {
        self.with("extras", json!({ "whitted": coefficients }))
    }

    /// A material extension.
    #[must_use]
    pub fn extension(mut self, name: &str, value: Value) -> Self {
        self.0["extensions"][name] = value;
        self
    }

    fn with(mut self, key: &str, value: Value) -> Self {
        self.0[key] = value;
        self
    }

    pub(super) fn into_json(self) -> Value {
        self.0
    }
}

fn texture_info(texture: TextureId) -> Value {
    json!({ "index": texture.0 })
}
