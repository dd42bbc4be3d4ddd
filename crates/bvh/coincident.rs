//! Boxes that are the same, once each. Agglomeration finds no nearest one among them: it takes time in the square of their number
//! (minutes for 100,000) and makes chains.

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
};

/// Boxes by the place that they are in.
pub(crate) struct Groups {
    /// The different boxes, each where its first copy was.
    pub(crate) boxes: Vec<Aabb>,
    /// What lies in each of them, in the order given.
    members: Vec<Vec<u32>>,
}

impl Groups {
    /// `None` where no box comes twice. `indices` says what is in each.
    pub(crate) fn of(boxes: &[Aabb], indices: &[u32]) -> Option<Self> {
        let mut keys: Vec<(u64, usize)> = boxes.iter().map(key).zip(0..).collect();
        keys.sort_unstable();
        let same = |a: &(u64, usize), b: &(u64, usize)| a.0 == b.0 && boxes[a.1] == boxes[b.1];
        if !keys.windows(2).any(|pair| same(&pair[0], &pair[1])) {
            return None;
        }
        // Places of copies, by the place of the first.
        let mut copies: Vec<Vec<usize>> = keys
            .chunk_by(same)
            .map(|chunk| chunk.iter().map(|&(_, place)| place).collect())
            .collect();
        copies.sort_unstable_by_key(|places| places[0]);
        let members = copies
            .iter()
            .map(|places| places.iter().map(|&place| indices[place]));
        Some(Self {
            boxes: copies.iter().map(|places| boxes[places[0]]).collect(),
            members: members.map(Iterator::collect).collect(),
        })
    }

    /// A tree over all members from one over the groups: under each leaf they are halved down to one a leaf.
    pub(crate) fn expanded(&self, tree: Bvh2) -> Bvh2 {
        let groups = tree.primitive_indices;
        let mut nodes = tree.nodes;
        let mut order = Vec::new();
        for index in 0..nodes.len() {
            let leaf = nodes[index];
            if !leaf.is_leaf() {
                continue;
            }
            let first = leaf.first_index as usize;
            let start = order.len();
            for &group in &groups[first..first + leaf.prim_count as usize] {
                order.extend_from_slice(&self.members[group as usize]);
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
    let bounds = nodes[root].aabb;
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
fn key(bounds: &Aabb) -> u64 {
    let numbers = [bounds.min, bounds.max].map(|corner| corner.to_array());
    numbers
        .as_flattened()
        .iter()
        // Zero has two signs.
        .fold(0xcbf2_9ce4_8422_2325, |hash, x| {
            (hash ^ u64::from((x + 0.0).to_bits())).wrapping_mul(0x0100_0000_01b3)
        })
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
        assert_eq!(groups.boxes.len(), 3);
        let tree = PlocBuilder::with_capacity(3).build(
            obvhs::ploc::PlocSearchDistance::default(),
            &groups.boxes,
            vec![0, 1, 2],
            obvhs::ploc::SortPrecision::U64,
            0,
        );
        let tree = groups.expanded(tree);
        let mut seen = Vec::new();
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            assert_eq!(leaf.prim_count, 1);
            let member = tree.primitive_indices[leaf.first_index as usize];
            assert_eq!(leaf.aabb, boxes[member as usize - 100]);
            seen.push(member);
        }
        seen.sort_unstable();
        assert_eq!(seen, indices);
    }
}
