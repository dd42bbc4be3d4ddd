//! What the case is made of: blocks and balls of clear matter under a sky that is different in every direction.

use glam::{DVec3, Quat, Vec3};
use raytree_gpu::RenderSettings;
use raytree_scene::{
    environment::EquirectMap,
    model::{Background, Camera, LightKind, Material, Scene, Volume},
};

use crate::scenes::{Build, CUBOID_SIDES, clear_glass, matte, pinhole, unfiltered};

/// How the sides of a block are cut into triangles.
#[derive(Clone, Copy)]
pub(super) enum Cut {
    /// By the diagonal of corners 0 and 2.
    Diagonal,
    /// By the other one.
    Across,
    /// Into four, around a point that is not the middle.
    Fan,
}

/// A scene of blocks, all turned by the same rotation about the origin: unturned, faces that should coincide do so exactly,
/// turned, they do but for the rounding of their corners.
pub(super) struct Blocks {
    pub build: Build,
    pub turn: Quat,
}

/// Some rotation that leaves no coordinate round.
pub(super) fn slanted() -> Quat {
    Quat::from_axis_angle(Vec3::new(0.3, 0.8, -0.52).normalize(), 0.77)
}

impl Blocks {
    pub fn new(turn: Quat) -> Self {
        let mut build = Build::before([0.0; 3]);
        build.0.surroundings.background = Background::Environment;
        build.0.surroundings.environment = Some(unfiltered(sloping_sky()));
        Self { build, turn }
    }

    /// A light, so that shadow rays cross the solids too.
    pub fn lit(mut self) -> Self {
        let direction = self.turn * Vec3::new(-0.35, -0.8, -0.4).normalize();
        let direction = direction.as_dvec3().normalize();
        self.build.light(LightKind::Directional { direction }, 1.5);
        self
    }

    /// A block with flat sides that face outwards.
    pub fn block(&mut self, min: Vec3, max: Vec3, material: u32, cut: Cut) {
        let corner = |k: usize| {
            let choose = |axis: usize| if (k >> axis) & 1 == 0 { min } else { max }[axis];
            self.turn * Vec3::new(choose(0), choose(1), choose(2))
        };
        for side in CUBOID_SIDES {
            side_of(&mut self.build, side.map(corner), material, cut);
        }
    }

    /// A horizontal matte square, seen from above.
    pub fn floor(&mut self, y: f32, half: f32, material: u32) {
        let corners = [[-half, half], [half, half], [half, -half], [-half, -half]];
        let corners = corners.map(|[x, z]| self.turn * Vec3::new(x, y, z));
        side_of(&mut self.build, corners, material, Cut::Diagonal);
    }

    pub fn camera(&self, from: Vec3, to: Vec3, yfov: f64) -> Camera {
        pinhole(self.turn * from, self.turn * to, yfov)
    }
}

fn side_of(build: &mut Build, corners: [Vec3; 4], material: u32, cut: Cut) {
    let [a, b, c, d] = corners;
    match cut {
        Cut::Diagonal => build.quad([a, b, c, d], material),
        Cut::Across => build.quad([b, c, d, a], material),
        Cut::Fan => {
            let normal = (b - a).cross(d - a).normalize();
            let middle = a + 0.37 * (b - a) + 0.61 * (d - a);
            let [a, b, c, d, m] = [a, b, c, d, middle].map(|corner| build.vertex(corner, normal));
            for side in [[a, b, m], [b, c, m], [c, d, m], [d, a, m]] {
                build.triangle(side, material);
            }
        }
    }
}

/// Radiance that grows by about the same with each component of the direction.
fn sloping_sky() -> EquirectMap {
    let (width, height) = (512_u32, 256_u32);
    let texel = |k: u32| {
        let (x, y) = (k % width, k / width);
        let turn = (0.5 - (f64::from(x) + 0.5) / f64::from(width)) * std::f64::consts::TAU;
        let polar = (f64::from(y) + 0.5) / f64::from(height) * std::f64::consts::PI;
        let d = DVec3::new(
            polar.sin() * turn.sin(),
            polar.cos(),
            polar.sin() * turn.cos(),
        );
        (DVec3::splat(0.5) + 0.4 * d).as_vec3().to_array()
    };
    EquirectMap {
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
    }
}

/// A change of radiance of `sloping_sky` is at least this share of the change of direction, radians.
pub(super) const SLOPE: f64 = 0.4;

/// A clear solid. `sigma`: absorption of the red channel over a unit of length; the others absorb less.
pub(super) fn solid(ior: f32, sigma: f32, specular: f32) -> Material {
    Material {
        specular,
        volume: Some(Volume {
            attenuation_color: Vec3::new((-sigma).exp(), (-0.5 * sigma).exp(), 1.0),
            attenuation_distance: if sigma > 0.0 { 1.0 } else { f64::INFINITY },
        }),
        ..clear_glass(ior)
    }
}

pub(super) fn water() -> Material {
    solid(1.33, 0.4, 1.0)
}

pub(super) fn glass() -> Material {
    solid(1.5, 0.1, 1.0)
}

pub(super) fn stone() -> Material {
    matte([0.6, 0.5, 0.3])
}

/// A picture that is small enough for the oracle.
pub(super) fn settings(camera: Camera) -> RenderSettings {
    let mut settings = RenderSettings::new(64, 48, camera);
    settings.max_depth = 6;
    settings
}

/// A single ray: a picture of one pixel, seen through next to no angle.
pub(super) fn ray(from: Vec3, direction: DVec3) -> RenderSettings {
    let mut camera = pinhole(from, from + Vec3::X, 1e-6);
    camera.forward = direction.normalize();
    let (right, up) = camera.forward.any_orthonormal_pair();
    (camera.right, camera.up) = (right, up);
    let mut settings = RenderSettings::new(1, 1, camera);
    settings.min_weight = 0.0;
    settings
}

/// The same scene with every triangle once more, in a mesh of its own.
pub(super) fn doubled(mut scene: Scene) -> Scene {
    let triangles = scene.geometry.triangles.clone();
    let node = scene.nodes.len() as u32;
    scene.nodes.push("copy".to_owned());
    scene.geometry.triangles.extend(
        triangles
            .into_iter()
            .map(|triangle| raytree_scene::model::Triangle { node, ..triangle }),
    );
    scene
}
