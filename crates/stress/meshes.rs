//! Closed meshes of many triangles, neighbours sharing their vertices, and what is surely inside of them. Scene space.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use raytree_scene::model::{Material, Scene};

use crate::{random::Random, scenes::Build};

/// A closed mesh.
pub struct Mesh {
    /// For the table.
    pub name: String,
    /// Nothing else in it; its material is double-sided.
    pub scene: Scene,
    /// Bounds of a region inside: origins of rays are tried there.
    pub inner: [Vec3; 2],
    /// Whether a point is inside, and not all too close to the wall: may say no where it is.
    pub contains: Box<dyn Fn(DVec3) -> bool + Sync>,
}

impl Mesh {
    /// A point inside, the same for the same numbers.
    pub fn inside(&self, random: &mut Random) -> Vec3 {
        loop {
            let point = random.within(self.inner[0], self.inner[1]);
            if (self.contains)(point.as_dvec3()) {
                return point;
            }
        }
    }

    /// Corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let geometry = &self.scene.geometry;
        geometry.triangles[triangle]
            .vertices
            .map(|vertex| geometry.positions[vertex as usize])
    }
}

/// A scene with one material, seen from both sides.
#[must_use]
pub fn canvas() -> (Build, u32) {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(Material {
        double_sided: true,
        ..Material::default()
    });
    (build, material)
}

/// An ellipsoid with these half axes: an octahedron, each face cut into `frequency`^2 triangles. 8 frequency^2 in all.
#[must_use]
pub fn ellipsoid(name: &str, centre: Vec3, half: Vec3, frequency: i32) -> Mesh {
    let (mut build, material) = canvas();
    let mut known = HashMap::new();
    let mut vertex = |at: [i32; 3], build: &mut Build| {
        *known.entry(at).or_insert_with(|| {
            let normal = DVec3::from_array(at.map(f64::from)).normalize();
            let place = centre.as_dvec3() + half.as_dvec3() * normal;
            let normal = (normal / half.as_dvec3()).normalize();
            build.vertex(place.as_vec3(), normal.as_vec3())
        })
    };
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|axis| 1 - 2 * ((octant >> axis) & 1));
        let mirrored = sign[0] * sign[1] * sign[2] < 0;
        let mut face = |grid: [[i32; 2]; 3], build: &mut Build| {
            let [a, b, c] = grid.map(|[i, j]| {
                let at = [sign[0] * i, sign[1] * j, sign[2] * (frequency - i - j)];
                vertex(at, build)
            });
            let vertices = if mirrored { [a, c, b] } else { [a, b, c] };
            build.triangle(vertices, material);
        };
        for i in 0..frequency {
            for j in 0..frequency - i {
                face([[i, j], [i + 1, j], [i, j + 1]], &mut build);
                if i + j + 1 < frequency {
                    face([[i + 1, j], [i + 1, j + 1], [i, j + 1]], &mut build);
                }
            }
        }
    }
    // The facets' inner radius is 1 - O(1/frequency^2).
    let shrink = 0.97 - 2.0 / f64::from(frequency * frequency);
    Mesh {
        name: format!("{name}, {} triangles", build.0.geometry.triangles.len()),
        scene: build.0,
        inner: [centre - half, centre + half],
        contains: Box::new(move |point| {
            ((point - centre.as_dvec3()) / half.as_dvec3()).length() < shrink
        }),
    }
}

/// A cylinder of needles, along y: each side two triangles of the whole length, each end a fan.
#[must_use]
pub fn needles(name: &str, sides: u32, radius: f64, length: f64) -> Mesh {
    let (mut build, material) = canvas();
    let ring = |y: f64, build: &mut Build| -> Vec<u32> {
        (0..sides)
            .map(|k| {
                let (sin, cos) =
                    (f64::from(k) / f64::from(sides) * std::f64::consts::TAU).sin_cos();
                let outwards = DVec3::new(cos, 0.0, sin);
                build.vertex(
                    (radius * outwards + y * DVec3::Y).as_vec3(),
                    outwards.as_vec3(),
                )
            })
            .collect()
    };
    let (low, high) = (
        ring(-0.5 * length, &mut build),
        ring(0.5 * length, &mut build),
    );
    let foot = build.vertex(Vec3::NEG_Y * (0.5 * length) as f32, Vec3::NEG_Y);
    let head = build.vertex(Vec3::Y * (0.5 * length) as f32, Vec3::Y);
    for k in 0..sides as usize {
        let next = (k + 1) % sides as usize;
        build.triangle([low[k], high[k], high[next]], material);
        build.triangle([low[k], high[next], low[next]], material);
        build.triangle([foot, low[k], low[next]], material);
        build.triangle([head, high[next], high[k]], material);
    }
    let half = DVec3::new(radius, 0.5 * length, radius);
    Mesh {
        name: format!("{name}, {} triangles", build.0.geometry.triangles.len()),
        scene: build.0,
        inner: [-half.as_vec3(), half.as_vec3()],
        contains: Box::new(move |point| {
            point.x.hypot(point.z) < 0.97 * radius && point.y.abs() < 0.485 * length
        }),
    }
}

/// A box from -0.5 to 0.5 across, floor at -0.25, whose top is a rough terrain around 0: `cells` x `cells`.
#[must_use]
pub fn terrain_box(name: &str, cells: u32, roughness: f64) -> Mesh {
    const FLOOR: f32 = -0.25;
    let (mut build, material) = canvas();
    let mut random = Random::new(11);
    let place = |k: u32| (f64::from(k) / f64::from(cells) - 0.5) as f32;
    let side = cells + 1;
    let layer = |build: &mut Build, mut height: Box<dyn FnMut() -> f32 + '_>| -> Vec<u32> {
        (0..side * side)
            .map(|k| {
                build.vertex(
                    Vec3::new(place(k % side), height(), place(k / side)),
                    Vec3::Y,
                )
            })
            .collect()
    };
    let top = layer(
        &mut build,
        Box::new(|| (roughness * (2.0 * random.unit() - 1.0)) as f32),
    );
    let bottom = layer(&mut build, Box::new(|| FLOOR));
    let at = |x: u32, z: u32| (z * side + x) as usize;
    for z in 0..cells {
        for x in 0..cells {
            let [a, b, c, d] = [at(x, z), at(x, z + 1), at(x + 1, z + 1), at(x + 1, z)];
            build.triangle([top[a], top[b], top[c]], material);
            build.triangle([top[a], top[c], top[d]], material);
            build.triangle([bottom[a], bottom[c], bottom[b]], material);
            build.triangle([bottom[a], bottom[d], bottom[c]], material);
        }
    }
    for k in 0..cells {
        let walls = [
            [at(k, cells), at(k + 1, cells)],
            [at(k + 1, 0), at(k, 0)],
            [at(0, k), at(0, k + 1)],
            [at(cells, k + 1), at(cells, k)],
        ];
        for [a, b] in walls {
            build.triangle([bottom[a], bottom[b], top[b]], material);
            build.triangle([bottom[a], top[b], top[a]], material);
        }
    }
    let ceiling = -1.1 * roughness;
    Mesh {
        name: format!("{name}, {} triangles", build.0.geometry.triangles.len()),
        scene: build.0,
        inner: [Vec3::new(-0.49, FLOOR, -0.49), Vec3::new(0.49, 0.0, 0.49)],
        contains: Box::new(move |point| {
            point.x.abs() < 0.49
                && point.z.abs() < 0.49
                && point.y > f64::from(FLOOR) + 0.01
                && point.y < ceiling
        }),
    }
}

#[cfg(test)]
mod tests {
    use raytree_oracle::{Oracle, Shading};

    use super::*;

    fn small() -> [Mesh; 4] {
        [
            ellipsoid("ball", Vec3::new(0.3, -0.2, 0.1), Vec3::splat(0.5), 6),
            ellipsoid("spindle", Vec3::ZERO, Vec3::new(1.0, 1e-2, 1e-2), 6),
            needles("needles", 40, 0.3, 1.0),
            terrain_box("terrain", 8, 0.05),
        ]
    }

    #[test]
    fn each_edge_belongs_to_two_triangles_that_run_against_each_other() {
        for mesh in small() {
            let mut edges = HashMap::new();
            for triangle in &mesh.scene.geometry.triangles {
                let [a, b, c] = triangle.vertices;
                for edge in [[a, b], [b, c], [c, a]] {
                    *edges.entry(edge).or_insert(0) += 1;
                }
            }
            for (&[a, b], &count) in &edges {
                assert_eq!(count, 1, "{}: {a} {b}", mesh.name);
                assert_eq!(edges.get(&[b, a]), Some(&1), "{}: {b} {a}", mesh.name);
            }
        }
    }

    #[test]
    fn faces_look_outwards_and_what_is_inside_is_inside() {
        for mesh in small() {
            let oracle = Oracle::new(&mesh.scene);
            let mut random = Random::new(1);
            for _ in 0..500 {
                let origin = mesh.inside(&mut random).as_dvec3();
                let direction = random.direction().as_dvec3();
                let hit = oracle
                    .closest_hit(origin.into(), direction.into(), Shading::Pbr)
                    .unwrap_or_else(|| panic!("{}: {origin}", mesh.name));
                assert!(hit.back, "{}: {origin}", mesh.name);
            }
        }
    }
}
