//! Is a hierarchy right? Used by tests, and by anyone who doubts a tree.

use bytemuck::cast;
use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;

use crate::{Bvh, Placed};

/// What is wrong with a hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Defect {
    /// A triangle that no ray can find.
    #[error("triangle {0} is in no leaf")]
    Missing(u32),
    /// Without spatial splits each triangle belongs to one leaf.
    #[error("triangle {0} is in more than one leaf")]
    Twice(u32),
    /// A leaf names a triangle, or a node a child, that does not exist.
    #[error("node {0} points outside the tree")]
    Dangling(u32),
    /// A child reaches out of the box that its parent tests.
    #[error("child {child} of node {node} is not enclosed by its box")]
    NotEnclosed {
        /// The parent.
        node: u32,
        /// Its slot, 0 to 7.
        child: u32,
    },
}

/// Checks that each triangle is in a leaf (exactly one, unless `split`), and that each box encloses what is below it.
/// With `split` a leaf's box holds only a part of its triangles, so there only inner boxes and coverage are checked.
///
/// # Errors
/// The first [`Defect`] found.
pub fn check(bvh: &Bvh, triangles: &[[Vec3; 3]], split: bool) -> Result<(), Defect> {
    let mut seen = vec![0_u32; triangles.len()];
    for index in (0..bvh.nodes.len()).rev() {
        check_node(bvh, triangles, split, index, &mut seen)?;
    }
    for (index, &count) in (0_u32..).zip(&seen) {
        match count {
            0 => return Err(Defect::Missing(index)),
            1 => {}
            _ if split => {}
            _ => return Err(Defect::Twice(index)),
        }
    }
    Ok(())
}

/// As [`check`], of a hierarchy of two levels, `corners` knowing each triangle in the space that it lies in. Indices of a [`Defect`] are
/// those of the level in which it was found.
///
/// # Errors
/// The first [`Defect`] found.
pub fn check_instanced(
    bvh: &Bvh,
    placed: Placed<'_>,
    corners: impl Fn(usize) -> [Vec3; 3],
    split: bool,
) -> Result<(), Defect> {
    let own = (0..placed.own).map(&corners);
    // Of a box two corners.
    let boxes = placed.instances.iter().map(|&(min, max)| [min, max, max]);
    let all: Vec<[Vec3; 3]> = own.chain(boxes).collect();
    check(&bvh.part(None, placed.own, 0), &all, false)?;
    for (number, mesh) in placed.meshes.iter().enumerate() {
        let triangles: Vec<[Vec3; 3]> = mesh.clone().map(|index| corners(index as usize)).collect();
        check(&bvh.part(Some(number), 0, mesh.start), &triangles, split)?;
    }
    Ok(())
}

fn check_node(
    bvh: &Bvh,
    triangles: &[[Vec3; 3]],
    split: bool,
    index: usize,
    seen: &mut [u32],
) -> Result<(), Defect> {
    let dangling = Defect::Dangling(index as u32);
    let node: CwBvhNode = cast(bvh.nodes[index]);
    for child in (0..8).filter(|&child| !node.is_child_empty(child)) {
        let (min, max) = if node.is_leaf(child) {
            let (first, count) = node.child_primitives(child);
            let leaf = bvh
                .leaf_triangles
                .get(first as usize..(first + count) as usize)
                .ok_or(dangling)?;
            let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for &triangle in leaf {
                *seen.get_mut(triangle as usize).ok_or(dangling)? += 1;
                bounds = triangles[triangle as usize]
                    .iter()
                    .fold(bounds, |(min, max), &v| (min.min(v), max.max(v)));
            }
            if split {
                continue;
            }
            bounds
        } else {
            let below = bvh
                .nodes
                .get(node.child_node_index(child) as usize)
                .ok_or(dangling)?;
            exact_bounds(&cast(*below), bvh, triangles, split)
        };
        let boxed = node.child_aabb(child);
        // The grid's own rounding, which traversal's slack covers (shaders/intersect.wgsl).
        let slack = Vec3::from(node.compute_extent()) * 255.0 * 2_f32.powi(-21);
        if (min + slack).cmplt(Vec3::from(boxed.min)).any()
            || (max - slack).cmpgt(Vec3::from(boxed.max)).any()
        {
            return Err(Defect::NotEnclosed {
                node: index as u32,
                child: child as u32,
            });
        }
    }
    Ok(())
}

/// The box around what the node's leaves hold and what its inner children claim.
fn exact_bounds(node: &CwBvhNode, bvh: &Bvh, triangles: &[[Vec3; 3]], split: bool) -> (Vec3, Vec3) {
    let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for child in (0..8).filter(|&child| !node.is_child_empty(child)) {
        if node.is_leaf(child) && !split {
            let (first, count) = node.child_primitives(child);
            for leaf in first..first + count {
                for &v in &triangles[bvh.leaf_triangles[leaf as usize] as usize] {
                    bounds = (bounds.0.min(v), bounds.1.max(v));
                }
            }
        } else if !node.is_leaf(child) {
            let inner = exact_bounds(
                &cast(bvh.nodes[node.child_node_index(child) as usize]),
                bvh,
                triangles,
                split,
            );
            bounds = (bounds.0.min(inner.0), bounds.1.max(inner.1));
        }
    }
    bounds
}
