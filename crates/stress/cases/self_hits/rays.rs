//! Rays to all over a mesh, and how they leave it.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec3, Vec3};
use raytree_gpu::types::{LEAVING_ABOUT_NORMAL, LEAVING_MIRRORED, SecondaryRay};

use crate::{meshes::Mesh, random::Random};

/// The flattest angle to the facet at which rays leave, radians.
pub(super) const LEAST_ANGLE: f64 = 1e-4;

/// To corners, edges and insides of triangles, from near and far, from both sides and at all angles; they leave at all angles.
pub(super) fn all_over(mesh: &Mesh, count: usize) -> Vec<SecondaryRay> {
    let mut random = Random::new(23);
    let triangles = mesh.scene.geometry.triangles.len();
    (0..count)
        .map(|_| {
            let corners = mesh.corners(random.below(triangles));
            let target = point_of(corners, &mut random);
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            let normal = if random.below(2) == 0 {
                normal
            } else {
                -normal
            };
            let distance = log_uniform(&mut random, 1e-3, 3.0);
            let elevation = (0.02 + 0.98 * random.unit()).asin();
            let origin = target.as_dvec3() + distance * about(normal, elevation, &mut random);
            let origin = origin.as_vec3();
            ray(origin, target - origin, leaving(&mut random))
        })
        .collect()
}

/// How a ray leaves: what `next` means, and `next`.
pub(super) type Leaving = (u32, DVec3);

/// At any angle, small ones as often as large ones; a quarter are mirrored.
pub(super) fn leaving(random: &mut Random) -> Leaving {
    if random.below(4) == 0 {
        return (LEAVING_MIRRORED, DVec3::ZERO);
    }
    let elevation = log_uniform(random, LEAST_ANGLE, FRAC_PI_2);
    let side = if random.below(4) == 0 {
        -DVec3::Z
    } else {
        DVec3::Z
    };
    (LEAVING_ABOUT_NORMAL, about(side, elevation, random))
}

pub(super) fn ray(origin: Vec3, direction: Vec3, (leaving, next): Leaving) -> SecondaryRay {
    SecondaryRay {
        origin: origin.to_array(),
        leaving,
        direction: direction.normalize_or(Vec3::X).to_array(),
        next: next.as_vec3().to_array(),
        ..SecondaryRay::default()
    }
}

pub(super) fn log_uniform(random: &mut Random, least: f64, most: f64) -> f64 {
    least * (most / least).powf(random.unit())
}

/// A direction at this angle above the plane across `axis`.
pub(super) fn about(axis: DVec3, elevation: f64, random: &mut Random) -> DVec3 {
    let (right, up) = axis.any_orthonormal_pair();
    let (sin, cos) = (random.unit() * TAU).sin_cos();
    elevation.cos() * (cos * right + sin * up) + elevation.sin() * axis
}

/// Half of the times inside, else on an edge or in a corner.
pub(super) fn point_of([a, b, c]: [Vec3; 3], random: &mut Random) -> Vec3 {
    let (s, t) = (random.unit() as f32, random.unit() as f32);
    match random.below(4) {
        0 => a,
        1 => a.lerp(b, s),
        _ => {
            let (s, t) = if s + t > 1.0 {
                (1.0 - s, 1.0 - t)
            } else {
                (s, t)
            };
            a + s * (b - a) + t * (c - a)
        }
    }
}
