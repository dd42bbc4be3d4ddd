//! Triangles to a [`Bvh`], by obvhs.

use glam::{Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh},
    ploc::PlocBuilder,
    splits::split_aabbs_preset,
    triangle::Triangle,
};

use crate::{Bvh, Node, coincident::Groups, median};

/// How much time to spend on building for faster traversal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Quickest to build; no spatial splits.
    Fast,
    /// Good trees quickly; no spatial splits.
    #[default]
    Balanced,
    /// The best trees: spatial splits and thorough reinsertion.
    Best,
}

/// Why no hierarchy could be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BvhError {
    /// A leaf entry keeps two bits for flags.
    #[error(
        "the scene has {count} triangles, more than the {limit} that a BVH can index; split the scene"
    )]
    TooManyTriangles {
        /// Triangles given.
        count: usize,
        /// The most that can be indexed.
        limit: usize,
    },
}

/// The most triangles, counted once for each leaf that names them: a leaf entry has 30 bits for the index. Splitting may
/// double them.
const TRIANGLE_LIMIT: usize = (1 << 29) - 1;

/// The deepest binary tree that is collapsed into a wide one. Agglomeration makes chains of triangles that lie in
/// almost one place; those are split at the median instead, which gives at most 29 levels. Three binary
/// levels make about one wide level, so the traversal stack stays below [`crate::DEPTH_LIMIT`].
const BINARY_DEPTH_LIMIT: u32 = 64;

/// Builds a hierarchy over `triangles`, each three finite vertices.
///
/// # Errors
/// [`BvhError`] if there are too many triangles.
pub fn build(triangles: &[[Vec3; 3]], preset: Preset) -> Result<Bvh, BvhError> {
    if triangles.len() > TRIANGLE_LIMIT {
        return Err(BvhError::TooManyTriangles {
            count: triangles.len(),
            limit: TRIANGLE_LIMIT,
        });
    }
    if triangles.is_empty() {
        return Ok(Bvh::default());
    }
    let padded: Vec<Triangle> = triangles
        .iter()
        .map(|&[v0, v1, v2]| Triangle {
            v0: Vec3A::from(v0),
            v1: Vec3A::from(v1),
            v2: Vec3A::from(v2),
        })
        .collect();
    let mut binary = agglomerate(&padded, preset);
    if binary_depth(&binary) > BINARY_DEPTH_LIMIT {
        let boxes: Vec<Aabb> = padded.iter().map(Boundable::aabb).collect();
        binary = median::split(&boxes);
    }
    let wide = bvh2_to_cwbvh(&binary, 3, true, false);
    let depth = wide_depth(&wide);
    Ok(Bvh {
        nodes: wide
            .nodes
            .iter()
            .copied()
            .map(bytemuck::cast::<_, Node>)
            .collect(),
        leaf_triangles: wide.primitive_indices,
        depth,
    })
}

/// Parallel locally-ordered clustering (Meister and Bittner 2018), then reinsertion, as obvhs' presets have it.
fn agglomerate(triangles: &[Triangle], preset: Preset) -> Bvh2 {
    let parameters = match preset {
        Preset::Fast => BvhBuildParams::very_fast_build(),
        Preset::Balanced => BvhBuildParams::medium_build(),
        Preset::Best => BvhBuildParams::very_slow_build(),
    };
    let mut boxes: Vec<Aabb> = triangles.iter().map(Boundable::aabb).collect();
    let mut indices: Vec<u32> = (0..triangles.len() as u32).collect();
    if parameters.pre_split {
        let areas = || boxes.iter().map(Aabb::half_area);
        let average = areas().sum::<f32>() / triangles.len() as f32;
        let largest = areas().fold(0.0, f32::max);
        split_aabbs_preset(&mut boxes, &mut indices, triangles, average, largest);
    }
    let groups = Groups::of(&boxes, &indices);
    let (boxes, indices) = match &groups {
        Some(groups) => (
            groups.boxes.as_slice(),
            (0..groups.boxes.len() as u32).collect(),
        ),
        None => (boxes.as_slice(), indices),
    };
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        parameters.ploc_search_distance,
        boxes,
        indices,
        parameters.sort_precision,
        parameters.search_depth_threshold,
    );
    binary.uses_spatial_splits = parameters.pre_split;
    ReinsertionOptimizer::default().run(&mut binary, parameters.reinsertion_batch_ratio, None);
    match groups {
        Some(groups) => groups.expanded(binary),
        None => binary,
    }
}

/// Levels of a binary tree; the root is 1.
fn binary_depth(tree: &Bvh2) -> u32 {
    let mut deepest = 0;
    let mut pending = vec![(0_usize, 1_u32)];
    while let Some((index, level)) = pending.pop() {
        deepest = deepest.max(level);
        let node = &tree.nodes[index];
        if !node.is_leaf() {
            let left = node.first_index as usize;
            pending.extend([(left, level + 1), (left + 1, level + 1)]);
        }
    }
    deepest
}

/// Levels of a wide tree; the root is 1. Children lie behind their parent, so one pass from the front is enough.
fn wide_depth(tree: &CwBvh) -> u32 {
    let mut level = vec![1_u32; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        for child in (0..8).filter(|&child| !node.is_leaf(child)) {
            level[node.child_node_index(child) as usize] = level[index] + 1;
        }
    }
    level.into_iter().max().unwrap_or(0)
}
