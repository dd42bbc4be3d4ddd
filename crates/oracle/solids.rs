//! The media of a scene by rank, and those around a camera: "Media" in `shaders/README.md`.

use std::f64::consts::PI;
use std::sync::{Mutex, OnceLock, PoisonError};

use raytree_scene::model::Camera;

use crate::intersect::{Probe, Ray};
use crate::media::{Media, Medium};
use crate::render::Shading;
use crate::vec::Vec3;
use crate::{Oracle, material};

/// What is asked for again and again.
#[derive(Default)]
pub(crate) struct Memo {
    pbr: OnceLock<Vec<Medium>>,
    whitted: OnceLock<Vec<Medium>>,
    camera: Mutex<Option<(Camera, Shading, Media)>>,
}

/// A triangle that bounds a solid.
struct Wall {
    corners: [Vec3; 3],
    rank: usize,
}

impl Oracle<'_> {
    /// The scene's media, the lowest rank first: by priority, then the larger enclosed volume, then the earlier material.
    pub(crate) fn ranked_media(&self, shading: Shading) -> &[Medium] {
        let memo = match shading {
            Shading::Pbr => &self.solids.pbr,
            Shading::Whitted => &self.solids.whitted,
        };
        memo.get_or_init(|| {
            let of_materials = self.scene.materials.iter();
            let mut found: Vec<(Medium, f64)> = Vec::new();
            for medium in of_materials.filter_map(|material| material::medium(material, shading)) {
                if !found.iter().any(|(other, _)| *other == medium) {
                    let class = size_class(self.enclosed_volume(&medium, shading));
                    found.push((medium, class));
                }
            }
            found.sort_by(|(a, size_a), (b, size_b)| {
                let larger_first = size_b.total_cmp(size_a);
                a.priority.cmp(&b.priority).then(larger_first)
            });
            found.into_iter().map(|(medium, _)| medium).collect()
        })
    }

    /// Signed: negative for surfaces turned inside out (Gauss' theorem).
    fn enclosed_volume(&self, medium: &Medium, shading: Shading) -> f64 {
        let walls = self.walls(std::slice::from_ref(medium), shading);
        let sixth = |[a, b, c]: [Vec3; 3]| a.cross(b).dot(c) / 6.0;
        walls.iter().map(|wall| sixth(wall.corners)).sum()
    }

    /// All triangles that bound a solid of one of `media`.
    fn walls(&self, media: &[Medium], shading: Shading) -> Vec<Wall> {
        let geometry = &self.scene.geometry;
        let ranks: Vec<Option<usize>> = self
            .scene
            .materials
            .iter()
            .map(|m| material::medium(m, shading))
            .map(|found| media.iter().position(|other| Some(*other) == found))
            .collect();
        let walls = geometry.triangles.iter().filter_map(|triangle| {
            let corners = triangle
                .vertices
                .map(|vertex| geometry.positions[vertex as usize].to_array().into());
            ranks[triangle.material as usize].map(|rank| Wall { corners, rank })
        });
        walls.collect()
    }

    /// What rays of `camera` start in.
    pub(crate) fn camera_media(&self, camera: &Camera, shading: Shading) -> Media {
        let mut memo = self
            .solids
            .camera
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match &*memo {
            Some((known, of, media)) if known == camera && *of == shading => media.clone(),
            _ => {
                let media = self.media_around(camera, shading);
                *memo = Some((camera.clone(), shading, media.clone()));
                media
            }
        }
    }

    fn media_around(&self, camera: &Camera, shading: Shading) -> Media {
        let ranked = self.ranked_media(shading);
        let walls = self.walls(ranked, shading);
        let position = Vec3::from(camera.position.to_array());
        let mut turns = vec![0.0; ranked.len()];
        for wall in &walls {
            turns[wall.rank] += solid_angle(wall.corners.map(|p| p - position)) / (4.0 * PI);
        }
        // More than half around the camera is around the camera.
        let mut around: Vec<usize> = Vec::new();
        for (rank, turns) in turns.iter().enumerate() {
            let mut left = *turns;
            while left > 0.5 && around.len() < 64 {
                around.push(rank);
                left -= 1.0;
            }
        }
        if around.is_empty() {
            return Media::default();
        }
        let axis = Ray::new(position, Vec3::from(camera.forward.to_array()));
        let outermost_first = sorted_by_exit(&axis, &walls, around);
        outermost_first
            .into_iter()
            .fold(Media::default(), |media, rank| {
                media.entered(ranked[rank]).unwrap_or(media)
            })
    }
}

fn size_class(volume: f64) -> f64 {
    (1024.0 * volume.abs().max(1e-300).log2()).round()
}

/// Of a triangle seen from the origin, positive from behind (Van Oosterom and Strackee 1983).
fn solid_angle(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let [la, lb, lc] = corners.map(Vec3::length);
    let numerator = a.cross(b).dot(c);
    if numerator == 0.0 {
        return 0.0;
    }
    let denominator = la * lb * lc + la * b.dot(c) + lb * c.dot(a) + lc * a.dot(b);
    2.0 * numerator.atan2(denominator)
}

/// The solids `around` the start of `axis`, that which it leaves last first; those that it never leaves before all others.
fn sorted_by_exit(axis: &Ray, walls: &[Wall], mut around: Vec<usize>) -> Vec<usize> {
    let probe = Probe::new(axis);
    let mut met: Vec<(f64, usize, bool)> = Vec::new();
    for wall in walls {
        if let Some(hit) = probe.intersect(&wall.corners, 0) {
            met.push((hit.t, wall.rank, hit.back));
        }
    }
    // In one place: the higher rank is the inner solid.
    met.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)).then(a.2.cmp(&b.2)));
    // Two triangles that meet in an edge are met as one.
    met.dedup();
    let mut innermost_first = Vec::new();
    let mut depth = std::collections::BTreeMap::<usize, u32>::new();
    for (_, rank, back) in met {
        let inside = depth.entry(rank).or_default();
        if !back {
            *inside += 1;
        } else if *inside > 0 {
            *inside -= 1;
        } else if let Some(place) = around.iter().position(|&other| other == rank) {
            innermost_first.push(around.remove(place));
        }
    }
    around.extend(innermost_first.into_iter().rev());
    around
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_an_eighth() {
        let [x, y, z] = [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, 2.0, 0.0),
            Vec3::new(0.0, 0.0, 0.5),
        ];
        assert!((solid_angle([x, y, z]) - 0.5 * PI).abs() < 1e-15);
        assert!((solid_angle([y, x, z]) + 0.5 * PI).abs() < 1e-15);
    }

    #[test]
    fn what_is_left_first_is_innermost() {
        let wall = |z: f64, rank, out: bool| {
            let [a, b, c] = [
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(2.0, -1.0, z),
                Vec3::new(-1.0, 2.0, z),
            ];
            let corners = if out { [a, b, c] } else { [a, c, b] };
            Wall { corners, rank }
        };
        let up = Ray::new(Vec3::ZERO, Vec3::new(0.0, 0.0, 1.0));
        // Solid 0 begins and ends on the way, then comes the end of 1, of another 0, of 2.
        let walls = [
            wall(4.0, 1, true),
            wall(2.0, 0, false),
            wall(3.0, 0, true),
            wall(6.0, 2, true),
            wall(5.0, 0, true),
        ];
        assert_eq!(sorted_by_exit(&up, &walls, vec![0, 1, 2]), [2, 0, 1]);
        assert_eq!(sorted_by_exit(&up, &walls, vec![0, 1, 2, 3]), [3, 2, 0, 1]);
    }
}
