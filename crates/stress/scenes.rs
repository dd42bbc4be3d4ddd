//! Scenes made in code, for who knows the answer. Scene space is their world space.

use glam::{DVec3, Vec3, Vec4};
use raytree_scene::{
    environment::{Environment, EquirectMap},
    model::{Background, Camera, Light, LightKind, Material, Projection, Scene, Triangle, Volume},
};

use crate::random::Random;

/// The sides of a box, counter-clockwise seen from outside: bit k of a corner says that it lies at the maximum of axis k.
pub(crate) const CUBOID_SIDES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// A scene under construction.
#[derive(Clone, Default)]
pub struct Build(pub Scene);

impl Build {
    /// No geometry, no light, and this colour wherever a ray hits nothing.
    pub fn before(background: [f32; 3]) -> Self {
        let mut build = Self::default();
        build.0.nodes.push("all".to_owned());
        build.0.surroundings.background = Background::Color(background.into());
        build
    }

    /// No geometry, no light, and the same radiance from everywhere.
    pub fn inside(radiance: [f32; 3]) -> Self {
        let mut build = Self::before([0.0; 3]);
        build.0.surroundings.background = Background::Environment;
        build.0.surroundings.environment = Some(unfiltered(EquirectMap {
            width: 8,
            height: 4,
            texels: vec![radiance; 32],
        }));
        build
    }

    /// A material to make surfaces of.
    pub fn material(&mut self, material: Material) -> u32 {
        self.0.materials.push(material);
        self.0.materials.len() as u32 - 1
    }

    /// A light of this intensity in each channel.
    pub fn light(&mut self, kind: LightKind, intensity: f64) {
        self.0.lights.push(Light {
            name: "light".to_owned(),
            kind,
            intensity: DVec3::splat(intensity),
        });
    }

    /// A vertex; its index.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.0.geometry.positions.push(position);
        self.0.geometry.normals.push(normal);
        self.0.geometry.positions.len() as u32 - 1
    }

    /// A triangle of vertices that are there, counter-clockwise.
    pub fn triangle(&mut self, vertices: [u32; 3], material: u32) {
        self.0.geometry.triangles.push(Triangle {
            vertices,
            material,
            node: 0,
        });
    }

    /// A flat quadrangle, its corners counter-clockwise.
    pub fn quad(&mut self, corners: [Vec3; 4], material: u32) {
        let [a, b, _, d] = corners;
        let normal = (b - a).cross(d - a).normalize();
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner, normal));
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// A square of half side `half` around `centre` that faces `normal`.
    pub fn square(&mut self, centre: Vec3, normal: Vec3, half: f32, material: u32) {
        let (right, up) = normal.normalize().any_orthonormal_pair();
        let (right, up) = (half * right, half * up);
        let corners = [
            centre - right - up,
            centre + right - up,
            centre + right + up,
            centre - right + up,
        ];
        let front = (corners[1] - corners[0])
            .cross(corners[3] - corners[0])
            .dot(normal)
            > 0.0;
        let [a, b, c, d] = corners;
        self.quad(if front { corners } else { [d, c, b, a] }, material);
    }

    /// A box, flat sides facing outwards.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, material: u32) {
        let corner = |k: usize| {
            let choose = |axis: usize| {
                if (k >> axis) & 1 == 0 {
                    min[axis]
                } else {
                    max[axis]
                }
            };
            Vec3::new(choose(0), choose(1), choose(2))
        };
        for side in CUBOID_SIDES {
            self.quad(side.map(corner), material);
        }
    }

    /// A ball with smooth normals: an octahedron, each face cut into four `levels` times. Closed: neighbours share vertices.
    pub fn ball(&mut self, centre: Vec3, radius: f32, levels: u32, material: u32) {
        let mut corners = vec![
            Vec3::X,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
        ];
        let mut faces: Vec<[usize; 3]> = vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        for _ in 0..levels {
            let mut between = std::collections::BTreeMap::new();
            let mut middle = |a: usize, b: usize, corners: &mut Vec<Vec3>| {
                *between.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    corners.push((corners[a] + corners[b]).normalize());
                    corners.len() - 1
                })
            };
            let mut finer = Vec::with_capacity(4 * faces.len());
            for [a, b, c] in faces {
                let [ab, bc, ca] =
                    [(a, b), (b, c), (c, a)].map(|(p, q)| middle(p, q, &mut corners));
                finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            faces = finer;
        }
        let first = self.0.geometry.positions.len() as u32;
        for corner in corners {
            self.vertex(centre + radius * corner, corner);
        }
        for face in faces {
            self.triangle(face.map(|corner| first + corner as u32), material);
        }
    }

    /// Triangles of all sizes and directions, anywhere in the box from -1 to 1.
    pub fn soup(&mut self, count: usize, random: &mut Random, material: u32) {
        for _ in 0..count {
            let middle = random.within(Vec3::NEG_ONE, Vec3::ONE);
            let size = 0.3 * random.unit().powi(4) as f32 + 0.002;
            let corners = [(); 3].map(|()| middle + size * random.direction());
            let normal = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or(Vec3::Y);
            let vertices = corners.map(|corner| self.vertex(corner, normal));
            self.triangle(vertices, material);
        }
    }
}

/// An environment whose rough levels are the map itself: right for a constant map, and for who sees but mirrors.
pub fn unfiltered(map: EquirectMap) -> Environment {
    let rough = std::array::from_fn(|_| map.clone());
    Environment {
        rough,
        irradiance: map.clone(),
        radiance: map,
        rotation: 0.7,
    }
}

/// A smooth solid of this index that absorbs nothing.
pub fn clear_glass(ior: f32) -> Material {
    Material {
        base_color: Vec4::ONE,
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        ior,
        volume: Some(Volume {
            attenuation_color: Vec3::ONE,
            attenuation_distance: f64::INFINITY,
        }),
        ..Material::default()
    }
}

/// A diffuse dielectric of index 1, which reflects nothing but by its base colour.
pub fn matte(base: [f32; 3]) -> Material {
    let [r, g, b] = base;
    Material {
        base_color: Vec4::new(r, g, b, 1.0),
        metallic: 0.0,
        roughness: 1.0,
        ior: 1.0,
        ..Material::default()
    }
}

/// A camera that looks from `from` to `to` through a narrow opening: `yfov` in radians.
pub fn pinhole(from: Vec3, to: Vec3, yfov: f64) -> Camera {
    camera(from, to, Projection::Perspective { yfov, aspect: None })
}

/// A camera with parallel rays, `half` the half side of its view.
pub fn parallel(from: Vec3, to: Vec3, half: f64) -> Camera {
    camera(
        from,
        to,
        Projection::Orthographic {
            xmag: half,
            ymag: half,
        },
    )
}

fn camera(from: Vec3, to: Vec3, projection: Projection) -> Camera {
    let forward = (to - from).as_dvec3().normalize();
    let (right, _) = forward.any_orthonormal_pair();
    let up = right.cross(forward);
    Camera {
        name: "test".to_owned(),
        position: from.as_dvec3(),
        right,
        up,
        forward,
        projection,
    }
}
