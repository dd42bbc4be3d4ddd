//! What of a scene's materials, textures and vertex colours can show at all: what is multiplied by zero, or by a one that is
//! always one, or that no triangle uses, can not.

use glam::{Vec3, Vec4, Vec4Swizzles};

use crate::features::transmits;
use crate::model::{AlphaMode, Filter, Material, Scene, Texture, TextureRef, srgb_to_linear};

/// By how much bilinear filtering may miss what it interpolates, of its size: four products of weights and their sum.
const FILTER_ROUNDING: f32 = 1e-5;

/// Some of the channels R, G, B, A.
pub(crate) type Channels = [bool; 4];

/// How a scene uses one of its materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialUse {
    /// Some triangle has it. The importer drops triangles without area, and may so leave materials that none has.
    pub(crate) used: bool,
    /// The least of each channel of the vertex colours at its triangles' corners; 1 where the scene has none.
    pub(crate) least_color: Vec4,
    /// .. and the greatest.
    pub(crate) greatest_color: Vec4,
}

/// How each material is used.
pub(crate) fn material_uses(scene: &Scene) -> Vec<MaterialUse> {
    let geometry = &scene.geometry;
    let unused = MaterialUse {
        used: false,
        least_color: Vec4::ONE,
        greatest_color: Vec4::ONE,
    };
    let mut uses = vec![unused; scene.materials.len()];
    for triangle in &geometry.triangles {
        let found = &mut uses[triangle.material as usize];
        if !geometry.colors.is_empty() {
            for color in triangle.vertices.map(|v| geometry.colors[v as usize]) {
                let before = if found.used { *found } else { of_color(color) };
                found.least_color = before.least_color.min(color);
                found.greatest_color = before.greatest_color.max(color);
                found.used = true;
            }
        }
        found.used = true;
    }
    uses
}

fn of_color(color: Vec4) -> MaterialUse {
    MaterialUse {
        used: true,
        least_color: color,
        greatest_color: color,
    }
}

/// Do the vertex colours of the triangles with this material change it? White is interpolated to 1 to the last bit.
pub(crate) fn colors_show(material: &Material, used: MaterialUse) -> bool {
    let white = |k: usize| used.least_color[k] == 1.0 && used.greatest_color[k] == 1.0;
    let shown = base_channels(material);
    used.used && (0..4).any(|k| shown[k] && !white(k))
}

/// Which channels of the product of factor, vertex colour and texture show, the others equal to 1.
fn base_channels(material: &Material) -> Channels {
    let [r, g, b, a] = material.base_color.to_array().map(|factor| factor != 0.0);
    [r, g, b, a && material.alpha_mode != AlphaMode::Opaque]
}

/// Which channels (R, G, B, A) of each texture can show, in the order of [`Material::texture_slots`]: of the textures that a
/// material has no factor above zero for, none. Normal maps are judged by [`bends_normals`].
pub(crate) fn shown_channels(material: &Material) -> [Channels; 8] {
    let m = material;
    let lit = !m.unlit;
    let specular = lit && m.specular != 0.0;
    let color = |factor: Vec3, counts: bool| {
        let [r, g, b] = factor.to_array().map(|factor| counts && factor != 0.0);
        [r, g, b, false]
    };
    [
        base_channels(m),
        [
            false,
            lit && m.roughness != 0.0,
            lit && m.metallic != 0.0,
            false,
        ],
        [true, true, true, false],
        [lit && m.occlusion_strength != 0.0, false, false, false],
        color(m.emissive, lit),
        [transmits(m), false, false, false],
        [false, false, false, specular],
        color(m.specular_color, specular),
    ]
}

/// Does the material read an image that can show?
pub(crate) fn reads_images(scene: &Scene, material: &Material) -> bool {
    let slots = material.texture_slots();
    let shown = shown_channels(material);
    let plain = (0..slots.len()).filter(|slot| *slot != Material::NORMAL_SLOT);
    let mut shows = plain.map(|slot| slots[slot].is_some() && shown[slot].contains(&true));
    shows.any(|shows| shows) || bends_normals(scene, material)
}

/// Does the material's normal map bend anything? Scaled by zero what is left of it is `(0, 0, z)`: nothing, where `z` points out
/// of the surface.
pub(crate) fn bends_normals(scene: &Scene, material: &Material) -> bool {
    let Some(map) = &material.normal_texture else {
        return false;
    };
    let outwards = |[_, _, z, _]: [u8; 4]| z >= 128;
    material.normal_scale != 0.0 || !every_texel(scene, map, outwards)
}

/// Is a ray never let through for want of alpha? `alpha` is `factor * vertex colour * texture`, clamped to [0, 1].
pub(crate) fn is_never_seen_through(scene: &Scene, material: &Material, used: MaterialUse) -> bool {
    match material.alpha_mode {
        AlphaMode::Opaque => true,
        AlphaMode::Mask { cutoff } => least_alpha_reaches(scene, material, used, cutoff),
        AlphaMode::Blend => {
            has_full_factor(material, used)
                && material.base_color_texture.is_none_or(|texture| {
                    every_texel(scene, &texture, |[_, _, _, alpha]| alpha == 255)
                })
        }
    }
}

/// As [`is_never_seen_through`], to the last bit: a texture that is filtered between texels of 1 may come out as 1 - 2^-24, and
/// a material that blends then lets that much through.
pub(crate) fn is_exactly_opaque(scene: &Scene, material: &Material, used: MaterialUse) -> bool {
    let filtered = |texture: TextureRef| {
        scene.textures[texture.texture as usize].filter == Filter::Linear
            && material.alpha_mode == AlphaMode::Blend
    };
    is_never_seen_through(scene, material, used)
        && !material.base_color_texture.is_some_and(filtered)
}

fn has_full_factor(material: &Material, used: MaterialUse) -> bool {
    material.base_color.w >= 1.0 && has_full_colors(used)
}

fn has_full_colors(used: MaterialUse) -> bool {
    used.least_color.w == 1.0 && used.greatest_color.w == 1.0
}

fn least_alpha_reaches(scene: &Scene, material: &Material, used: MaterialUse, cutoff: f32) -> bool {
    if has_full_colors(used) && material.base_color_texture.is_none() {
        return material.base_color.w.min(1.0) >= cutoff;
    }
    if cutoff <= 0.0 {
        return true;
    }
    // What is interpolated may fall below its least by rounding.
    let rounding = FILTER_ROUNDING * used.greatest_color.w.abs();
    let factor = material.base_color.w * (used.least_color.w - rounding);
    let least = cutoff * (1.0 + FILTER_ROUNDING);
    let reaches = |alpha: f32| (factor * alpha).min(1.0) >= least;
    match &material.base_color_texture {
        None => reaches(1.0),
        Some(texture) => every_texel(scene, texture, |[_, _, _, alpha]| {
            reaches(f32::from(alpha) / 255.0)
        }),
    }
}

/// Does the roughness come out below `limit` anywhere? `limit` is within 0 and 1.
pub(crate) fn is_smoother_than(scene: &Scene, material: &Material, limit: f32) -> bool {
    let smooth = |texel: f32| material.roughness * texel < limit * (1.0 + FILTER_ROUNDING);
    // A texture can only lower it.
    material.roughness < limit
        || material.metallic_roughness_texture.is_some_and(|texture| {
            !every_texel(scene, &texture, |[_, roughness, _, _]| {
                !smooth(f32::from(roughness) / 255.0)
            })
        })
}

/// The decoded value of a texture that has the same one everywhere in the channels `shown`; 1 in the others.
pub(crate) fn constant(scene: &Scene, texture: &TextureRef, shown: Channels) -> Option<Vec4> {
    let first = *image_of(scene, texture).first()?;
    let alike = |texel: [u8; 4]| (0..4).all(|k| !shown[k] || texel[k] == first[k]);
    let value = decode(scene.textures[texture.texture as usize], first).to_array();
    let value = std::array::from_fn(|k| if shown[k] { value[k] } else { 1.0 });
    every_texel(scene, texture, alike).then(|| Vec4::from_array(value))
}

/// Ends at the first texel of which `test` is not true.
fn every_texel(scene: &Scene, texture: &TextureRef, test: impl Fn([u8; 4]) -> bool) -> bool {
    image_of(scene, texture).iter().all(|&texel| test(texel))
}

fn image_of<'a>(scene: &'a Scene, texture: &TextureRef) -> &'a [[u8; 4]] {
    let image = scene.textures[texture.texture as usize].image;
    &scene.images[image as usize].texels
}

/// As `shaders/texture.wgsl` decodes a texel, to the last bit.
fn decode(texture: Texture, code: [u8; 4]) -> Vec4 {
    let plain = Vec4::from_array(code.map(|channel| f32::from(channel) / 255.0));
    if !texture.srgb {
        return plain;
    }
    let [r, g, b, _] = code.map(srgb_to_linear);
    Vec3::new(r, g, b).extend(plain.w)
}

/// The base colour is black whatever texture and vertex colours say.
pub(crate) fn is_black(material: &Material) -> bool {
    material.base_color.xyz() == Vec3::ZERO
}
