//! A tree of axis-parallel boxes over the triangles, split by the surface area heuristic (pbrt 7.3), every split swept.

use raytree_scene::model::Geometry;

use crate::intersect::{Hit, Probe, Ray};
use crate::vec::Vec3;

/// Leaves hold at most this many triangles, unless the whole tree is one leaf.
const LEAF_SIZE: usize = 4;
/// Deeper than this, halves are taken instead of the best split, so that no scene can exhaust the call stack.
const MAX_SAH_DEPTH: usize = 48;

/// Triangles with the boxes that spare a ray most of them.
pub(crate) struct Tree {
    corners: Vec<[Vec3; 3]>,
    /// Triangle indices, leaf after leaf.
    order: Vec<usize>,
    root: Node,
}

struct Node {
    bounds: Bounds,
    kind: Kind,
}

enum Kind {
    /// A range of [`Tree::order`].
    Leaf(std::ops::Range<usize>),
    Inner(Box<[Node; 2]>),
}

impl Tree {
    /// One leaf with every triangle: brute force.
    pub fn single_leaf(geometry: &Geometry) -> Self {
        let corners = corners(geometry);
        let order: Vec<usize> = (0..corners.len()).collect();
        let root = Node {
            bounds: Bounds::EVERYWHERE,
            kind: Kind::Leaf(0..order.len()),
        };
        Self {
            corners,
            order,
            root,
        }
    }

    pub fn build(geometry: &Geometry) -> Self {
        let corners = corners(geometry);
        let bounds: Vec<Bounds> = corners.iter().map(Bounds::of_triangle).collect();
        let mut order: Vec<usize> = (0..corners.len()).collect();
        let root = build_node(&bounds, &mut order, 0, 0);
        Self {
            corners,
            order,
            root,
        }
    }

    /// Calls `visit` with hits at `t <= limit`, in no particular order. `visit` returns the limit from there on; a
    /// negative one ends the walk.
    pub fn walk(&self, ray: &Ray, limit: f64, visit: &mut dyn FnMut(Hit) -> f64) {
        let inverse = ray.direction.map(|d| 1.0 / d);
        let mut walk = Walk {
            tree: self,
            ray,
            inverse,
            probe: Probe::new(ray),
            limit,
            visit,
        };
        if walk.entry(&self.root).is_some() {
            walk.visit(&self.root);
        }
    }
}

/// One ray's way through the tree.
struct Walk<'w> {
    tree: &'w Tree,
    ray: &'w Ray,
    inverse: Vec3,
    probe: Probe<'w>,
    limit: f64,
    visit: &'w mut dyn FnMut(Hit) -> f64,
}

impl Walk<'_> {
    fn entry(&self, node: &Node) -> Option<f64> {
        node.bounds.entry(self.ray.origin, self.inverse, self.limit)
    }

    fn visit(&mut self, node: &Node) {
        match &node.kind {
            Kind::Leaf(range) => {
                for &triangle in &self.tree.order[range.clone()] {
                    match self.probe.intersect(&self.tree.corners[triangle], triangle) {
                        Some(hit) if hit.t <= self.limit => self.limit = (self.visit)(hit),
                        _ => {}
                    }
                }
            }
            Kind::Inner(children) => {
                let [first, second] = &**children;
                let (near, far) = match (self.entry(first), self.entry(second)) {
                    (Some(a), Some(b)) if b < a => (Some(second), Some(first)),
                    (a, b) => (a.map(|_| first), b.map(|_| second)),
                };
                if let Some(child) = near {
                    self.visit(child);
                }
                // The near child may have brought the limit down.
                if let Some(child) = far.filter(|child| self.entry(child).is_some()) {
                    self.visit(child);
                }
            }
        }
    }
}

fn corners(geometry: &Geometry) -> Vec<[Vec3; 3]> {
    let position = |vertex: u32| geometry.positions[vertex as usize].to_array().into();
    geometry
        .triangles
        .iter()
        .map(|triangle| triangle.vertices.map(position))
        .collect()
}

/// The subtree of the triangles in `order`, whose first is number `start` of the whole order.
fn build_node(bounds: &[Bounds], order: &mut [usize], start: usize, depth: usize) -> Node {
    let all = order
        .iter()
        .fold(Bounds::NOTHING, |all, &i| all.union(bounds[i]));
    if order.len() <= LEAF_SIZE {
        return Node {
            bounds: all,
            kind: Kind::Leaf(start..start + order.len()),
        };
    }
    let middle = if depth < MAX_SAH_DEPTH {
        best_split(bounds, order)
    } else {
        order.len() / 2
    };
    let (left, right) = order.split_at_mut(middle);
    let children = [
        build_node(bounds, left, start, depth + 1),
        build_node(bounds, right, start + middle, depth + 1),
    ];
    Node {
        bounds: all,
        kind: Kind::Inner(Box::new(children)),
    }
}

/// Sorts `order` along the axis, and returns the place in it, of the split with the lowest sum of area times count.
fn best_split(bounds: &[Bounds], order: &mut [usize]) -> usize {
    const AXES: [fn(Vec3) -> f64; 3] = [|p| p.x, |p| p.y, |p| p.z];
    let sort = |order: &mut [usize], axis: fn(Vec3) -> f64| {
        // Ties by index: the tree is the same whatever order the axes were tried in.
        order.sort_unstable_by(|&i, &j| {
            axis(bounds[i].middle())
                .total_cmp(&axis(bounds[j].middle()))
                .then(i.cmp(&j))
        });
    };
    let mut best = (f64::INFINITY, AXES[0], order.len() / 2);
    let mut right_costs = vec![0.0; order.len()];
    for axis in AXES {
        sort(order, axis);
        let mut right = Bounds::NOTHING;
        for (k, &i) in order.iter().enumerate().rev() {
            right = right.union(bounds[i]);
            right_costs[k] = right.half_area() * (order.len() - k) as f64;
        }
        let mut left = Bounds::NOTHING;
        for (k, &i) in order.iter().enumerate().take(order.len() - 1) {
            left = left.union(bounds[i]);
            let cost = left.half_area() * (k + 1) as f64 + right_costs[k + 1];
            if cost < best.0 {
                best = (cost, axis, k + 1);
            }
        }
    }
    let (_, axis, middle) = best;
    sort(order, axis);
    middle
}

/// A box with sides parallel to the axes.
#[derive(Clone, Copy)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    const NOTHING: Self = Self {
        min: Vec3::splat(f64::INFINITY),
        max: Vec3::splat(f64::NEG_INFINITY),
    };
    const EVERYWHERE: Self = Self {
        min: Vec3::splat(f64::NEG_INFINITY),
        max: Vec3::splat(f64::INFINITY),
    };

    /// A little larger than the triangle, by far more than any rounding in either test: a box must never hide a hit
    /// that brute force finds.
    fn of_triangle(corners: &[Vec3; 3]) -> Self {
        const PADDING: f64 = 1e-10;
        let exact = corners.iter().fold(Self::NOTHING, |all, &p| Self {
            min: all.min.min(p),
            max: all.max.max(p),
        });
        let padding = Vec3::splat(
            PADDING
                * exact
                    .min
                    .map(f64::abs)
                    .max(exact.max.map(f64::abs))
                    .largest(),
        );
        Self {
            min: exact.min - padding,
            max: exact.max + padding,
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    fn middle(self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    fn half_area(self) -> f64 {
        let size = self.max - self.min;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Where the ray enters, at most `limit`; `None` if it misses. Slab test with the far side widened (Ize 2013). A
    /// ray that runs in the very plane of a side gives 0 * infinity and counts as a miss: the padding keeps triangles
    /// off that plane.
    fn entry(&self, origin: Vec3, inverse: Vec3, limit: f64) -> Option<f64> {
        const WIDENING: f64 = 1.0 + 8.0 * f64::EPSILON;
        let a = (self.min - origin) * inverse;
        let b = (self.max - origin) * inverse;
        let (near, far) = (a.min(b), a.max(b));
        let enter = near.x.max(near.y).max(near.z).max(0.0);
        let leave = far.x.min(far.y).min(far.z) * WIDENING;
        (enter <= leave && enter <= limit).then_some(enter)
    }
}
