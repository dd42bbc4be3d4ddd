//! A binary tree by halving: of poor quality, but of logarithmic depth whatever the geometry. For scenes that
//! agglomeration makes chains of.

use obvhs::{aabb::Aabb, bvh2::Bvh2, bvh2::node::Bvh2Node};

/// Splits at the median of the boxes' centres along the longest side, down to one box a leaf.
pub(crate) fn split(boxes: &[Aabb]) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut pending = vec![(0_usize, 0..boxes.len())];
    while let Some((index, range)) = pending.pop() {
        let bounds = around(boxes, &order[range.clone()]);
        if range.len() == 1 {
            nodes[index] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let axis = longest_axis(&bounds);
        let middle = range.len() / 2;
        // The index breaks ties, so the tree is the same in every run.
        order[range.clone()].select_nth_unstable_by(middle, |&a, &b| {
            let centre = |index: u32| (boxes[index as usize].min + boxes[index as usize].max)[axis];
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        let left = nodes.len();
        nodes[index] = Bvh2Node::new(bounds, 0, left as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        let cut = range.start + middle;
        pending.extend([(left, range.start..cut), (left + 1, cut..range.end)]);
    }
    Bvh2 {
        nodes,
        primitive_indices: order,
        children_are_ordered_after_parents: true,
        ..Bvh2::default()
    }
}

fn around(boxes: &[Aabb], order: &[u32]) -> Aabb {
    order.iter().fold(Aabb::empty(), |bounds, &index| {
        bounds.union(&boxes[index as usize])
    })
}

fn longest_axis(bounds: &Aabb) -> usize {
    let sides = (bounds.max - bounds.min).to_array();
    (0..3)
        .max_by(|&a, &b| sides[a].total_cmp(&sides[b]))
        .unwrap_or(0)
}
