//! From the media on one side of a surface to those on the other: "Media" and "Contact" in `shaders/README.md`.

use std::collections::BTreeSet;

use raytree_scene::model::AlphaMode;

use crate::intersect::{Hit, Ray};
use crate::media::{Full, Media};
use crate::render::Shading;
use crate::surface::SPAWN_OFFSET;
use crate::vec::Vec3;
use crate::{Oracle, material};

/// Of the largest coordinate of a triangle: how far apart planes lie that are one but for the rounding of their corners.
const HEIGHT_SHARE: f64 = 1.0 / (1 << 21) as f64;

/// Parallel but for rounding.
const COSINE: f64 = 0.999;

/// A ray's way through all faces that lie in the place of a hit.
pub(crate) struct Crossing {
    /// The face that is shaded.
    pub face: Hit,
    /// The media of a ray that has gone through.
    pub beyond: Result<Media, Full>,
    /// The same medium counts on both sides.
    pub hidden: bool,
    /// How far apart the faces may lie; 0 for a single one.
    pub height: f64,
}

impl Oracle<'_> {
    /// What `ray`, in `media`, crosses at `first`, together with the faces there that `counts` accepts.
    pub(crate) fn crossing(
        &self,
        ray: &Ray,
        first: &Hit,
        media: &Media,
        shading: Shading,
        counts: impl Fn(&Hit) -> bool,
    ) -> Crossing {
        let none = |face: Hit, height| Crossing {
            face,
            beyond: Ok(media.clone()),
            hidden: false,
            height,
        };
        if material::medium(self.material(first), shading).is_none() {
            return none(*first, 0.0);
        }
        let (faces, height) = self.in_one_place(ray, first, counts);
        let height = if self.is_one_surface(&faces) {
            0.0
        } else {
            1.5 * height
        };
        if let Some(opaque) = faces.iter().find(|hit| self.is_opaque(hit, shading)) {
            return none(*opaque, height);
        }

        let ranked = self.ranked_media(shading);
        let rank = |hit: &Hit| {
            let medium = material::medium(self.material(hit), shading)?;
            ranked.iter().position(|other| *other == medium)
        };
        let (mut left, mut entered) = (BTreeSet::new(), BTreeSet::new());
        let mut shaded: Option<(usize, Hit)> = None;
        for hit in &faces {
            let Some(rank) = rank(hit) else { continue };
            let sides = if hit.back { &mut left } else { &mut entered };
            sides.insert(rank);
            if shaded.is_none_or(|(highest, _)| rank > highest) {
                shaded = Some((rank, *hit));
            }
        }
        let outside = left
            .iter()
            .fold(media.clone(), |media, &rank| media.left(ranked[rank]));
        let crossed = outside != *media || !entered.is_empty();
        let beyond = entered
            .iter()
            .try_fold(outside, |media, &rank| media.entered(ranked[rank]));
        let alike = |beyond: &Media| beyond.top() == media.top();
        let hidden = crossed && beyond.as_ref().is_ok_and(alike);
        Crossing {
            face: shaded.map_or(*first, |(_, hit)| hit),
            beyond,
            hidden,
            height,
        }
    }

    /// The faces that lie where `first` is, by their order along the ray; and how far apart they may be.
    fn in_one_place(
        &self,
        ray: &Ray,
        first: &Hit,
        counts: impl Fn(&Hit) -> bool,
    ) -> (Vec<Hit>, f64) {
        let Some(normal) = self.plane_normal(first) else {
            return (vec![*first], 0.0);
        };
        let height = HEIGHT_SHARE * self.largest_coordinate(first);
        let speed = normal.dot(ray.direction).abs();
        let reach = first.t + height / speed.max(1e-12);
        let mut faces = vec![*first];
        self.tree.walk(ray, reach, &mut |hit| {
            let parallel = self
                .plane_normal(&hit)
                .is_some_and(|other| other.dot(normal).abs() >= COSINE);
            let other = hit.triangle != first.triangle && ray.leaving != Some(hit.triangle);
            if parallel && other && hit.t >= first.t && hit.t <= reach && counts(&hit) {
                faces.push(hit);
            }
            reach
        });
        faces[1..].sort_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
        (faces, height)
    }

    /// Whether `faces` are triangles that share an edge or a corner there: rays then start as they do beside it.
    fn is_one_surface(&self, faces: &[Hit]) -> bool {
        let first = &faces[0];
        let material = |hit: &Hit| self.triangle(hit).material;
        let rounding = SPAWN_OFFSET * self.largest_coordinate(first);
        faces.iter().all(|face| {
            let joined = face.t - first.t <= rounding;
            joined && material(face) == material(first) && face.back == first.back
        })
    }

    fn is_opaque(&self, hit: &Hit, shading: Shading) -> bool {
        let material = self.material(hit);
        material.alpha_mode == AlphaMode::Opaque && !material::transmits(material, shading)
    }

    fn corners_of(&self, hit: &Hit) -> [Vec3; 3] {
        let positions = &self.scene.geometry.positions;
        self.triangle(hit)
            .vertices
            .map(|vertex| positions[vertex as usize].to_array().into())
    }

    fn plane_normal(&self, hit: &Hit) -> Option<Vec3> {
        let [a, b, c] = self.corners_of(hit);
        let across = (b - a).cross(c - a);
        (across.length() > 0.0).then(|| across.normalized())
    }

    fn largest_coordinate(&self, hit: &Hit) -> f64 {
        let sizes = self.corners_of(hit).map(|corner| corner.map(f64::abs));
        let [a, b, c] = sizes.map(Vec3::largest);
        a.max(b).max(c)
    }
}
