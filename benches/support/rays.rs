//! Scenes and rays that traversal is timed by. Lengths in units of which a scene has 100: obvhs passes by boxes that a ray leaves
//! before t = 1e-4, which must be next to nothing.

use glam::{DVec3, Vec3, vec3};
use raytree::{
    Camera, Scene,
    model::{Light, LightKind},
};
use raytree_gpu::types::{ProbeHit, ProbeRay};
use raytree_stress::{meshes::canvas, random::Random};

/// Rays of a kind: those of a square picture, a ray a pixel.
pub const RAYS: usize = (SIDE * SIDE) as usize;
/// Pixels on the picture's side.
const SIDE: u32 = 1024;
/// Tiles on the picture's side.
const TILES: u32 = SIDE / 8;
/// As `crates/gpu/batch.rs` picks it for so many tiles: a workgroup's neighbours render tiles that lie apart.
const TILE_STRIDE: u32 = 10_125;
/// Tangent of half the picture's opening, 40 degrees.
const OPENING: f32 = 0.364;
/// How far rays that leave a surface begin above it: more than the rounding of a point, little against a triangle.
const ABOVE: f32 = 1e-3;
/// Beyond everything.
const FAR: f32 = 1e4;

/// A scene with where it is seen and lit from.
pub struct Stage {
    pub scene: Scene,
    eye: Vec3,
    light: Vec3,
}

/// Makes a scene.
type Make = fn() -> Stage;

/// The scenes by their names: one that fits a cache, and one that does not.
pub const STAGES: [(&str, Make); 2] = [("spheres", spheres), ("terrain", terrain)];

/// What rays are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From the eye, in the order of the renderer's lanes.
    Primary,
    /// From what primary rays hit to a point light: any hit.
    Shadow,
    /// From there in the mirrored direction.
    Reflected,
    /// From there to anywhere above the surface, by the cosine.
    Diffuse,
    /// From anywhere in the scene's box to anywhere.
    Incoherent,
}

impl Kind {
    pub const ALL: [Self; 5] = [
        Self::Primary,
        Self::Shadow,
        Self::Reflected,
        Self::Diffuse,
        Self::Incoherent,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::Reflected => "reflected",
            Self::Diffuse => "diffuse",
            Self::Incoherent => "incoherent",
        }
    }
}

/// 8 x 5 balls over a plane: 81,922 triangles.
pub fn spheres() -> Stage {
    let (mut build, material) = canvas();
    for ball in 0..40 {
        let place = vec3((ball % 8) as f32 - 3.5, 0.5, (ball / 8) as f32 - 2.0);
        build.ball(12.0 * place, 5.5, 4, material);
    }
    build.square(Vec3::ZERO, Vec3::Y, 50.0, material);
    Stage {
        scene: build.0,
        eye: vec3(30.0, 70.0, 75.0),
        light: vec3(-60.0, 80.0, 40.0),
    }
}

/// Hills of 999,698 triangles.
fn terrain() -> Stage {
    terrain_of(707)
}

/// Hills of `2 side^2` triangles; from afar the same whatever that is.
pub fn terrain_of(side: u32) -> Stage {
    let (mut build, material) = canvas();
    for triangle in hills(side) {
        let [a, b, c] = triangle.map(|point| 100.0 * (point - vec3(0.5, 0.0, 0.5)));
        let normal = (b - a).cross(c - a).normalize();
        let vertices = [a, b, c].map(|corner| build.vertex(corner, normal));
        build.triangle(vertices, material);
    }
    Stage {
        scene: build.0,
        eye: vec3(20.0, 55.0, 80.0),
        light: vec3(-90.0, 40.0, 30.0),
    }
}

/// The sum of sines that a terrain is, `side` squares along a side of 1: steep and flat, long and short triangles, the same
/// every time. `2 side^2` triangles.
pub fn hills(side: u32) -> Vec<[Vec3; 3]> {
    let vertex = |column: u32, row: u32| {
        let (x, z) = (column as f32 / side as f32, row as f32 / side as f32);
        vec3(x, height(x, z), z)
    };
    let squares = (0..side).flat_map(|row| (0..side).map(move |column| (column, row)));
    squares
        .flat_map(|(column, row)| {
            let corners =
                [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(c, r)| vertex(column + c, row + r));
            [
                [corners[0], corners[1], corners[2]],
                [corners[2], corners[1], corners[3]],
            ]
        })
        .collect()
}

/// Of the hills over a point of the unit square.
pub fn height(x: f32, z: f32) -> f32 {
    0.1 * (9.0 * x + 4.0 * z).sin() + 0.03 * (31.0 * x * z).cos() + 0.005 * (170.0 * (x - z)).sin()
}

/// Corners of each of a scene's triangles.
pub fn triangles(scene: &Scene) -> Vec<[Vec3; 3]> {
    let geometry = &scene.geometry;
    let corner = |vertex: u32| geometry.positions[vertex as usize];
    let corners = geometry.triangles.iter().map(|t| t.vertices.map(corner));
    corners.collect()
}

impl Stage {
    /// Corners of each triangle.
    pub fn triangles(&self) -> Vec<[Vec3; 3]> {
        triangles(&self.scene)
    }

    /// The scene with its light, of surfaces that mirror a little, and the view of it: to be rendered.
    pub fn lit(mut self) -> (Scene, Camera) {
        let position = self.light.as_dvec3();
        self.scene.lights.push(Light {
            name: "light".to_owned(),
            kind: LightKind::Point {
                position,
                range: f64::INFINITY,
            },
            // Irradiance 2 in the scene's middle.
            intensity: DVec3::splat(2.0 * position.length_squared()),
        });
        for material in &mut self.scene.materials {
            (material.metallic, material.roughness) = (0.0, 0.0);
        }
        let yfov = 2.0 * f64::from(OPENING).atan();
        let camera = raytree::look_at(self.eye.as_dvec3(), DVec3::ZERO, None, yfov, "eye");
        (self.scene, camera.unwrap_or_else(|error| panic!("{error}")))
    }

    /// A ray for each pixel, in the order of `pixel_of_lane` and `tile_of_workgroup` (`shaders/camera.wgsl`).
    pub fn primary(&self) -> Vec<ProbeRay> {
        (0..RAYS as u32)
            .map(|lane| self.camera_ray(pixel_of_lane(lane)))
            .collect()
    }

    fn camera_ray(&self, [x, y]: [u32; 2]) -> ProbeRay {
        let forward = (-self.eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let place = |pixel: u32| OPENING * ((2 * pixel + 1) as f32 / SIDE as f32 - 1.0);
        ray(
            self.eye,
            (forward + place(x) * right - place(y) * up).normalize(),
            FAR,
        )
    }

    /// Rays that leave what primary rays have hit, in their order, from the first again when there are no more.
    pub fn leaving(&self, kind: Kind, rays: &[ProbeRay], hits: &[ProbeHit]) -> Vec<ProbeRay> {
        let triangles = self.triangles();
        let mut random = Random::new(5);
        let surfaces: Vec<Surface> = rays
            .iter()
            .zip(hits)
            .filter(|(_, hit)| hit.triangle != u32::MAX)
            .map(|(ray, hit)| Surface::of(ray, hit.t, triangles[hit.triangle as usize]))
            .collect();
        assert!(2 * surfaces.len() > RAYS, "half the picture is empty");
        let surfaces = surfaces.iter().cycle().take(RAYS);
        surfaces
            .map(|surface| self.next(kind, surface, &mut random))
            .collect()
    }

    fn next(&self, kind: Kind, surface: &Surface, random: &mut Random) -> ProbeRay {
        let Surface {
            point,
            normal,
            arriving,
        } = *surface;
        match kind {
            Kind::Shadow => {
                let way = self.light - point;
                let shadow = 1;
                ProbeRay {
                    shadow,
                    ..ray(point, way.normalize(), way.length())
                }
            }
            Kind::Diffuse => {
                let direction = (normal + 0.999 * random.direction()).normalize();
                ray(point, direction, FAR)
            }
            _ => ray(point, arriving - 2.0 * arriving.dot(normal) * normal, FAR),
        }
    }

    /// Rays without any order.
    pub fn incoherent(&self) -> Vec<ProbeRay> {
        let points = || self.scene.geometry.positions.iter();
        let min = points().fold(Vec3::INFINITY, |min, p| min.min(*p));
        let max = points().fold(Vec3::NEG_INFINITY, |max, p| max.max(*p));
        let mut random = Random::new(9);
        (0..RAYS)
            .map(|_| ray(random.within(min, max), random.direction(), FAR))
            .collect()
    }
}

/// Where a ray has ended.
struct Surface {
    /// A little above it, on the side that was hit.
    point: Vec3,
    /// To that side.
    normal: Vec3,
    /// The ray's direction.
    arriving: Vec3,
}

impl Surface {
    fn of(ray: &ProbeRay, t: f32, [a, b, c]: [Vec3; 3]) -> Self {
        let arriving = Vec3::from(ray.direction);
        let across = (b - a).cross(c - a).normalize();
        let normal = -across.dot(arriving).signum() * across;
        Self {
            point: Vec3::from(ray.origin) + t * arriving + ABOVE * normal,
            normal,
            arriving,
        }
    }
}

fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> ProbeRay {
    ProbeRay {
        origin: origin.to_array(),
        t_max,
        direction: direction.to_array(),
        shadow: 0,
    }
}

fn pixel_of_lane(index: u32) -> [u32; 2] {
    let (workgroup, lane) = (index / 64, index % 64);
    let tile = workgroup * TILE_STRIDE % (TILES * TILES);
    let (block, within) = (lane / 8, lane % 8);
    [
        8 * (tile % TILES) + (block % 2) * 4 + within % 4,
        8 * (tile / TILES) + (block / 2) * 2 + within / 4,
    ]
}
