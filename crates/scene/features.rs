//! What a scene contains, as far as it decides what the renderer has to be able to do.

use glam::Vec3;

use crate::contact;
use crate::model::{AlphaMode, Background, LightKind, Material, Projection, Scene, Surroundings};
use crate::shown::{
    MaterialUse, bends_normals, colors_show, is_black, is_exactly_opaque, is_smoother_than,
    material_uses, reads_images,
};

/// A surface rougher than this spawns no mirror ray under the `pbr` model (shaders/README.md, `smooth`).
pub const ROUGHEST_MIRROR: f32 = 0.4;

/// In a scene of no more triangles no ray can do much: it tests each of them, and each node of a tree over them, twice at most.
const FEW_TRIANGLES: u64 = 512;

/// What the scene contains. A pure function of the scene: nothing here depends on settings or on the device.
///
/// A feature that the scene names but that can't show does not count: a transmission of 0, an image that is multiplied by 0, a
/// material that no triangle has, vertex colours that are white, a light without intensity. Leaving it out changes no bit of the
/// picture. [`crate::simplify`] takes more out of a scene than can be told from here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some material is single-sided and opaque.
    pub culling: bool,
    /// Some material cuts holes by alpha: somewhere it is below the cutoff.
    pub mask: bool,
    /// Some material blends by alpha, somewhere less than 1.
    pub blend: bool,
    /// Some material is unlit.
    pub unlit: bool,
    /// Some material samples an image that shows.
    pub textures: bool,
    /// Some material bends its shading normal by a map.
    pub normal_maps: bool,
    /// Vertices carry colours that make a difference.
    pub vertex_colors: bool,
    /// Under the `pbr` model some surface is smooth enough to spawn reflected rays.
    pub mirrors: bool,
    /// Some material transmits light, or bounds a solid by which light goes on.
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
    /// Nodes share meshes.
    pub instances: bool,
    /// There is enough for a single ray to keep a device busy for long.
    pub many_triangles: bool,
    /// Punctual lights that have to be looked at; 0 if none shines.
    pub lights: usize,
    /// Some light that shines is a spot.
    pub spots: bool,
    /// An environment map that is not black, or that hides a background which is not.
    pub environment: bool,
    /// A camera of the file is orthographic.
    pub orthographic: bool,
}

impl SceneFeatures {
    /// Looks through the scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let uses = material_uses(scene);
        let used = || {
            let all = scene.materials.iter().zip(uses.iter().copied());
            all.filter(|(_, used)| used.used)
        };
        let any = |test: &dyn Fn(&Material) -> bool| used().any(|(material, _)| test(material));
        let shows = |test: fn(&Scene, &Material, MaterialUse) -> bool| {
            used().any(|(material, used)| test(scene, material, used))
        };
        let solids = any(&|m| transmits(m) && m.volume.is_some());
        Self {
            culling: any(&|m| !m.double_sided && !transmits(m)),
            mask: shows(cuts_holes),
            blend: shows(blends),
            unlit: any(&|m| m.unlit),
            textures: any(&|m| reads_images(scene, m)),
            normal_maps: any(&|m| bends_normals(scene, m)) && !scene.geometry.tangents.is_empty(),
            vertex_colors: shows(|_, material, used| colors_show(material, used)),
            mirrors: any(&|m| reflects_sharply(scene, m)),
            // Light has to get through to where solids hide behind others, whatever their colour.
            transmission: solids || any(&|m| transmits(m) && !is_black(m)),
            solids,
            absorption: any(&|m| may_bound_solid(m) && absorbs(m)),
            priorities: differs(
                used()
                    .filter(|(m, _)| may_bound_solid(m))
                    .map(|(m, _)| m.priority),
            ),
            contact: contact::exists(scene),
            whitted_transmission: any(&whitted_transmits),
            instances: !scene.instances.is_empty(),
            many_triangles: scene.placed_triangles() > FEW_TRIANGLES,
            lights: lights_to_look_at(scene),
            spots: scene
                .lights
                .iter()
                .any(|light| light.shines() && matches!(light.kind, LightKind::Spot { .. })),
            environment: has_environment(&scene.surroundings),
            orthographic: scene
                .cameras
                .iter()
                .any(|camera| matches!(camera.projection, Projection::Orthographic { .. })),
        }
    }
}

/// All or none: a ray that passes by many dark lights to a bright one takes as long as if they shone.
fn lights_to_look_at(scene: &Scene) -> usize {
    if scene.lights.iter().any(|light| light.shines()) {
        scene.lights.len()
    } else {
        0
    }
}

/// A black environment lights nothing, but reflected rays see it rather than a background colour.
fn has_environment(surroundings: &Surroundings) -> bool {
    let hides = matches!(surroundings.background, Background::Color(color) if color != Vec3::ZERO);
    let environment = surroundings.environment.as_ref();
    environment.is_some_and(|environment| hides || !environment.is_black())
}

fn cuts_holes(scene: &Scene, material: &Material, used: MaterialUse) -> bool {
    matches!(material.alpha_mode, AlphaMode::Mask { .. })
        && !is_exactly_opaque(scene, material, used)
}

fn blends(scene: &Scene, material: &Material, used: MaterialUse) -> bool {
    material.alpha_mode == AlphaMode::Blend && !is_exactly_opaque(scene, material, used)
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

fn absorbs(material: &Material) -> bool {
    material.volume.is_some_and(|v| {
        v.attenuation_distance.is_finite() && v.attenuation_color.min_element() < 1.0
    })
}

fn reflects_sharply(scene: &Scene, material: &Material) -> bool {
    let metal = material.metallic > 0.0;
    let shiny = material.specular > 0.0 && material.ior != 1.0;
    // Total internal reflection reflects whatever the specular factor says.
    let inside = transmits(material) && material.volume.is_some();
    !material.unlit
        && (metal || shiny || inside)
        && is_smoother_than(scene, material, ROUGHEST_MIRROR)
}

#[cfg(test)]
#[path = "features_tests.rs"]
mod tests;
