//! A binary tree to a wide one of the same leaves, by the least expected cost (Ylitie, Karras, Laine 2017, section 3): what obvhs'
//! `bvh2_to_cwbvh` makes of it, to the bit, but on all cores, and with 8 bytes a binary node beside the trees instead of 56. (It
//! was half of the time and memory of a build.)

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use glam::{Vec3A, vec3a};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
    cwbvh::node::CwBvhNode,
};
use rayon::prelude::*;

/// Children of a wide node.
const WIDTH: usize = 8;

/// Ways to share the places of a wide node among what is below a binary one: among up to 1 to 7.
const WAYS: usize = WIDTH - 1;

/// A leaf holds so many triangles at most.
const LEAF_TRIANGLES: u32 = 3;

/// Of testing a triangle, where visiting a node costs 1.
const TRIANGLE_COST: f32 = 0.3;

/// Down to this level of the binary tree both halves are decided on at once: enough for many cores, few against all nodes.
const FORKED_LEVELS: u32 = 14;

/// .. and of the wide tree.
const FORKED_WIDE_LEVELS: u32 = 4;

/// A wide tree.
#[derive(Default)]
pub(crate) struct Wide {
    /// The root first; children lie behind their parent, side by side.
    pub(crate) nodes: Vec<CwBvhNode>,
    /// What leaves name.
    pub(crate) primitives: Vec<u32>,
    /// Levels; the root is 1.
    pub(crate) depth: u32,
}

/// Collapses a tree that has a primitive a leaf; `None` if it has more than `most_levels`.
pub(crate) fn collapse(binary: &Bvh2, most_levels: u32) -> Option<Wide> {
    let mut decisions = Vec::new();
    decisions.resize_with(binary.nodes.len(), AtomicU64::default);
    let collapse = Collapse {
        binary,
        decisions,
        most_levels,
    };
    collapse.decide(0, 1)?;
    Some(collapse.wide(0, 1))
}

/// What becomes of a binary node where up to so many places are left for what is below it.
#[derive(Clone, Copy, Default)]
struct Decision {
    /// Its children share the places; otherwise it takes one itself.
    shared: bool,
    /// Where it takes one: as a leaf.
    leaf: bool,
    /// The decisions of its children by which they share: where it takes a place, those of its own wide node.
    children: [u8; 2],
}

impl Decision {
    fn bits(self) -> u8 {
        let [left, right] = self.children;
        left | right << 3 | u8::from(self.shared) << 6 | u8::from(self.leaf) << 7
    }

    fn of_bits(bits: u8) -> Self {
        Self {
            shared: bits >> 6 & 1 != 0,
            leaf: bits >> 7 != 0,
            children: [bits & 7, bits >> 3 & 7],
        }
    }
}

/// What is below a binary node costs so much, by the places that it may take, less one.
struct Costs {
    ways: [f32; WAYS],
    primitives: u32,
}

impl Costs {
    /// The cheapest of the ways that two nodes can share `places`, and which decisions these are.
    fn shared(&self, other: &Self, places: usize) -> (f32, [u8; 2]) {
        let pair = |k: usize| (k, self.ways[k] + other.ways[places - 2 - k]);
        let (first, cost) =
            (1..places - 1).map(pair).fold(
                pair(0),
                |best, pair| {
                    if pair.1 < best.1 { pair } else { best }
                },
            );
        (cost, [first as u8, (places - 2 - first) as u8])
    }
}

struct Collapse<'a> {
    binary: &'a Bvh2,
    /// Of each inner node, a byte for each of [`WAYS`]; zero of leaves, which share nothing.
    decisions: Vec<AtomicU64>,
    most_levels: u32,
}

impl Collapse<'_> {
    fn node(&self, index: u32) -> &Bvh2Node {
        &self.binary.nodes[index as usize]
    }

    /// Decides on everything from `index` down, which is on `level`; `None` if that is too deep.
    fn decide(&self, index: u32, level: u32) -> Option<Costs> {
        if level > self.most_levels {
            return None;
        }
        let node = self.node(index);
        let area = node.aabb().half_area();
        if node.is_leaf() {
            return Some(Costs {
                ways: [area * TRIANGLE_COST; WAYS],
                primitives: 1,
            });
        }
        let below = |child: u32| self.decide(node.first_index + child, level + 1);
        let (left, right) = if level < FORKED_LEVELS {
            rayon::join(|| below(0), || below(1))
        } else {
            (below(0), below(1))
        };
        let (costs, decisions) = ways(area, &left?, &right?);
        let bytes = decisions.map(Decision::bits);
        let word = bytes
            .iter()
            .rev()
            .fold(0, |word, &byte| word << 8 | u64::from(byte));
        self.decisions[index as usize].store(word, Relaxed);
        Some(costs)
    }

    fn decision(&self, index: u32, way: u8) -> Decision {
        let word = self.decisions[index as usize].load(Relaxed);
        Decision::of_bits((word >> (8 * way)) as u8)
    }

    /// The wide tree of binary node `index`, whose root is on `level`.
    fn wide(&self, index: u32, level: u32) -> Wide {
        let mut tree = Wide {
            nodes: vec![CwBvhNode::default()],
            ..Wide::default()
        };
        tree.depth = if level <= FORKED_WIDE_LEVELS {
            let inner = self.lay_out(&mut tree, 0, index);
            let below = inner.into_par_iter().flatten();
            let below: Vec<Wide> = below.map(|child| self.wide(child, level + 1)).collect();
            let first = tree.nodes.len() - below.len();
            let deepest = below.iter().map(|tree| tree.depth).max();
            for (k, child) in below.into_iter().enumerate() {
                tree.graft(first + k, child);
            }
            1 + deepest.unwrap_or(0)
        } else {
            self.wide_below(&mut tree, 0, index)
        };
        tree
    }

    /// Lays out everything from binary node `index` down, itself at `place`; how many levels that are.
    fn wide_below(&self, tree: &mut Wide, place: usize, index: u32) -> u32 {
        let inner = self.lay_out(tree, place, index);
        let first = tree.nodes[place].child_base_idx as usize;
        let below = inner.into_iter().flatten().enumerate();
        let levels = below.map(|(k, child)| self.wide_below(tree, first + k, child));
        1 + levels.max().unwrap_or(0)
    }

    /// Lays out the node at `place` that binary node `index` becomes, its leaves, and room for its inner children; which those are.
    fn lay_out(&self, tree: &mut Wide, place: usize, index: u32) -> [Option<u32>; WIDTH] {
        let bounds = self.node(index).aabb();
        let mut node = empty_node(bounds);
        node.primitive_base_idx = tree.primitives.len() as u32;
        node.child_base_idx = tree.nodes.len() as u32;
        let grid = Grid::of(bounds);
        let mut inner = self.ordered(index);
        for (slot, child) in inner.iter_mut().enumerate() {
            let Some(index) = *child else {
                continue;
            };
            grid.quantise(self.node(index).aabb(), slot, &mut node);
            if self.node(index).is_leaf() || self.decision(index, 0).leaf {
                let first = tree.primitives.len() as u32 - node.primitive_base_idx;
                let count = self.take_primitives(index, &mut tree.primitives);
                // Above the place of the first, the count in unary.
                node.child_meta[slot] = first as u8 | ((1_u8 << count) - 1) << 5;
                *child = None;
            } else {
                node.imask |= 1 << slot;
                node.child_meta[slot] = (24 + slot as u8) | (1 << 5);
            }
        }
        let room = tree.nodes.len() + node.imask.count_ones() as usize;
        tree.nodes.resize(room, CwBvhNode::default());
        tree.nodes[place] = node;
        inner
    }

    /// The primitives below a binary node; how many.
    fn take_primitives(&self, index: u32, primitives: &mut Vec<u32>) -> u32 {
        let node = self.node(index);
        let first = node.first_index;
        if node.is_leaf() {
            primitives.push(self.binary.primitive_indices[first as usize]);
            return 1;
        }
        self.take_primitives(first, primitives) + self.take_primitives(first + 1, primitives)
    }

    /// The binary nodes that become the children of the wide node of binary node `index`, each in its slot: where a ray looks by
    /// the signs of its direction, nearest first.
    fn ordered(&self, index: u32) -> [Option<u32>; WIDTH] {
        let mut children = Children::default();
        self.gather(index, 0, &mut children);
        let children = children.list();
        let middle = self.node(index).aabb().center();
        let mut costs = [[0.0; WIDTH]; WIDTH];
        for (costs, &child) in costs.iter_mut().zip(children) {
            let aside = self.node(child).aabb().center() - middle;
            *costs = std::array::from_fn(|slot| direction(slot).dot(aside));
        }
        let mut slots = [None; WIDTH];
        let assigned = assigned(&costs[..children.len()]);
        for (&child, slot) in children.iter().zip(assigned) {
            slots[slot] = Some(child);
        }
        slots
    }

    fn gather(&self, index: u32, way: u8, children: &mut Children) {
        let node = self.node(index);
        if node.is_leaf() {
            return children.push(index);
        }
        let ways = self.decision(index, way).children;
        for (child, way) in [node.first_index, node.first_index + 1]
            .into_iter()
            .zip(ways)
        {
            if self.decision(child, way).shared {
                self.gather(child, way, children);
            } else {
                children.push(child);
            }
        }
    }
}

/// Costs and decisions of a node of this area above two others.
fn ways(area: f32, left: &Costs, right: &Costs) -> (Costs, [Decision; WAYS]) {
    let primitives = left.primitives + right.primitives;
    let (cost, children) = left.shared(right, WIDTH);
    let as_inner = cost + area;
    let as_leaf = if primitives <= LEAF_TRIANGLES {
        primitives as f32 * area * TRIANGLE_COST
    } else {
        f32::INFINITY
    };
    let leaf = as_leaf < as_inner;
    let mut decision = Decision {
        shared: false,
        leaf,
        children,
    };
    let mut decisions = [decision; WAYS];
    let mut costs = [if leaf { as_leaf } else { as_inner }; WAYS];
    for way in 1..WAYS {
        let (cost, children) = left.shared(right, way + 1);
        if cost < costs[way - 1] {
            costs[way] = cost;
            decision = Decision {
                shared: true,
                leaf: false,
                children,
            };
        } else {
            costs[way] = costs[way - 1];
        }
        decisions[way] = decision;
    }
    let costs = Costs {
        ways: costs,
        primitives,
    };
    (costs, decisions)
}

/// Up to [`WIDTH`] binary nodes.
#[derive(Default)]
struct Children {
    nodes: [u32; WIDTH],
    count: usize,
}

impl Children {
    fn push(&mut self, node: u32) {
        self.nodes[self.count] = node;
        self.count += 1;
    }

    fn list(&self) -> &[u32] {
        &self.nodes[..self.count]
    }
}

impl Wide {
    /// Puts a tree in: its root to `place`, the rest behind all that is there.
    fn graft(&mut self, place: usize, tree: Self) {
        let nodes = self.nodes.len() as u32 - 1;
        let primitives = self.primitives.len() as u32;
        let mut moved = tree.nodes.into_iter().map(|node| CwBvhNode {
            child_base_idx: nodes + node.child_base_idx,
            primitive_base_idx: primitives + node.primitive_base_idx,
            ..node
        });
        if let Some(root) = moved.next() {
            self.nodes[place] = root;
        }
        self.nodes.extend(moved);
        self.primitives.extend(tree.primitives);
    }
}

/// The octant that a slot stands for.
fn direction(slot: usize) -> Vec3A {
    let sign = |bit: usize| if slot & bit == 0 { 1.0 } else { -1.0 };
    vec3a(sign(4), sign(2), sign(1))
}

/// The slot of each child: again and again the cheapest pair of a child and a slot that are left, the first of equals. `costs`: of
/// each child in each slot.
fn assigned(costs: &[[f32; WIDTH]]) -> [usize; WIDTH] {
    let mut slots = [WIDTH; WIDTH];
    let mut taken = [false; WIDTH];
    let mut best: [usize; WIDTH] = [0; WIDTH];
    for (best, costs) in best.iter_mut().zip(costs) {
        *best = cheapest(costs, &taken);
    }
    for _ in costs {
        let waiting = (0..costs.len()).filter(|&child| slots[child] == WIDTH);
        let cost = |child: usize| costs[child][best[child]];
        let Some(child) = waiting.reduce(|a, b| if cost(b) < cost(a) { b } else { a }) else {
            break;
        };
        slots[child] = best[child];
        taken[best[child]] = true;
        for other in 0..costs.len() {
            if taken[best[other]] && slots[other] == WIDTH {
                best[other] = cheapest(&costs[other], &taken);
            }
        }
    }
    slots
}

/// The cheapest slot that is not taken; the first of equals.
fn cheapest(costs: &[f32; WIDTH], taken: &[bool; WIDTH]) -> usize {
    let free = (0..WIDTH).filter(|&slot| !taken[slot]);
    free.reduce(|a, b| if costs[b] < costs[a] { b } else { a })
        .unwrap_or(0)
}

/// A node without children, with the grid of its box.
fn empty_node(bounds: &Aabb) -> CwBvhNode {
    CwBvhNode {
        p: bounds.min.into(),
        e: Grid::of(bounds)
            .step
            .to_array()
            .map(|step| (step.to_bits() >> 23) as u8),
        ..CwBvhNode::default()
    }
}

/// Places of 8 bits in a node's box.
struct Grid {
    origin: Vec3A,
    /// Powers of two.
    step: Vec3A,
}

impl Grid {
    fn of(bounds: &Aabb) -> Self {
        let sides = bounds.diagonal().max(Vec3A::splat(1e-20));
        Self {
            origin: bounds.min,
            step: (sides * (1.0 / 255.0)).log2().ceil().exp2(),
        }
    }

    /// Writes the box of the child in `slot`, rounded outwards.
    fn quantise(&self, bounds: &Aabb, slot: usize, node: &mut CwBvhNode) {
        let inverse = 1.0 / self.step;
        let place = |p: Vec3A| p.clamp(Vec3A::ZERO, Vec3A::splat(255.0)).to_array();
        let min = place(((bounds.min - self.origin) * inverse).floor());
        let max = place(((bounds.max - self.origin) * inverse).ceil());
        [
            node.child_min_x[slot],
            node.child_min_y[slot],
            node.child_min_z[slot],
        ] = min.map(|x| x as u8);
        [
            node.child_max_x[slot],
            node.child_max_y[slot],
            node.child_max_z[slot],
        ] = max.map(|x| x as u8);
    }
}

#[cfg(test)]
mod tests {
    use obvhs::{
        bvh2::reinsertion::ReinsertionOptimizer,
        cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh,
        ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    };

    use super::*;

    /// Boxes of all sizes and many shapes, the same every time.
    fn boxes(count: u32) -> Vec<Aabb> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = || vec3a(random(), random(), random());
        (0..count)
            .map(|_| {
                let (corner, side) = (point(), point());
                Aabb::new(corner, corner + side * side * side)
            })
            .collect()
    }

    fn binary(count: u32) -> Bvh2 {
        let mut binary = PlocBuilder::new().build(
            PlocSearchDistance::Low,
            &boxes(count),
            (0..count).collect(),
            SortPrecision::U64,
            0,
        );
        ReinsertionOptimizer::default().run(&mut binary, 0.2, None);
        binary
    }

    #[test]
    fn the_tree_is_that_of_obvhs() {
        for count in [1, 2, 3, 4, 5, 8, 9, 100, 20_000] {
            let binary = binary(count);
            let expected = bvh2_to_cwbvh(&binary, LEAF_TRIANGLES, true, false);
            let found = collapse(&binary, u32::MAX).unwrap();
            assert!(found.nodes == expected.nodes, "{count} boxes");
            assert_eq!(found.primitives, expected.primitive_indices);
        }
    }

    #[test]
    fn a_tree_that_is_too_deep_is_not_walked() {
        assert!(collapse(&binary(64), 6).is_none());
        assert!(collapse(&binary(64), 64).is_some());
    }
}
