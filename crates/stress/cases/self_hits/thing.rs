//! A thing of 1e-4 m that lies on a plane of 1e6 m, seen close up: in scene space the plane's side is 1, the thing 1e-10, and the
//! camera, a few sizes of the thing away, is the origin.

use glam::Vec3;
use raytree_gpu::types::{LEAVING_ALONG, SecondaryRay};
use raytree_scene::model::{Material, Scene};

use super::rays::{leaving, point_of, ray};
use crate::{random::Random, scenes::Build};

/// Of the thing.
const SIZE: f32 = 1e-10;
/// Of the plane below the camera.
const DEPTH: f32 = 2.0 * SIZE;
const PLACE: Vec3 = Vec3::new(0.5 * SIZE, 0.5 * SIZE - DEPTH, -3.0 * SIZE);

/// Half of the rays go to the plane around the thing, half to the thing; from the plane half go on to the thing.
pub(super) fn scene_and_rays(count: usize) -> (Scene, Vec<SecondaryRay>) {
    let scene = scene();
    let mut random = Random::new(29);
    let on_thing = |random: &mut Random| {
        let triangle =
            scene.geometry.triangles[2 + random.below(scene.geometry.triangles.len() - 2)];
        let corners = triangle
            .vertices
            .map(|vertex| scene.geometry.positions[vertex as usize]);
        point_of(corners, random)
    };
    let rays = (0..count)
        .map(|_| {
            if random.below(2) == 0 {
                let target = on_thing(&mut random);
                return ray(Vec3::ZERO, target, leaving(&mut random));
            }
            let around = 3.0 * SIZE * random.direction();
            let target = Vec3::new(PLACE.x + around.x, -DEPTH, PLACE.z + around.z);
            let next = if random.below(2) == 0 {
                let next = on_thing(&mut random) - target;
                (LEAVING_ALONG, next.as_dvec3().normalize())
            } else {
                leaving(&mut random)
            };
            ray(Vec3::ZERO, target, next)
        })
        .collect();
    (scene, rays)
}

fn scene() -> Scene {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(Material {
        double_sided: true,
        ..Material::default()
    });
    build.square(Vec3::new(0.1, -DEPTH, 0.2), Vec3::Y, 0.5, material);
    build.ball(PLACE, 0.5 * SIZE, 4, material);
    build.0
}
