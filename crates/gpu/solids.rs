//! The media of a scene in the order of their rank, and those that a camera is in: "Media" in `shaders/README.md`. In f64: it is
//! done once a picture.

use std::f64::consts::PI;

use glam::DVec3;
use raytree_scene::model::{Camera, Scene, Triangle};

use crate::{settings::Shading, types::Medium, upload::medium};

/// What the shaders' stack of media holds.
const MEDIA_DEPTH: usize = 8;

/// The different media of a scene, the lowest rank first.
pub(crate) struct RankedMedia {
    pub(crate) media: Vec<Medium>,
    /// Of the medium behind the front faces of each material, if it bounds a solid: an index into `media`.
    pub(crate) rank_of_material: Vec<Option<u32>>,
}

impl RankedMedia {
    pub(crate) fn of(scene: &Scene, shading: Shading) -> Self {
        let of_material: Vec<Option<Medium>> = scene
            .materials
            .iter()
            .map(|material| medium(material, shading))
            .collect();
        let mut media: Vec<Medium> = Vec::new();
        for &medium in of_material.iter().flatten() {
            if !media.contains(&medium) {
                media.push(medium);
            }
        }
        let mut volumes = vec![0.0; media.len()];
        if !media.is_empty() {
            for triangle in &scene.geometry.triangles {
                let found = of_material[triangle.material as usize];
                if let Some(place) = media.iter().position(|m| Some(*m) == found) {
                    let [a, b, c] = corners(scene, triangle);
                    volumes[place] += a.dot(b.cross(c)) / 6.0;
                }
            }
        }
        let mut order: Vec<usize> = (0..media.len()).collect();
        // Stable: the medium of an earlier material has the lower rank.
        order.sort_by_key(|&place| (media[place].priority, -size_class(volumes[place])));
        let media: Vec<Medium> = order.iter().map(|&place| media[place]).collect();
        let rank = |found: &Medium| {
            media
                .iter()
                .position(|m| m == found)
                .map(|rank| rank as u32)
        };
        let rank_of_material = of_material
            .iter()
            .map(|found| found.as_ref().and_then(rank))
            .collect();
        Self {
            media,
            rank_of_material,
        }
    }
}

/// Volumes that differ by less than a thousandth are equal: what makes two blocks alike must not hang on rounding.
fn size_class(volume: f64) -> i64 {
    (1024.0 * volume.abs().max(1e-300).log2()).round() as i64
}

fn corners(scene: &Scene, triangle: &Triangle) -> [DVec3; 3] {
    triangle
        .vertices
        .map(|vertex| scene.geometry.positions[vertex as usize].as_dvec3())
}

/// The stack of media that rays of this camera start in, as `shaders/media.wgsl` packs it. Media that don't fit are the outermost
/// of the lowest priority.
pub(crate) fn camera_media(scene: &Scene, shading: Shading, camera: &Camera) -> [u32; 2] {
    let ranked = RankedMedia::of(scene, shading);
    let faces = faces_of_solids(scene, &ranked);
    let mut inside: Vec<u32> = Vec::new();
    let turns = winding_numbers(&faces, ranked.media.len(), camera.position);
    for (rank, turns) in (0_u32..).zip(turns) {
        // Inside an open mesh is where it covers more than half of what is around.
        let times = (turns - 0.5).ceil().clamp(0.0, MEDIA_DEPTH as f64);
        inside.extend(std::iter::repeat_n(rank, times as usize));
    }
    if inside.is_empty() {
        return [0; 2];
    }
    let innermost_first = order_of_leaving(&faces, inside, camera);
    let mut stack: Vec<u32> = innermost_first;
    // Stable: among equals the innermost stays on top.
    stack.sort_by_key(|&rank| std::cmp::Reverse(ranked.media[rank as usize].priority));
    let mut packed = [0_u32; 2];
    for (place, rank) in stack.into_iter().take(MEDIA_DEPTH).enumerate() {
        packed[place / 4] |= (rank + 1) << (8 * (place % 4));
    }
    packed
}

/// A triangle that bounds a solid.
struct Face {
    corners: [DVec3; 3],
    rank: u32,
}

fn faces_of_solids(scene: &Scene, ranked: &RankedMedia) -> Vec<Face> {
    let triangles = scene.geometry.triangles.iter();
    let face = |triangle: &Triangle| {
        ranked.rank_of_material[triangle.material as usize].map(|rank| Face {
            corners: corners(scene, triangle),
            rank,
        })
    };
    triangles.filter_map(face).collect()
}

/// How often the faces of each medium wind around `point`: the sum of their signed solid angles, over 4 pi (Jacobson, Kavan and
/// Sorkine-Hornung 2013).
fn winding_numbers(faces: &[Face], media: usize, point: DVec3) -> Vec<f64> {
    let mut turns = vec![0.0; media];
    for face in faces {
        turns[face.rank as usize] += solid_angle(face.corners.map(|c| c - point)) / (4.0 * PI);
    }
    turns
}

/// Of a triangle as seen from the origin, positive from behind (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let rest = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    if volume == 0.0 {
        return 0.0;
    }
    2.0 * volume.atan2(rest)
}

/// The media `inside` in the order in which a ray along the camera's axis leaves them: a back face for which no front face came
/// before leads out of a solid that the ray began in.
fn order_of_leaving(faces: &[Face], mut inside: Vec<u32>, camera: &Camera) -> Vec<u32> {
    let mut met: Vec<(f64, u32, bool)> = faces
        .iter()
        .filter_map(|face| {
            distance(face, camera.position, camera.forward).map(|(t, back)| (t, face.rank, back))
        })
        .collect();
    // In one place the solid of the higher rank is the inner one.
    met.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)).then(a.2.cmp(&b.2)));
    // A ray through an edge meets both of its triangles.
    met.dedup();
    let mut entered: Vec<u32> = Vec::new();
    let mut left = Vec::with_capacity(inside.len());
    for (_, rank, back) in met {
        if !back {
            entered.push(rank);
        } else if let Some(place) = entered.iter().rposition(|&other| other == rank) {
            entered.remove(place);
        } else if let Some(place) = inside.iter().position(|&other| other == rank) {
            inside.remove(place);
            left.push(rank);
        }
    }
    // Those that it never leaves have holes: they are outermost, the highest rank first.
    left.extend(inside.into_iter().rev());
    left
}

/// Where a ray meets a face, and whether from behind (Moeller and Trumbore 1997).
fn distance(face: &Face, origin: DVec3, direction: DVec3) -> Option<(f64, bool)> {
    let [a, b, c] = face.corners;
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let q = s.cross(e1);
    let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
    let t = e2.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, determinant < 0.0))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use raytree_scene::{
        default_view::frame_scene,
        model::{Material, Volume},
    };

    use super::*;

    fn solid(ior: f32, priority: i32) -> Material {
        Material {
            metallic: 0.0,
            transmission: 1.0,
            ior,
            priority,
            volume: Some(Volume {
                attenuation_color: Vec3::ONE,
                attenuation_distance: f64::INFINITY,
            }),
            ..Material::default()
        }
    }

    /// Cubes around the origin: half side and material of each.
    fn cubes(materials: Vec<Material>, cubes: &[(f32, u32)]) -> Scene {
        let mut scene = Scene {
            materials,
            ..Scene::default()
        };
        for &(half, material) in cubes {
            let first = scene.geometry.positions.len() as u32;
            for k in 0..8 {
                let sign = |bit: u32| if k & bit == 0 { -half } else { half };
                scene
                    .geometry
                    .positions
                    .push(Vec3::new(sign(1), sign(2), sign(4)));
            }
            for [a, b, c, d] in [
                [0, 4, 6, 2],
                [1, 3, 7, 5],
                [0, 1, 5, 4],
                [2, 6, 7, 3],
                [0, 2, 3, 1],
                [4, 5, 7, 6],
            ] {
                for vertices in [[a, b, c], [a, c, d]] {
                    scene.geometry.triangles.push(Triangle {
                        vertices: vertices.map(|vertex| first + vertex),
                        material,
                        node: 0,
                    });
                }
            }
        }
        scene
    }

    fn seen_from(scene: &Scene, position: DVec3) -> [u32; 2] {
        let mut camera = frame_scene(DVec3::NEG_ONE, DVec3::ONE, 1.0);
        camera.position = position;
        camera_media(scene, Shading::Pbr, &camera)
    }

    #[test]
    fn the_larger_solid_has_the_lower_rank_and_priority_comes_first() {
        let scene = cubes(vec![solid(1.5, 0), solid(1.3, 0)], &[(0.25, 0), (1.0, 1)]);
        assert_eq!(
            RankedMedia::of(&scene, Shading::Pbr).rank_of_material,
            [Some(1), Some(0)]
        );
        let scene = cubes(vec![solid(1.5, -1), solid(1.3, 0)], &[(0.25, 0), (1.0, 1)]);
        assert_eq!(
            RankedMedia::of(&scene, Shading::Pbr).rank_of_material,
            [Some(0), Some(1)]
        );
        let alike = cubes(vec![solid(1.5, 0), solid(1.5, 0)], &[(0.25, 0), (1.0, 1)]);
        assert_eq!(RankedMedia::of(&alike, Shading::Pbr).media.len(), 1);
    }

    #[test]
    fn a_camera_starts_in_what_is_around_it() {
        // Water (rank 0) around glass (rank 1) around water.
        let scene = cubes(
            vec![solid(1.33, 0), solid(1.5, 0)],
            &[(1.0, 0), (0.5, 1), (0.25, 0)],
        );
        let place = |x: f64| seen_from(&scene, DVec3::new(x, 0.01, 0.02));
        assert_eq!(place(2.0), [0, 0]);
        assert_eq!(place(0.7), [0x01, 0]);
        assert_eq!(place(0.4), [0x0102, 0]);
        assert_eq!(place(0.1), [0x01_0201, 0]);
    }

    #[test]
    fn priority_beats_depth() {
        let scene = cubes(vec![solid(1.33, 1), solid(1.5, 0)], &[(1.0, 0), (0.5, 1)]);
        // Water has rank 1 here, and is on top although glass is nested in it.
        assert_eq!(seen_from(&scene, DVec3::splat(0.1)), [0x0102, 0]);
    }

    #[test]
    fn a_box_with_a_lid_off_is_still_around_its_inside() {
        let mut scene = cubes(vec![solid(1.5, 0)], &[(0.5, 0)]);
        scene.geometry.triangles.truncate(10);
        assert_eq!(seen_from(&scene, DVec3::new(0.0, 0.0, -0.2)), [1, 0]);
        assert_eq!(seen_from(&scene, DVec3::new(0.0, 0.0, 0.7)), [0, 0]);
        // A bubble, seen from its inside: its faces look inwards.
        for triangle in &mut scene.geometry.triangles {
            triangle.vertices.reverse();
        }
        assert_eq!(seen_from(&scene, DVec3::ZERO), [0, 0]);
    }

    #[test]
    fn solid_angles_of_an_octant_and_of_its_back() {
        let corners = [DVec3::X, DVec3::Y, DVec3::Z];
        assert!((solid_angle(corners) - 0.5 * PI).abs() < 1e-15);
        let [a, b, c] = corners;
        assert!((solid_angle([c, b, a]) + 0.5 * PI).abs() < 1e-15);
    }
}
