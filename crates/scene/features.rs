//! What a scene contains, as far as it decides what the renderer has to be able to do.

use crate::contact;
use crate::model::{AlphaMode, LightKind, Material, Projection, Scene};

/// A surface rougher than this spawns no mirror ray under the `pbr` model (shaders/README.md, `smooth`).
pub const ROUGHEST_MIRROR: f32 = 0.4;

/// In a scene of no more triangles no ray can do much: it tests each of them, and each node of a tree over them, twice at most.
const FEW_TRIANGLES: usize = 512;

/// What the scene contains. A pure function of the scene: nothing here depends on settings or on the device.
///
/// A feature that a material names but that can't show does not count: a transmission of 0, a normal map of scale 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some material is single-sided and opaque.
    pub culling: bool,
    /// Some material cuts holes by alpha.
    pub mask: bool,
    /// Some material blends by alpha.
    pub blend: bool,
    /// Some material is unlit.
    pub unlit: bool,
    /// Some material samples an image.
    pub textures: bool,
    /// Some material bends its shading normal by a map.
    pub normal_maps: bool,
    /// The mesh carries colours.
    pub vertex_colors: bool,
    /// Under the `pbr` model some surface is smooth enough to spawn reflected rays.
    pub mirrors: bool,
    /// Some material transmits light.
    pub transmission: bool,
    /// .. and bounds a solid.
    pub solids: bool,
    /// .. that absorbs.
    pub absorption: bool,
    /// .. and has another priority than others, so that it matters where they overlap.
    pub priorities: bool,
    /// Faces of solids coincide with those of other solids, or with opaque ones.
    pub contact: bool,
    /// `extras.whitted` makes some material transmit, under the `whitted` model only.
    pub whitted_transmission: bool,
    /// There is enough for a single ray to keep a device busy for long.
    pub many_triangles: bool,
    /// Punctual lights.
    pub lights: usize,
    /// Some light is a spot.
    pub spots: bool,
    /// An environment map.
    pub environment: bool,
    /// A camera of the file is orthographic.
    pub orthographic: bool,
}

impl SceneFeatures {
    /// Looks through the scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let any = |test: fn(&Material) -> bool| scene.materials.iter().any(test);
        Self {
            culling: any(|m| !m.double_sided && !transmits(m)),
            mask: any(|m| matches!(m.alpha_mode, AlphaMode::Mask { .. })),
            blend: any(|m| m.alpha_mode == AlphaMode::Blend),
            unlit: any(|m| m.unlit),
            textures: any(|m| m.texture_refs().next().is_some()),
            normal_maps: any(has_normal_map) && !scene.geometry.tangents.is_empty(),
            vertex_colors: !scene.geometry.colors.is_empty(),
            mirrors: any(reflects_sharply),
            transmission: any(transmits),
            solids: any(|m| transmits(m) && m.volume.is_some()),
            absorption: any(|m| transmits(m) && absorbs(m)),
            priorities: differs(
                scene
                    .materials
                    .iter()
                    .filter(|m| may_bound_solid(m))
                    .map(|m| m.priority),
            ),
            contact: contact::exists(scene),
            whitted_transmission: any(whitted_transmits),
            many_triangles: scene.geometry.triangles.len() > FEW_TRIANGLES,
            lights: scene.lights.len(),
            spots: scene
                .lights
                .iter()
                .any(|light| matches!(light.kind, LightKind::Spot { .. })),
            environment: scene.surroundings.environment.is_some(),
            orthographic: scene
                .cameras
                .iter()
                .any(|camera| matches!(camera.projection, Projection::Orthographic { .. })),
        }
    }
}

/// The material bounds a solid, under one of the shading models at least.
#[must_use]
pub fn may_bound_solid(material: &Material) -> bool {
    (transmits(material) && material.volume.is_some()) || whitted_transmits(material)
}

fn differs(mut values: impl Iterator<Item = i32>) -> bool {
    values
        .next()
        .is_some_and(|first| values.any(|other| other != first))
}

/// glTF's transmission can show.
#[must_use]
pub fn transmits(material: &Material) -> bool {
    material.transmission > 0.0
        && !material.unlit
        && (material.metallic < 1.0 || material.metallic_roughness_texture.is_some())
}

/// The author's own `kt` can show.
#[must_use]
pub fn whitted_transmits(material: &Material) -> bool {
    let kt = material.whitted.and_then(|k| k.kt);
    kt.is_some_and(|kt| kt.max_element() > 0.0) && !material.unlit
}

fn has_normal_map(material: &Material) -> bool {
    material.normal_texture.is_some() && material.normal_scale != 0.0
}

fn absorbs(material: &Material) -> bool {
    material.volume.is_some_and(|v| {
        v.attenuation_distance.is_finite() && v.attenuation_color.min_element() < 1.0
    })
}

fn reflects_sharply(material: &Material) -> bool {
    // A texture can only lower the roughness, so with one any factor may come out smooth.
    let smooth =
        material.roughness < ROUGHEST_MIRROR || material.metallic_roughness_texture.is_some();
    let metal = material.metallic > 0.0;
    let shiny = material.specular > 0.0 && material.ior != 1.0;
    // Total internal reflection reflects whatever the specular factor says.
    let inside = transmits(material) && material.volume.is_some();
    smooth && !material.unlit && (metal || shiny || inside)
}
