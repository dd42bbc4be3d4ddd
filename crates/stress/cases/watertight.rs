//! From inside a closed mesh no ray escapes: not at edges, not at vertices, not along an axis.

use glam::Vec3;
use raytree_gpu::types::{ProbeHit, ProbeRay};

use crate::{
    meshes::{Mesh, ellipsoid, needles, terrain_box},
    random::Random,
    report::Limit,
    stage::{Stage, StressError},
};

/// Rays a mesh.
const RAYS: usize = 10_000_000;

/// Rays that are made, traced and judged at once: 48 MiB.
const BATCH: usize = 1 << 20;

/// Rays are made on both of a small machine's cores.
const THREADS: usize = 2;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let meshes: [fn() -> Mesh; 4] = [
        || ellipsoid("a ball", Vec3::ZERO, Vec3::ONE, 354),
        || {
            ellipsoid(
                "a ball of 1e-4, off centre",
                Vec3::new(0.9, 0.7, -0.8),
                Vec3::splat(1e-4),
                64,
            )
        },
        || needles("needles of aspect 16,000", 300, 0.003, 1.0),
        || terrain_box("a terrain in a box", 256, 0.02),
    ];
    for mesh in meshes {
        judge_mesh(stage, &mesh())?;
    }
    Ok(())
}

fn judge_mesh(stage: &mut Stage<'_>, mesh: &Mesh) -> Result<(), StressError> {
    let prober = stage.prober(&mesh.scene)?;
    let mut escapes = Escapes::default();
    let mut axis_parallel = 0;
    for first in (0..RAYS).step_by(BATCH) {
        let rays = make_rays(mesh, first, BATCH.min(RAYS - first));
        axis_parallel += rays.iter().filter(|ray| is_axis_parallel(ray)).count();
        let hits = prober.trace(&rays)?;
        escapes.add(&rays, &hits);
        stage.count_rays(rays.len() as u64);
    }
    let note = match escapes.first {
        Some(ray) => format!("the first that escaped: {ray:?}"),
        None => format!("half of them at vertices and edges, {axis_parallel} along an axis"),
    };
    let parameter = format!("rays that escape from {}", mesh.name);
    stage.record_with(parameter, escapes.count as f64, Limit::AtMost(0.0), note);
    Ok(())
}

/// Rays that met nothing.
#[derive(Debug, Default)]
struct Escapes {
    count: usize,
    first: Option<ProbeRay>,
}

impl Escapes {
    fn add(&mut self, rays: &[ProbeRay], hits: &[ProbeHit]) {
        let escaped = rays
            .iter()
            .zip(hits)
            .filter(|(_, hit)| hit.triangle == u32::MAX);
        for (ray, _) in escaped {
            self.count += 1;
            self.first.get_or_insert(*ray);
        }
    }
}

fn is_axis_parallel(ray: &ProbeRay) -> bool {
    ray.direction.iter().filter(|&&d| d == 0.0).count() == 2
}

/// The rays `first..first + count` of a mesh, the same on any number of threads.
fn make_rays(mesh: &Mesh, first: usize, count: usize) -> Vec<ProbeRay> {
    let mut rays = vec![ProbeRay::default(); count];
    let share = count.div_ceil(THREADS);
    std::thread::scope(|scope| {
        for (part, rays) in rays.chunks_mut(share).enumerate() {
            let seed = (first + part * share) as u64;
            scope.spawn(move || {
                let mut random = Random::new(seed);
                for (k, ray) in rays.iter_mut().enumerate() {
                    *ray = make_ray(mesh, k, &mut random);
                }
            });
        }
    });
    rays
}

/// Of eight rays four go anywhere, two to a vertex, two to an edge; of the latter four one runs along an axis and one across it.
fn make_ray(mesh: &Mesh, k: usize, random: &mut Random) -> ProbeRay {
    let (origin, direction) = match k % 8 {
        0..4 => (mesh.inside(random), random.direction()),
        kind => {
            let target = target(mesh, kind >= 6, random);
            let origin = match kind {
                5 => along_an_axis(mesh, target, random),
                7 => across_an_axis(mesh, target, random),
                _ => None,
            };
            let origin = origin.unwrap_or_else(|| mesh.inside(random));
            // Not normalised, which would lead it past the target.
            (origin, target - origin)
        }
    };
    ProbeRay {
        origin: origin.to_array(),
        t_max: 1e30,
        direction: direction.to_array(),
        shadow: 0,
    }
}

/// A corner of a triangle, or a point of one of its edges: the middle, half of the times.
fn target(mesh: &Mesh, edge: bool, random: &mut Random) -> Vec3 {
    let corners = mesh.corners(random.below(mesh.scene.geometry.triangles.len()));
    let k = random.below(3);
    let (a, b) = (corners[k], corners[(k + 1) % 3]);
    if !edge {
        a
    } else if random.below(2) == 0 {
        0.5 * a + 0.5 * b
    } else {
        a.lerp(b, random.unit() as f32)
    }
}

/// A point inside that differs from the target in one coordinate only; `None` if none was found.
fn along_an_axis(mesh: &Mesh, target: Vec3, random: &mut Random) -> Option<Vec3> {
    let inside = mesh.inside(random);
    let axes = random.below(3);
    (0..3)
        .map(|k| {
            let axis = (axes + k) % 3;
            let mut origin = target;
            origin[axis] = inside[axis];
            origin
        })
        .find(|&origin| (mesh.contains)(origin.as_dvec3()))
}

/// A point inside that has one coordinate of the target; `None` if none was found.
fn across_an_axis(mesh: &Mesh, target: Vec3, random: &mut Random) -> Option<Vec3> {
    let mut origin = mesh.inside(random);
    let axis = random.below(3);
    origin[axis] = target[axis];
    (mesh.contains)(origin.as_dvec3()).then_some(origin)
}

#[cfg(test)]
mod tests {
    use raytree_oracle::{Oracle, Shading};

    use super::*;

    fn oracle_hits(mesh: &Mesh, rays: &[ProbeRay]) -> Vec<ProbeHit> {
        let oracle = Oracle::new(&mesh.scene);
        let hit = |ray: &ProbeRay| {
            let found = oracle.closest_hit(
                ray.origin.map(f64::from),
                ray.direction.map(f64::from),
                Shading::Pbr,
            );
            found.map_or(u32::MAX, |hit| hit.triangle as u32)
        };
        rays.iter()
            .map(|ray| ProbeHit {
                triangle: hit(ray),
                ..ProbeHit::default()
            })
            .collect()
    }

    /// The count has to be able to be above 0: of a mesh with a hole.
    #[test]
    fn a_hole_is_noticed() {
        let mut mesh = ellipsoid("a ball", Vec3::ZERO, Vec3::ONE, 4);
        let rays = make_rays(&mesh, 0, 4000);
        let mut escapes = Escapes::default();
        escapes.add(&rays, &oracle_hits(&mesh, &rays));
        assert_eq!(escapes.count, 0, "{escapes:?}");
        mesh.scene.geometry.triangles.pop();
        escapes.add(&rays, &oracle_hits(&mesh, &rays));
        assert!(escapes.count > 10 && escapes.first.is_some());
    }

    #[test]
    fn half_the_rays_are_aimed_and_some_run_along_axes() {
        for mesh in [
            ellipsoid("a ball", Vec3::ZERO, Vec3::ONE, 16),
            terrain_box("a terrain in a box", 8, 0.02),
        ] {
            let rays = make_rays(&mesh, 0, 8000);
            let axis = rays.iter().filter(|ray| is_axis_parallel(ray)).count();
            assert!(axis > 600, "{axis}");
            let zero = |ray: &&ProbeRay| ray.direction.contains(&0.0) && !is_axis_parallel(ray);
            assert!(rays.iter().filter(zero).count() > 300);
            assert_eq!(rays, make_rays(&mesh, 0, 8000));
        }
    }
}
