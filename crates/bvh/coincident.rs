//! Boxes that are the same, once each. Agglomeration finds no nearest one among them: it takes time in the square of their number
//! (minutes for 100,000) and makes chains.

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
};
use rayon::prelude::*;

/// Boxes by the place that they are in.
pub(crate) struct Groups {
    /// The different boxes, each where its first copy was.
    boxes: Vec<Aabb>,
    members: Members,
}

/// What lies in each group.
pub(crate) struct Members {
    /// Group after group, each in the order given.
    list: Vec<u32>,
    /// Where in `list` each group begins; the last entry is the end.
    starts: Vec<u32>,
}

impl Groups {
    /// `None` where no box comes twice. `indices` says what is in each.
    pub(crate) fn of(boxes: &[Aabb], indices: &[u32]) -> Option<Self> {
        let groups = number_groups(first_copies(boxes)?);
        let firsts = first_of_each(&groups);
        Some(Self {
            boxes: firsts.iter().map(|&place| boxes[place]).collect(),
            members: Members::new(&groups, firsts.len(), indices),
        })
    }

    /// The different boxes, numbered as the groups are, and what lies in each.
    pub(crate) fn into_parts(self) -> (Vec<Aabb>, Members) {
        (self.boxes, self.members)
    }
}

/// For each box the place of the first that is the same; `None` where each is its own. Copies are missed where different boxes of the
/// same hash lie between them, which takes a scene made for it: the tree is right all the same.
fn first_copies(boxes: &[Aabb]) -> Option<Vec<u32>> {
    let hashes = boxes.par_iter().enumerate();
    // Hash above place: one comparison orders both.
    let mut keys: Vec<u64> = hashes
        .map(|(place, bounds)| u64::from(hash(bounds)) << 32 | place as u64)
        .collect();
    keys.par_sort_unstable();
    let place = |key: u64| (key as u32) as usize;
    let same = |a: &u64, b: &u64| a >> 32 == b >> 32 && boxes[place(*a)] == boxes[place(*b)];
    if !keys.par_windows(2).any(|pair| same(&pair[0], &pair[1])) {
        return None;
    }
    let mut firsts: Vec<u32> = (0..boxes.len() as u32).collect();
    for copies in keys.chunk_by(same) {
        for &copy in copies {
            firsts[place(copy)] = copies[0] as u32;
        }
    }
    Some(firsts)
}

/// From the place of the first copy of each to the number of its group: groups are numbered by their first copies.
fn number_groups(mut firsts: Vec<u32>) -> Vec<u32> {
    let mut groups = 0;
    for place in 0..firsts.len() {
        let first = firsts[place] as usize;
        if first == place {
            firsts[place] = groups;
            groups += 1;
        } else {
            firsts[place] = firsts[first];
        }
    }
    firsts
}

/// The place of the first box of each group.
fn first_of_each(groups: &[u32]) -> Vec<usize> {
    let mut firsts = Vec::new();
    for (place, &group) in groups.iter().enumerate() {
        if group as usize == firsts.len() {
            firsts.push(place);
        }
    }
    firsts
}

impl Members {
    /// Sorts `indices` by their groups, of which there are `count`, by counting.
    fn new(groups: &[u32], count: usize, indices: &[u32]) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for &group in groups {
            starts[group as usize + 1] += 1;
        }
        for group in 0..count {
            starts[group + 1] += starts[group];
        }
        let mut next = starts.clone();
        let mut list = vec![0; indices.len()];
        for (&group, &index) in groups.iter().zip(indices) {
            let place = &mut next[group as usize];
            list[*place as usize] = index;
            *place += 1;
        }
        Self { list, starts }
    }

    /// How many groups there are.
    pub(crate) fn groups(&self) -> u32 {
        self.starts.len() as u32 - 1
    }

    fn of(&self, group: u32) -> &[u32] {
        let group = group as usize;
        &self.list[self.starts[group] as usize..self.starts[group + 1] as usize]
    }

    /// A tree over all members from one over the groups: under each leaf they are halved down to one a leaf.
    pub(crate) fn expanded(&self, tree: Bvh2) -> Bvh2 {
        let groups = tree.primitive_indices;
        let mut nodes = tree.nodes;
        let mut order = Vec::with_capacity(self.list.len());
        for index in 0..nodes.len() {
            let leaf = nodes[index];
            if !leaf.is_leaf() {
                continue;
            }
            let first = leaf.first_index as usize;
            let start = order.len();
            for &group in &groups[first..first + leaf.prim_count as usize] {
                order.extend_from_slice(self.of(group));
            }
            halve(&mut nodes, index, start..order.len());
        }
        Bvh2 {
            nodes,
            primitive_indices: order,
            children_are_ordered_after_parents: tree.children_are_ordered_after_parents,
            uses_spatial_splits: tree.uses_spatial_splits,
            ..Bvh2::default()
        }
    }
}

/// Makes node `root` the root of a tree over a range of primitives that all have its box.
fn halve(nodes: &mut Vec<Bvh2Node>, root: usize, range: std::ops::Range<usize>) {
    let bounds = *nodes[root].aabb();
    let mut pending = vec![(root, range)];
    while let Some((index, range)) = pending.pop() {
        if range.len() == 1 {
            nodes[index] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let left = nodes.len();
        nodes[index] = Bvh2Node::new(bounds, 0, left as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        let cut = range.start + range.len() / 2;
        pending.extend([(left, range.start..cut), (left + 1, cut..range.end)]);
    }
}

/// Equal for equal boxes (FNV-1a over their numbers); others are told apart by themselves.
fn hash(bounds: &Aabb) -> u32 {
    let numbers = [bounds.min, bounds.max].map(|corner| corner.to_array());
    let hash = numbers
        .as_flattened()
        .iter()
        // Zero has two signs.
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, x| {
            (hash ^ u64::from((x + 0.0).to_bits())).wrapping_mul(0x0100_0000_01b3)
        });
    (hash >> 32) as u32
}

#[cfg(test)]
mod tests {
    use obvhs::ploc::PlocBuilder;

    use super::*;

    fn cube(at: f32) -> Aabb {
        let corner = glam::Vec3A::splat(at);
        Aabb::new(corner, corner + 1.0)
    }

    #[test]
    fn boxes_that_differ_are_no_groups() {
        assert!(Groups::of(&[cube(0.0), cube(1.0), cube(2.0)], &[0, 1, 2]).is_none());
        assert!(Groups::of(&[], &[]).is_none());
    }

    #[test]
    fn every_member_is_in_one_leaf_of_its_own_box() {
        let places: Vec<f32> = (0..50).map(|k| [3.0, -0.0, 7.0, 0.0, 3.0][k % 5]).collect();
        let boxes: Vec<Aabb> = places.iter().map(|&at| cube(at)).collect();
        let indices: Vec<u32> = (100..150).collect();
        let groups = Groups::of(&boxes, &indices).unwrap();
        let (distinct, members) = groups.into_parts();
        assert_eq!((distinct.len(), members.groups()), (3, 3));
        let tree = PlocBuilder::with_capacity(3).build(
            obvhs::ploc::PlocSearchDistance::default(),
            &distinct,
            vec![0, 1, 2],
            obvhs::ploc::SortPrecision::U64,
            0,
        );
        let tree = members.expanded(tree);
        let mut seen = Vec::new();
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            assert_eq!(leaf.prim_count, 1);
            let member = tree.primitive_indices[leaf.first_index as usize];
            assert_eq!(*leaf.aabb(), boxes[member as usize - 100]);
            seen.push(member);
        }
        seen.sort_unstable();
        assert_eq!(seen, indices);
    }
}
