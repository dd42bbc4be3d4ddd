//! Do faces of solids lie in one place with other faces? Rays have to cross such faces as one (`shaders/README.md`, "Contact"),
//! which costs time, so that only scenes that have them pay for it.

use glam::DVec3;

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
    let kinds: Vec<Kind> = scene.materials.iter().map(Kind::of).collect();
    if !kinds.contains(&Kind::Solid) {
        return false;
    }
    let (mut solids, others): (Vec<Face>, Vec<Face>) = (0..scene.own_triangles())
        .filter_map(|triangle| Face::of(&scene.own_triangle(triangle), &kinds))
        .partition(|face| face.kind == Kind::Solid);
    let tree = Tree::build(&mut solids);
    let touches = |face: &Face| tree.any(&solids, face);
    let shared = || {
        let mut near = scene.instances.iter().filter(|i| tree.is_near(i.bounds));
        near.any(|instance| {
            let triangles = scene.triangles_placed_by(instance);
            let faces: Vec<Face> = triangles.filter_map(|t| Face::of(&t, &kinds)).collect();
            parallel::any(&faces, touches)
        })
    };
    parallel::any(&others, touches) || parallel::any(&solids, touches) || shared()
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
    kind: Kind,
    min: DVec3,
    max: DVec3,
    /// How far off its plane others still lie in it.
    height: f64,
}

impl Face {
    fn of(triangle: &PlacedTriangle, kinds: &[Kind]) -> Option<Self> {
        let kind = kinds[triangle.material as usize];
        let corners = triangle.corners;
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        let normal = across.try_normalize()?;
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let height = HEIGHT_SHARE * min.abs().max(max.abs()).max_element();
        (kind != Kind::Other).then_some(Self {
            corners,
            normal,
            area: 0.5 * across.length(),
            material: triangle.material,
            kind,
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

impl Node {
    const EMPTY: Self = Self {
        bounds: (DVec3::INFINITY, DVec3::NEG_INFINITY),
        normals: (DVec3::INFINITY, DVec3::NEG_INFINITY),
        material: None,
    };

    fn around(faces: &[Face]) -> Self {
        let first = faces.first().map(|face| face.material);
        let node = Self {
            material: first.filter(|&first| faces.iter().all(|face| face.material == first)),
            ..Self::EMPTY
        };
        faces.iter().fold(node, |node, face| Self {
            bounds: (node.bounds.0.min(face.min), node.bounds.1.max(face.max)),
            normals: (
                node.normals.0.min(face.normal),
                node.normals.1.max(face.normal),
            ),
            ..node
        })
    }

    /// May any of them touch a face? If their boxes don't, or none is parallel to it, or all are the same surface, none does: as
    /// [`Face::touches`] has it, for all at once.
    fn may_touch(&self, face: &Face) -> bool {
        let (min, max) = self.bounds;
        if face.max.cmplt(min).any() || face.min.cmpgt(max).any() {
            return false;
        }
        let (low, high) = (self.normals.0 * face.normal, self.normals.1 * face.normal);
        let least = low.min(high).element_sum();
        let most = low.max(high).element_sum();
        let same_surface = self.material == Some(face.material) && least > 0.0;
        !same_surface && (most >= COSINE || least <= -COSINE)
    }
}

impl Tree {
    fn build(faces: &mut [Face]) -> Self {
        let levels = faces.len().div_ceil(LEAF_SIZE).next_power_of_two().ilog2() + 1;
        let mut tree = Self {
            nodes: vec![Node::EMPTY; (1 << levels) - 1],
        };
        tree.fill(0, faces);
        tree
    }

    fn fill(&mut self, node: usize, faces: &mut [Face]) {
        if node >= self.nodes.len() || faces.is_empty() {
            return;
        }
        self.nodes[node] = Node::around(faces);
        let bounds = self.nodes[node].bounds;
        let axis = (bounds.1 - bounds.0).max_position();
        let middle = faces.len() / 2;
        faces.select_nth_unstable_by(middle, |a, b| {
            (a.min[axis] + a.max[axis]).total_cmp(&(b.min[axis] + b.max[axis]))
        });
        let (left, right) = faces.split_at_mut(middle);
        self.fill(2 * node + 1, left);
        self.fill(2 * node + 2, right);
    }

    /// May anything in this box touch a face? Faces reach beyond their corners by no more than rounding.
    fn is_near(&self, (min, max): (DVec3, DVec3)) -> bool {
        let slack = HEIGHT_SHARE * min.abs().max(max.abs());
        let (low, high) = self.nodes[0].bounds;
        !((min - slack).cmpgt(high).any() || (max + slack).cmplt(low).any())
    }

    /// Does any of the faces that the tree was built of touch `face`?
    fn any(&self, faces: &[Face], face: &Face) -> bool {
        self.any_below(0, faces, face)
    }

    fn any_below(&self, node: usize, faces: &[Face], face: &Face) -> bool {
        let Some(below) = self.nodes.get(node) else {
            return faces.iter().any(|other| face.touches(other));
        };
        if !below.may_touch(face) {
            return false;
        }
        let (left, right) = faces.split_at(faces.len() / 2);
        self.any_below(2 * node + 1, left, face) || self.any_below(2 * node + 2, right, face)
    }
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
}
