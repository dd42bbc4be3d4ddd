//! Do faces of solids lie in one place with other faces? Rays have to cross such faces as one (`shaders/README.md`, "Contact"),
//! which costs time, so that only scenes that have them pay for it.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::{
    features::may_bound_solid,
    instances::PlacedTriangle,
    model::{AlphaMode, Material, Scene},
    parallel,
};

/// Of the largest coordinate of a triangle: how far apart two planes may lie that are one but for the rounding of their corners.
/// A little more than the renderer allows, which must not meet what is not expected.
const HEIGHT_SHARE: f64 = 1.0 / (1 << 20) as f64;

/// Parallel but for rounding, as the renderer has it.
const COSINE: f64 = 0.998;

/// Of the smaller triangle's area: neighbours in a plane overlap by their rounding only.
const OVERLAP_SHARE: f64 = 1e-4;

/// The leaves of the tree hold at most this many faces.
const LEAF_SIZE: usize = 8;

/// Does a face of a solid coincide with a face of another solid, with one of the same medium that looks the other way, or with an
/// opaque face?
///
/// A pure function of the scene, O(n log n) in the triangles that lie in the solids' bounding box.
pub(crate) fn exists(scene: &Scene) -> bool {
    let kinds: &[Kind] = &scene.materials.iter().map(Kind::of).collect::<Vec<_>>();
    if !kinds.contains(&Kind::Solid) {
        return false;
    }
    let own = |kind: Kind| {
        let triangles = scene
            .geometry
            .triangles
            .iter()
            .zip(0..scene.own_triangles());
        let wanted =
            triangles.filter(move |(triangle, _)| kinds[triangle.material as usize] == kind);
        wanted.filter_map(move |(_, index)| Face::of(&scene.own_triangle(index), kinds))
    };
    let tree = Tree::build(own(Kind::Solid).collect());
    let others: Vec<Face> = own(Kind::Opaque)
        .filter(|face| tree.nodes[0].may_touch(&Node::of(face)))
        .collect();
    let touches = |face: &Face| tree.any(face);
    let shared = || {
        let mut near = scene.instances.iter().filter(|i| tree.is_near(i.bounds));
        near.any(|instance| {
            let triangles = scene.triangles_placed_by(instance);
            let faces: Vec<Face> = triangles.filter_map(|t| Face::of(&t, kinds)).collect();
            parallel::any(&faces, touches)
        })
    };
    parallel::any(&others, touches) || tree.any_pair() || shared()
}

/// What a material's faces are to a ray in a solid.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Solid,
    Opaque,
    /// Seen through and not the boundary of anything.
    Other,
}

impl Kind {
    fn of(material: &Material) -> Self {
        if may_bound_solid(material) {
            Self::Solid
        } else if material.alpha_mode == AlphaMode::Opaque && material.transmission == 0.0 {
            Self::Opaque
        } else {
            Self::Other
        }
    }
}

/// A triangle that a ray can meet.
struct Face {
    corners: [DVec3; 3],
    /// Unit.
    normal: DVec3,
    area: f64,
    material: u32,
    min: DVec3,
    max: DVec3,
    /// How far off its plane others still lie in it.
    height: f64,
}

impl Face {
    fn of(triangle: &PlacedTriangle, kinds: &[Kind]) -> Option<Self> {
        if kinds[triangle.material as usize] == Kind::Other {
            return None;
        }
        let corners = triangle.corners;
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        let normal = across.try_normalize()?;
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let height = HEIGHT_SHARE * min.abs().max(max.abs()).max_element();
        Some(Self {
            corners,
            normal,
            area: 0.5 * across.length(),
            material: triangle.material,
            min: min - height,
            max: max + height,
            height,
        })
    }

    /// Do they lie in one place, and does a ray have to know?
    fn touches(&self, other: &Self) -> bool {
        let cosine = self.normal.dot(other.normal);
        // The surface of one solid goes on in its neighbours.
        let same_surface = self.material == other.material && cosine > 0.0;
        if same_surface || cosine.abs() < COSINE {
            return false;
        }
        let height = self.height.max(other.height);
        let above = |p: DVec3| other.normal.dot(p - other.corners[0]);
        let [a, b, c] = self.corners.map(above);
        // What overlaps lies between the corners.
        if a.min(b).min(c) > height || a.max(b).max(c) < -height {
            return false;
        }
        let overlap = Polygon::of(self).clipped_to(other);
        overlap.area(self.normal) > OVERLAP_SHARE * self.area.min(other.area)
            && overlap.0.iter().any(|p| above(*p).abs() <= height)
    }
}

/// A convex polygon in space.
struct Polygon(Vec<DVec3>);

impl Polygon {
    fn of(face: &Face) -> Self {
        Self(face.corners.to_vec())
    }

    /// What lies above or below `face` (Sutherland and Hodgman 1974).
    fn clipped_to(self, face: &Face) -> Self {
        let edges = (0..3).map(|k| (face.corners[k], face.corners[(k + 1) % 3]));
        edges.fold(self, |polygon, (from, to)| {
            let inwards = face.normal.cross(to - from);
            polygon.clipped(|p| inwards.dot(p - from))
        })
    }

    /// What lies where `depth` is not negative.
    fn clipped(self, depth: impl Fn(DVec3) -> f64) -> Self {
        let mut kept = Vec::with_capacity(self.0.len() + 1);
        for (k, &p) in self.0.iter().enumerate() {
            let q = self.0[(k + 1) % self.0.len()];
            let (at_p, at_q) = (depth(p), depth(q));
            if at_p >= 0.0 {
                kept.push(p);
            }
            if (at_p < 0.0) != (at_q < 0.0) {
                kept.push(p + (q - p) * (at_p / (at_p - at_q)));
            }
        }
        Self(kept)
    }

    /// As seen along the unit vector `normal`.
    fn area(&self, normal: DVec3) -> f64 {
        let Some(&first) = self.0.first() else {
            return 0.0;
        };
        let fan = self.0.windows(2);
        let sum: DVec3 = fan.map(|pq| (pq[0] - first).cross(pq[1] - first)).sum();
        0.5 * sum.dot(normal).abs()
    }
}

/// Boxes around faces, halved by their middles: node `k` has the children `2k + 1` and `2k + 2`, each half of its range.
struct Tree {
    faces: Vec<Face>,
    /// Indices of `faces`, leaf after leaf.
    order: Vec<u32>,
    /// Nodes that don't exist have boxes of nothing.
    nodes: Vec<Node>,
}

/// What is common to the faces below a node.
#[derive(Clone, Copy)]
struct Node {
    /// (min, max) of their boxes.
    bounds: (DVec3, DVec3),
    /// (min, max) of their normals' components.
    normals: (DVec3, DVec3),
    /// The material that all of them have.
    material: Option<u32>,
}

/// Faces to be looked at against each other: two nodes, each with its range of faces.
type Pair = [(usize, Range<usize>); 2];

/// How many pairs of nodes are worth handing out to threads.
const PAIRS: usize = 256;

impl Node {
    const EMPTY: Self = Self {
        bounds: (DVec3::INFINITY, DVec3::NEG_INFINITY),
        normals: (DVec3::INFINITY, DVec3::NEG_INFINITY),
        material: None,
    };

    fn of(face: &Face) -> Self {
        Self {
            bounds: (face.min, face.max),
            normals: (face.normal, face.normal),
            material: Some(face.material),
        }
    }

    /// What is common to the faces of both, neither of which is empty.
    fn with(self, other: Self) -> Self {
        let around = |(low, high): (DVec3, DVec3), (other_low, other_high)| {
            (low.min(other_low), high.max(other_high))
        };
        Self {
            bounds: around(self.bounds, other.bounds),
            normals: around(self.normals, other.normals),
            material: self.material.filter(|_| self.material == other.material),
        }
    }

    /// May any of their faces touch? If their boxes don't, or no two are parallel, or all are the same surface, none does: as
    /// [`Face::touches`] has it, for all at once.
    fn may_touch(&self, other: &Self) -> bool {
        let ((min, max), (other_min, other_max)) = (self.bounds, other.bounds);
        if other_max.cmplt(min).any() || other_min.cmpgt(max).any() {
            return false;
        }
        let (low, high) = self.normals;
        let (other_low, other_high) = other.normals;
        let products = [
            low * other_low,
            low * other_high,
            high * other_low,
            high * other_high,
        ];
        let of_all = |choose: fn(DVec3, DVec3) -> DVec3| {
            let [a, b, c, d] = products;
            choose(choose(a, b), choose(c, d)).element_sum()
        };
        let (least, most) = (of_all(DVec3::min), of_all(DVec3::max));
        let same_material = self.material.is_some() && self.material == other.material;
        let same_surface = same_material && least > 0.0;
        !same_surface && (most >= COSINE || least <= -COSINE)
    }
}

impl Tree {
    fn build(faces: Vec<Face>) -> Self {
        let levels = faces.len().div_ceil(LEAF_SIZE).next_power_of_two().ilog2() + 1;
        let middle = |face: &Face| (face.min + face.max).as_vec3().to_array();
        let mut places: Vec<(u32, [f32; 3])> = (0..).zip(faces.iter().map(middle)).collect();
        halve(&mut places, levels);
        let mut tree = Self {
            order: places.into_iter().map(|(face, _)| face).collect(),
            faces,
            nodes: vec![Node::EMPTY; (1 << levels) - 1],
        };
        tree.fill(0, 0..tree.faces.len());
        tree
    }

    fn fill(&mut self, node: usize, range: Range<usize>) -> Option<Node> {
        let found = if self.has(2 * node + 1) {
            let [left, right] = halves(node, range);
            match (self.fill(left.0, left.1), self.fill(right.0, right.1)) {
                (Some(left), Some(right)) => Some(left.with(right)),
                (left, right) => left.or(right),
            }
        } else {
            self.faces_in(range).map(Node::of).reduce(Node::with)
        };
        self.nodes[node] = found.unwrap_or(Node::EMPTY);
        found
    }

    fn faces_in(&self, range: Range<usize>) -> impl Iterator<Item = &Face> {
        self.order[range]
            .iter()
            .map(|&face| &self.faces[face as usize])
    }

    fn has(&self, node: usize) -> bool {
        node < self.nodes.len()
    }

    /// May anything in this box touch a face? Faces reach beyond their corners by no more than rounding.
    fn is_near(&self, (min, max): (DVec3, DVec3)) -> bool {
        let slack = HEIGHT_SHARE * min.abs().max(max.abs());
        let (low, high) = self.nodes[0].bounds;
        !((min - slack).cmpgt(high).any() || (max + slack).cmplt(low).any())
    }

    /// Does any of the faces touch `face`, which is none of them?
    fn any(&self, face: &Face) -> bool {
        self.any_below((0, 0..self.faces.len()), &Node::of(face), face)
    }

    fn any_below(&self, (node, range): (usize, Range<usize>), like: &Node, face: &Face) -> bool {
        if !self.nodes[node].may_touch(like) {
            return false;
        }
        if !self.has(2 * node + 1) {
            return self.faces_in(range).any(|other| face.touches(other));
        }
        halves(node, range)
            .into_iter()
            .any(|half| self.any_below(half, like, face))
    }

    /// Do any two of the faces touch?
    ///
    /// Of a smooth surface whole parts are found at once not to: none of one part is parallel to any of the other, or all look the same way.
    fn any_pair(&self) -> bool {
        let root = (0, 0..self.faces.len());
        let mut pairs: Vec<Pair> = vec![[root.clone(), root]];
        while (1..PAIRS).contains(&pairs.len()) && self.has(2 * pairs[0][0].0 + 1) {
            pairs = pairs.iter().flat_map(|pair| self.below(pair)).collect();
        }
        parallel::any_of_large(&pairs, |pair| self.any_between(pair))
    }

    fn any_between(&self, pair: &Pair) -> bool {
        let [(one, of_one), (other, of_other)] = pair;
        if self.has(2 * one + 1) {
            return self.below(pair).any(|pair| self.any_between(&pair));
        }
        let mut near = self
            .faces_in(of_one.clone())
            .filter(|face| self.nodes[*other].may_touch(&Node::of(face)));
        // At the border of what counts as one place it depends on whose normal it is seen along.
        let touch = |a: &Face, b: &Face| a.touches(b) || b.touches(a);
        near.any(|face| {
            self.faces_in(of_other.clone())
                .any(|other| touch(face, other))
        })
    }

    /// Those pairs of children whose faces may touch. Both nodes of a pair are on one level.
    fn below(&self, [one, other]: &Pair) -> impl Iterator<Item = Pair> {
        let [a, b] = halves(one.0, one.1.clone());
        let [c, d] = halves(other.0, other.1.clone());
        // Of a node and itself, each two of its children once.
        let crossed = (one.0 != other.0).then(|| [b.clone(), c.clone()]);
        let pairs = [[a.clone(), c], [a, d.clone()], [b, d]];
        let may_touch = |[one, other]: &Pair| self.nodes[one.0].may_touch(&self.nodes[other.0]);
        pairs.into_iter().chain(crossed).filter(may_touch)
    }
}

/// A node's children with their ranges.
fn halves(node: usize, range: Range<usize>) -> Pair {
    let middle = range.start + range.len() / 2;
    [
        (2 * node + 1, range.start..middle),
        (2 * node + 2, middle..range.end),
    ]
}

/// Halves places, with what they are the places of, along their longest extent, and so on for as many levels.
fn halve(places: &mut [(u32, [f32; 3])], levels: u32) {
    if levels <= 1 || places.is_empty() {
        return;
    }
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (min, max) = places.iter().fold(start, |(min, max), &(_, place)| {
        (min.min(place.into()), max.max(place.into()))
    });
    let axis = (max - min).max_position();
    let middle = places.len() / 2;
    places.select_nth_unstable_by(middle, |a, b| a.1[axis].total_cmp(&b.1[axis]));
    let (left, right) = places.split_at_mut(middle);
    halve(left, levels - 1);
    halve(right, levels - 1);
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::model::{Triangle, Volume};

    const GLASS: u32 = 0;
    const WATER: u32 = 1;
    const STONE: u32 = 2;
    const PANE: u32 = 3;

    fn materials() -> Vec<Material> {
        let clear = Volume {
            attenuation_color: Vec3::ONE,
            attenuation_distance: f64::INFINITY,
        };
        let pane = Material {
            metallic: 0.0,
            transmission: 1.0,
            ..Material::default()
        };
        let solid = Material {
            volume: Some(clear),
            ..pane.clone()
        };
        vec![solid.clone(), solid, Material::default(), pane]
    }

    /// Triangles in the plane z = height, each with the side that it is seen from.
    fn scene(triangles: &[(u32, [[f32; 2]; 3], f32, bool)]) -> Scene {
        let mut scene = Scene {
            materials: materials(),
            ..Scene::default()
        };
        for &(material, corners, z, flipped) in triangles {
            let first = scene.geometry.positions.len() as u32;
            scene
                .geometry
                .positions
                .extend(corners.map(|[x, y]| Vec3::new(x, y, z)));
            let [a, b, c] = [first, first + 1, first + 2];
            scene.geometry.triangles.push(Triangle {
                vertices: if flipped { [a, c, b] } else { [a, b, c] },
                material,
                node: 0,
            });
        }
        scene
    }

    const LOW: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    const HIGH: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// Of another triangulation of the same square.
    const ACROSS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn faces_of_different_solids_touch_where_they_overlap() {
        for flipped in [false, true] {
            for (first, second) in [(LOW, LOW), (LOW, ACROSS), (ACROSS, HIGH)] {
                let pair = |material| {
                    exists(&scene(&[
                        (GLASS, first, 0.5, false),
                        (material, second, 0.5, flipped),
                    ]))
                };
                assert!(pair(WATER) && pair(STONE));
                assert_eq!(pair(GLASS), flipped, "two blocks of glass face each other");
                assert!(!pair(PANE));
            }
            let neighbours = scene(&[(GLASS, LOW, 0.5, false), (WATER, HIGH, 0.5, flipped)]);
            assert!(!exists(&neighbours));
        }
    }

    #[test]
    fn opaque_faces_alone_do_not_count() {
        assert!(!exists(&scene(&[
            (STONE, LOW, 0.5, false),
            (STONE, LOW, 0.5, true)
        ])));
        assert!(!exists(&Scene::default()));
    }

    #[test]
    fn rounding_is_no_gap_and_a_gap_is_no_rounding() {
        let apart = |gap: f32| {
            exists(&scene(&[
                (GLASS, LOW, 0.5, true),
                (WATER, ACROSS, 0.5 + gap, false),
            ]))
        };
        assert!(apart(6e-8) && apart(-6e-8));
        assert!(!apart(2e-6) && !apart(-2e-6));
    }

    #[test]
    fn one_pair_among_many_is_found() {
        let mut triangles = Vec::new();
        for k in 0..500_u16 {
            let x = 2.0 * f32::from(k);
            let shifted = LOW.map(|[u, v]| [x + u, v]);
            triangles.push((GLASS, shifted, 0.25 * f32::from(k % 7), false));
        }
        assert!(!exists(&scene(&triangles)));
        let last = triangles[333];
        triangles.push((WATER, last.1, last.2, true));
        assert!(exists(&scene(&triangles)));
    }

    /// Triangles anywhere, some in a common plane, some with one that nearly lies on them.
    fn soup(random: &mut impl FnMut() -> f64, count: usize, flat: bool) -> Vec<Face> {
        let kinds = [Kind::Solid, Kind::Solid];
        let mut faces: Vec<Face> = Vec::new();
        let add = |faces: &mut Vec<Face>, corners, material| {
            faces.extend(Face::of(&PlacedTriangle { corners, material }, &kinds));
        };
        for _ in 0..count {
            let mut point = |size: f64| {
                let [x, y, z] = [random(), random(), random()].map(|share| size * share);
                DVec3::new(x, y, if flat { (4.0 * z).round() / 4.0 } else { z })
            };
            let at = point(3.0);
            let mut corners = [at, at + point(0.3), at + point(0.3)];
            if flat {
                corners = corners.map(|corner| corner.with_z(at.z));
            }
            let material = u32::from(random() < 0.5);
            add(&mut faces, corners, material);
        }
        if random() < 0.5
            && let Some(face) = faces.last()
        {
            let ([a, b, c], off) = (face.corners, 2.2 * random() * face.height * face.normal);
            add(
                &mut faces,
                [a + off, c + off, b + off],
                u32::from(random() < 0.5),
            );
        }
        faces
    }

    #[test]
    fn whole_parts_are_left_out_only_where_nothing_touches() {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            state = state
                .wrapping_mul(0x5851_f42d_4c95_7f2d)
                .wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        let mut found = [0; 2];
        for round in 0..400 {
            let count = [1, 2, 7, 8, 9, 17, 40, 130][round % 8];
            let faces = soup(&mut random, count, round % 3 == 0);
            let touches = faces.iter().any(|a| faces.iter().any(|b| a.touches(b)));
            assert_eq!(Tree::build(faces).any_pair(), touches, "round {round}");
            found[usize::from(touches)] += 1;
        }
        assert!(found.iter().all(|&count| count > 50), "{found:?}");
    }
}
