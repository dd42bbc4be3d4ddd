//! Triangles ten million times as long as they are wide.

use glam::{DMat3, DQuat, DVec3, Vec3};
use raytree_bvh::Preset;
use raytree_gpu::{
    build_bvh,
    types::{ProbeHit, ProbeRay},
};
use raytree_scene::model::Scene;

use crate::{
    random::Random,
    report::Limit,
    scenes::{Build, matte},
    stage::{Stage, StressError},
};

const ASPECT: f64 = 1e7;

/// Rays at each wall, and at the splinters.
const RAYS: usize = 60_000;

/// Of the extent: how far a hit may lie off the surface. The corners of a triangle relative to a ray's origin are rounded, to 6e-8;
/// half a dozen such make the distance.
const FARTHEST: f64 = 1e-6;

/// A wall of side 1 through the origin, of three strips; that in the middle is a sliver. Turned by `turn` and rounded to f32.
fn wall(turn: DMat3) -> Scene {
    let mut build = Build::before([0.0; 3]);
    let grey = build.material(matte([0.5; 3]));
    let columns = [-0.5, -0.5 / ASPECT, 0.5 / ASPECT, 0.5];
    let normal = (turn * DVec3::Z).as_vec3();
    let vertices = columns.map(|x| {
        [-0.5, 0.5].map(|y| build.vertex((turn * DVec3::new(x, y, 0.0)).as_vec3(), normal))
    });
    for pair in vertices.windows(2) {
        let ([a, d], [b, c]) = (pair[0], pair[1]);
        build.triangle([a, b, c], grey);
        build.triangle([a, c, d], grey);
    }
    build.0
}

/// Slivers of length 1 that do not touch, each through the origin's neighbourhood in its own direction.
fn splinters(count: usize, random: &mut Random) -> Scene {
    let mut build = Build::before([0.0; 3]);
    let grey = build.material(matte([0.5; 3]));
    for _ in 0..count {
        let along = random.direction().as_dvec3();
        let across = along.any_orthonormal_vector();
        let middle = random
            .within(Vec3::splat(-0.4), Vec3::splat(0.4))
            .as_dvec3();
        let corners = [
            middle - 0.5 * along,
            middle + 0.5 * along,
            middle + across / ASPECT,
        ];
        let corners = corners.map(|corner| {
            let normal = along.cross(across).as_vec3();
            build.vertex(corner.as_vec3(), normal)
        });
        build.triangle(corners, grey);
    }
    build.0
}

/// A ray at `target`, from `distance` away.
fn towards(target: DVec3, from: DVec3) -> ProbeRay {
    let origin = from.as_vec3();
    ProbeRay {
        origin: origin.to_array(),
        t_max: 1e30,
        direction: (target - origin.as_dvec3())
            .normalize()
            .as_vec3()
            .to_array(),
        shadow: 0,
    }
}

fn place(ray: &ProbeRay, hit: &ProbeHit) -> DVec3 {
    let origin = Vec3::from(ray.origin).as_dvec3();
    origin + f64::from(hit.t) * Vec3::from(ray.direction).as_dvec3()
}

/// What came of rays at a surface.
#[derive(Default, Debug, PartialEq)]
struct Tally {
    missed: usize,
    /// The largest distance of a hit from what was hit.
    farthest: f64,
}

impl Tally {
    /// `distance`: of a hit from the triangle that it names, seen along that direction.
    fn of(
        rays: &[ProbeRay],
        hits: &[ProbeHit],
        distance: impl Fn(DVec3, u32, DVec3) -> f64,
    ) -> Self {
        let mut tally = Self::default();
        for (ray, hit) in rays.iter().zip(hits) {
            if hit.triangle == u32::MAX {
                tally.missed += 1;
                continue;
            }
            let off = distance(
                place(ray, hit),
                hit.triangle,
                Vec3::from(ray.direction).as_dvec3(),
            );
            // `max` would pass over a NaN.
            let off = if off.is_nan() { f64::INFINITY } else { off };
            tally.farthest = tally.farthest.max(off);
        }
        tally
    }
}

pub(super) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut random = Random::new(10);
    let turned = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::YXZ, 0.7, -0.4, 0.3));
    for (name, turn) in [("", DMat3::IDENTITY), ("turned ", turned)] {
        let scene = wall(turn);
        let bvh = build_bvh(&scene, Preset::default())?;
        let rays: Vec<ProbeRay> = (0..RAYS)
            .map(|_| {
                let aim = |spread: f64, random: &mut Random| (2.0 * random.unit() - 1.0) * spread;
                // Half of them within the sliver, the others just beside it.
                let x = aim(1.0 / ASPECT, &mut random);
                let target = turn * DVec3::new(x, aim(0.49, &mut random), 0.0);
                let side = DVec3::new(aim(0.7, &mut random), aim(0.7, &mut random), 0.0);
                towards(target, turn * (side + (0.1 + random.unit()) * DVec3::Z))
            })
            .collect();
        let hits = stage.probe(&scene, &bvh, &rays)?;
        let normal = turn * DVec3::Z;
        let tally = Tally::of(&rays, &hits, |point, _, _| point.dot(normal).abs());
        stage.record(
            format!("a {name}wall with a sliver of aspect 10^7: rays that pass through"),
            tally.missed as f64,
            Limit::AtMost(0.0),
        );
        stage.record(
            format!(
                "a {name}wall with a sliver of aspect 10^7: hits off the wall by (of its side)"
            ),
            tally.farthest,
            Limit::AtMost(FARTHEST),
        );
    }

    let scene = splinters(256, &mut random);
    let bvh = build_bvh(&scene, Preset::default())?;
    let rays: Vec<ProbeRay> = (0..RAYS)
        .map(|_| {
            let [a, b, c] = corners(&scene, random.below(256) as u32);
            let (u, v) = (random.unit(), random.unit());
            let target = a + u * (b - a) + v * (1.0 - u) * (c - a);
            towards(
                target,
                target + (0.1 + random.unit()) * random.direction().as_dvec3(),
            )
        })
        .collect();
    let hits = stage.probe(&scene, &bvh, &rays)?;
    let tally = Tally::of(&rays, &hits, |point, triangle, along| {
        let [a, b, c] = corners(&scene, triangle);
        let slant = (b - a).cross(c - a).normalize().dot(along).abs();
        slant * distance_to_rim(point, [a, b, c])
    });
    stage.record_with(
        "splinters of aspect 10^7: hits off them by (of their length), times the cosine of the slant",
        tally.farthest,
        Limit::AtMost(FARTHEST),
        format!(
            "{} of {RAYS} rays hit: a splinter is as wide as a ray is exact",
            RAYS - tally.missed
        ),
    );
    Ok(())
}

fn corners(scene: &Scene, triangle: u32) -> [DVec3; 3] {
    let vertices = scene.geometry.triangles[triangle as usize].vertices;
    vertices.map(|vertex| scene.geometry.positions[vertex as usize].as_dvec3())
}

/// How far a point is from the nearest edge: of a sliver, as good as from its surface.
fn distance_to_rim(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let to_edge = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let share = ((point - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        point.distance(from + share * edge)
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparison has to be able to fail.
    #[test]
    fn misses_and_hits_off_the_surface_are_noticed() {
        let rays = [towards(DVec3::ZERO, DVec3::Z); 3];
        let hit = |t: f32, triangle: u32| ProbeHit {
            t,
            triangle,
            ..ProbeHit::default()
        };
        let height = |point: DVec3, _, _| point.z.abs();
        let right = [hit(1.0, 0), hit(1.0, 1), hit(1.0, 0)];
        assert_eq!(Tally::of(&rays, &right, height), Tally::default());
        let wrong = [hit(1.0, 0), hit(1e30, u32::MAX), hit(1.5, 0)];
        let tally = Tally::of(&rays, &wrong, height);
        assert_eq!((tally.missed, tally.farthest), (1, 0.5));
        let nan = [hit(f32::NAN, 0), hit(1.0, 0), hit(1.0, 0)];
        assert_eq!(Tally::of(&rays, &nan, height).farthest, f64::INFINITY);
    }

    #[test]
    fn the_distance_to_a_splinter_is_that_to_its_edges() {
        let splinter = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 1e-7, 0.0)];
        assert!(distance_to_rim(DVec3::new(0.5, 0.0, 0.0), splinter) < 1e-12);
        assert!((distance_to_rim(DVec3::new(0.5, 0.0, 0.25), splinter) - 0.25).abs() < 1e-12);
        assert!((distance_to_rim(DVec3::new(-1.0, 0.0, 0.0), splinter) - 1.0).abs() < 1e-12);
    }
}
