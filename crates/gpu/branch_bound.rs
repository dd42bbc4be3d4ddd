//! The most radiance that a reflected or transmitted ray can bring, whatever it meets: what a branch of a ray tree that is left out
//! can add is its throughput times this (`shaders/tolerance.wgsl`).
//!
//! A ray brings either what it sees where nothing is, or what a surface sends: `L = H + (1 - f) D + f L' `, with `D` what a diffuse base
//! sends of the light that arrives, `H` highlights, emission and what a rough lobe gathers, and `f` the share that goes on as rays
//! (`shaders/README.md`, the models). With `f` at most `w`, `B = D + H / (1 - w)` bounds a surface whose further rays are bounded by `B`, so the
//! largest of all surfaces' bounds them all; where nothing but mirrors and glass is smooth (`H = 0`), a `w` of 1 does no harm. Surfaces
//! that mirror all of it and shine as well have no such bound: these may add their own at each level of the tree.
//!
//! Light arrives at most as from the place of a triangle that is nearest to it. Textures count as white, but for roughness, on which
//! highlights hang. It is a bound for the worst place and angle of a scene: most branches bring far less.

use std::f64::consts::PI;

use glam::{DVec3, Vec3, Vec4Swizzles};
use rayon::prelude::*;
use raytree_scene::{
    environment::EquirectMap,
    features::{may_bound_solid, transmits},
    instances::Instance,
    model::{
        AlphaMode, Background, Light, LightKind, Material, Scene, Triangle, WhittedCoefficients,
    },
};

use crate::{
    settings::{RenderSettings, Shading},
    upload::LARGEST_RADIANCE,
};

/// `LEAST_HIGHLIGHT_ALPHA` of `shaders/pbr.wgsl`.
pub(crate) const LEAST_HIGHLIGHT_ALPHA: f64 = 1e-3;

/// By how much Karis' fit of a lobe's share may exceed 1.
const FIT_EXCESS: f64 = 1.05;

/// Nothing that is computed is larger.
const LARGEST: f64 = LARGEST_RADIANCE as f64;

/// For each channel; linear radiance, scene space. Infinite nowhere: 1e30 at most; 0 where no surface spawns rays.
#[must_use]
pub fn branch_bound(scene: &Scene, settings: &RenderSettings) -> Vec3 {
    let light = Arriving::of(scene);
    let color = brightest_color(scene);
    let mut bound = light.around;
    let mut at_each_level = DVec3::ZERO;
    let mut gain = 1.0_f64;
    let mut spawns = false;
    let mut used = vec![false; scene.materials.len()];
    for triangle in &scene.geometry.triangles {
        used[triangle.material as usize] = true;
    }
    let shown = scene.materials.iter().zip(used).filter(|(_, used)| *used);
    for (material, _) in shown {
        let base = brightest_base(material, color);
        let sent = match settings.shading {
            _ if material.unlit => Sent::unlit(base),
            Shading::Pbr => Sent::pbr(scene, material, base, &light),
            Shading::Whitted => Sent::whitted(material, base, &light),
        };
        spawns |= sent.onward > 0.0 || material.alpha_mode == AlphaMode::Blend;
        match sent.bound() {
            Some(own) => bound = bound.max(own),
            None => {
                at_each_level = at_each_level.max(sent.diffuse + sent.shining);
                gain = gain.max(sent.onward);
            }
        }
    }
    if !spawns {
        return Vec3::ZERO;
    }
    let levels = i32::try_from(settings.max_depth).unwrap_or(i32::MAX);
    let chain: f64 = (0..=levels).map(|level| gain.powi(level)).sum();
    let total = bound * gain.powi(levels) + at_each_level * chain;
    total
        .map(|channel| if channel <= LARGEST { channel } else { LARGEST })
        .as_vec3()
}

/// The most light that arrives anywhere.
struct Arriving {
    /// Irradiance from lights, facing all of them.
    direct: DVec3,
    /// Radiance from where nothing is.
    around: DVec3,
    /// What a white diffuse surface, or a rough lobe, gathers of the surroundings.
    gathered: DVec3,
}

/// The greatest of each channel of the vertex colours; white where there are none. Once a scene: it may have millions.
fn brightest_color(scene: &Scene) -> Vec3 {
    let colors = scene.geometry.colors.iter().map(|color| color.xyz());
    colors.reduce(Vec3::max).unwrap_or(Vec3::ONE)
}

impl Arriving {
    fn of(scene: &Scene) -> Self {
        let surroundings = &scene.surroundings;
        let brightest = |map: &EquirectMap| {
            let texels = map.texels.par_iter().map(|texel| Vec3::from(*texel));
            texels.reduce(|| Vec3::ZERO, Vec3::max).as_dvec3()
        };
        let mut around = DVec3::ZERO;
        let mut gathered = DVec3::ZERO;
        if let Some(environment) = &surroundings.environment {
            around = brightest(&environment.radiance);
            let levels = environment.rough.iter().chain([&environment.irradiance]);
            gathered = levels.map(brightest).fold(around, DVec3::max);
        }
        if let Background::Color(color) = surroundings.background {
            around = around.max(color.as_dvec3());
        }
        Self {
            direct: scene
                .lights
                .iter()
                .map(|light| brightest_place(scene, light))
                .sum(),
            around,
            gathered: gathered + surroundings.ambient.as_dvec3(),
        }
    }
}

/// Irradiance where a light is nearest to a triangle.
fn brightest_place(scene: &Scene, light: &Light) -> DVec3 {
    let position = match light.kind {
        LightKind::Directional { .. } => return light.intensity,
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => position,
    };
    let distance = |corners: [DVec3; 3]| distance_squared(position, corners);
    let corners = |triangle: &Triangle| {
        triangle
            .vertices
            .map(|v| scene.geometry.positions[v as usize].as_dvec3())
    };
    let own = scene.geometry.triangles[..scene.own_triangles()].par_iter();
    let nearest = own
        .map(|triangle| distance(corners(triangle)))
        .reduce(|| f64::INFINITY, f64::min);
    // Of instances that are no farther than what was found so far; the nearest first, which spares most of the others.
    let mut instances: Vec<(f64, &Instance)> = scene
        .instances
        .iter()
        .map(|instance| {
            let (min, max) = instance.bounds;
            let inside = position.clamp(min, max);
            (inside.distance_squared(position), instance)
        })
        .collect();
    instances.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let nearest = instances
        .into_iter()
        .fold(nearest, |nearest, (least, instance)| {
            if least >= nearest {
                return nearest;
            }
            let mesh = &scene.meshes[instance.mesh as usize].triangles;
            let triangles =
                scene.geometry.triangles[mesh.start as usize..mesh.end as usize].par_iter();
            triangles
                .map(|triangle| {
                    distance(corners(triangle).map(|corner| instance.placement.point(corner)))
                })
                .reduce(|| nearest, f64::min)
        });
    // Positions are rounded to f32 on the device.
    let nearest = (nearest.sqrt() * (1.0 - 1e-5) - 1e-6).max(0.0).powi(2);
    (light.intensity / nearest.max(1e-30)).min(DVec3::splat(LARGEST))
}

/// From a point to the nearest one of a triangle (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn distance_squared(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let along = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let share = (point - from).dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
        (from + share.clamp(0.0, 1.0) * edge).distance_squared(point)
    };
    let edges = along(a, b).min(along(b, c)).min(along(c, a));
    let normal = (b - a).cross(c - a);
    let inside = |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(normal) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        let height = (point - a).dot(normal);
        return edges.min(height * height / normal.length_squared().max(f64::MIN_POSITIVE));
    }
    edges
}

/// The most that a surface sends.
struct Sent {
    /// Of a diffuse base, all that arrives.
    diffuse: DVec3,
    /// Emission, highlights, rough lobes.
    shining: DVec3,
    /// The share that goes on as rays, largest channel.
    onward: f64,
    /// What goes on as rays is missing from the diffuse base.
    shares_light: bool,
}

impl Sent {
    fn unlit(base: DVec3) -> Self {
        Self {
            diffuse: base,
            shining: DVec3::ZERO,
            onward: 0.0,
            shares_light: true,
        }
    }

    fn pbr(scene: &Scene, material: &Material, base: DVec3, light: &Arriving) -> Self {
        let textured = material.metallic_roughness_texture.is_some();
        let metal = f64::from(material.metallic.clamp(0.0, 1.0));
        let dielectric = if textured { 1.0 } else { 1.0 - metal };
        let opaque = match material.transmission_texture {
            Some(_) => 1.0,
            None if transmits(material) => 1.0 - f64::from(material.transmission.clamp(0.0, 1.0)),
            None => 1.0,
        };
        // A solid reflects all in total internal reflection, whatever its specular factor.
        let mirrors = f64::from(material.specular) > 0.0 || may_bound_solid(material);
        // At a grazing angle both parts of a mixture mirror all.
        let whole = base.max_element().max(1.0);
        let lobe = if mirrors { whole } else { metal * whole };
        // What is mirrored is missing from the diffuse base, whatever the share of metal: (1 - m)(1 - F) <= 1 - (1 - m) F - m Fm.
        let matte = if dielectric > 0.0 { opaque } else { 0.0 };
        let smoothest = least_roughness(scene, material);
        let roughest = f64::from(material.roughness.clamp(0.0, 1.0));
        let share = mirror_share(smoothest);
        let through = if transmits(material) {
            base.max_element()
        } else {
            0.0
        };
        let mut shining = material.emissive.as_dvec3();
        shining += lobe * brightest_highlight(smoothest, roughest) * light.direct;
        if mirror_share(roughest) < 1.0 {
            shining += (FIT_EXCESS * lobe + through) * light.gathered;
        }
        Self {
            diffuse: matte * base * (light.direct / PI + light.gathered),
            shining,
            onward: share * lobe.max(metal * whole + dielectric * through),
            shares_light: through == 0.0,
        }
    }

    fn whitted(material: &Material, base: DVec3, light: &Arriving) -> Self {
        let WhittedCoefficients { ka, kd, ks, kt, .. } = material.whitted.unwrap_or_default();
        // Derived coefficients are at most 1 (of a metal, its colour).
        let whole = Vec3::ONE.as_dvec3().max(base);
        let lit = |given: Option<f32>| given.map_or(1.0, f64::from);
        let spread = |given: Option<Vec3>, derived| given.map_or(derived, |k| k.as_dvec3());
        let dark = if transmits(material) {
            whole
        } else {
            DVec3::ZERO
        };
        let (ks, kt) = (
            spread(ks, derived_specular(material, base)),
            spread(kt, dark),
        );
        Self {
            diffuse: DVec3::ZERO,
            shining: material.emissive.as_dvec3()
                + lit(ka) * base * light.gathered
                + light.direct * (lit(kd) * base + ks),
            onward: (ks + kt).max_element(),
            shares_light: false,
        }
    }

    /// Where there is one: `None` if each level of a tree may add as much again.
    fn bound(&self) -> Option<DVec3> {
        let nothing_else =
            self.shining == DVec3::ZERO && (self.shares_light || self.diffuse == DVec3::ZERO);
        if self.onward <= 1.0 && nothing_else {
            return Some(self.diffuse);
        }
        let rest = 1.0 - self.onward;
        if rest <= 1e-6 {
            return None;
        }
        Some(if self.shares_light {
            self.diffuse + self.shining / rest
        } else {
            (self.diffuse + self.shining) / rest
        })
    }
}

/// ks where the author gives none: (1 - m) F0 + m base.
fn derived_specular(material: &Material, base: DVec3) -> DVec3 {
    let ior = f64::from(material.ior);
    let r0 = if ior.is_finite() {
        ((1.0 - ior) / (1.0 + ior)).powi(2)
    } else {
        1.0
    };
    let f0 =
        (r0 * material.specular_color.as_dvec3()).min(DVec3::ONE) * f64::from(material.specular);
    let metal = f64::from(material.metallic.clamp(0.0, 1.0));
    match material.metallic_roughness_texture {
        Some(_) => f0.max((1.0 - metal) * f0 + metal * base),
        None => (1.0 - metal) * f0 + metal * base,
    }
}

/// Factor times vertex colours; a texture is 1 at most.
fn brightest_base(material: &Material, color: Vec3) -> DVec3 {
    (material.base_color.xyz() * color)
        .as_dvec3()
        .max(DVec3::ZERO)
}

fn least_roughness(scene: &Scene, material: &Material) -> f64 {
    let factor = f64::from(material.roughness.clamp(0.0, 1.0));
    let Some(used) = material.metallic_roughness_texture else {
        return factor;
    };
    let image = scene.textures[used.texture as usize].image as usize;
    let least = scene.images[image]
        .texels
        .par_iter()
        .map(|texel| texel[1])
        .min();
    factor * f64::from(least.unwrap_or(255)) / 255.0
}

/// As in `shaders/pbr.wgsl`.
fn mirror_share(roughness: f64) -> f64 {
    let t = ((roughness - 0.1) / 0.3).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

/// D V cos of a lobe: D is 1 / (pi alpha^2) at most, V cos 1 / (2 alpha), at a grazing angle.
fn brightest_highlight(smoothest: f64, roughest: f64) -> f64 {
    if roughest * roughest < LEAST_HIGHLIGHT_ALPHA {
        return 0.0;
    }
    let alpha = (smoothest * smoothest).max(LEAST_HIGHLIGHT_ALPHA);
    0.5 / (PI * alpha.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [
        DVec3::ZERO,
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(0.0, 2.0, 0.0),
    ];

    fn distance(x: f64, y: f64, z: f64) -> f64 {
        distance_squared(DVec3::new(x, y, z), CORNERS).sqrt()
    }

    #[test]
    fn the_distance_from_a_triangle_is_that_of_its_nearest_point() {
        assert_eq!(distance(0.5, 0.5, 3.0), 3.0); // its inside
        assert_eq!(distance(0.5, 0.5, -3.0), 3.0); // .. from behind
        assert_eq!(distance(1.0, -4.0, 3.0), 5.0); // an edge
        assert_eq!(distance(5.0, 0.0, 4.0), 5.0); // a corner
        assert_eq!(distance(0.5, 0.5, 0.0), 0.0);
        assert!((distance(2.0, 2.0, 0.0) - 2.0_f64.sqrt()).abs() < 1e-15); // the long edge
    }

    fn sent(diffuse: f64, shining: f64, onward: f64, shares_light: bool) -> Option<f64> {
        let sent = Sent {
            diffuse: DVec3::splat(diffuse),
            shining: DVec3::splat(shining),
            onward,
            shares_light,
        };
        sent.bound().map(|bound| bound.x)
    }

    #[test]
    fn what_is_sent_on_adds_up() {
        // Matte; a mirror that shows matte things; a dim mirror that shines; glass.
        assert_eq!(sent(0.7, 0.0, 0.0, true), Some(0.7));
        assert_eq!(sent(0.7, 0.0, 1.0, true), Some(0.7));
        assert_eq!(sent(0.0, 1.0, 0.75, true), Some(4.0));
        assert_eq!(sent(0.0, 0.0, 1.0, false), Some(0.0));
        // All is mirrored, and more added each time.
        assert_eq!(sent(0.0, 1.0, 1.0, true), None);
        assert_eq!(sent(0.0, 0.0, 1.5, false), None);
    }

    #[test]
    fn highlights_are_as_bright_as_their_lobe_is_sharp() {
        assert_eq!(brightest_highlight(0.0, 0.0), 0.0);
        assert!(brightest_highlight(0.5, 0.5) > 8.0 * brightest_highlight(1.0, 1.0));
        // A texture that is smooth somewhere counts as smooth as a highlight can be.
        assert_eq!(brightest_highlight(0.0, 1.0), 0.5 / PI * 1e9);
    }
}
