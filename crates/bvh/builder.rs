//! Triangles to a [`Bvh`], by obvhs.

use bytemuck::allocation::cast_vec;
use glam::{Vec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::PlocBuilder,
    splits::split_aabbs_preset,
    triangle::Triangle,
};
use rayon::prelude::*;

use crate::{Bvh, coincident::Groups, collapse::collapse, median};

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
pub(crate) const TRIANGLE_LIMIT: usize = (1 << 29) - 1;

/// The deepest binary tree that is collapsed into a wide one. Agglomeration makes chains of triangles that lie in
/// almost one place; those are split at the median instead, which gives at most 29 levels. Three binary
/// levels make about one wide level, so the traversal stack stays below [`crate::DEPTH_LIMIT`].
const BINARY_DEPTH_LIMIT: u32 = 64;

/// Builds a hierarchy over `triangles`, each three finite vertices.
///
/// # Errors
/// [`BvhError`] if there are too many triangles.
pub fn build(triangles: &[[Vec3; 3]], preset: Preset) -> Result<Bvh, BvhError> {
    build_of(triangles.len(), |index| triangles[index], preset)
}

/// As [`build`], of `count` triangles whose corners `corners` knows: whoever has them by indices need not lay them out.
///
/// # Errors
/// As [`build`].
pub fn build_of(
    count: usize,
    corners: impl Fn(usize) -> [Vec3; 3] + Sync,
    preset: Preset,
) -> Result<Bvh, BvhError> {
    if count > TRIANGLE_LIMIT {
        return Err(BvhError::TooManyTriangles {
            count,
            limit: TRIANGLE_LIMIT,
        });
    }
    let triangle = |index| {
        let [v0, v1, v2] = corners(index).map(Vec3A::from);
        Triangle { v0, v1, v2 }
    };
    let boxes = || -> Vec<Aabb> {
        let all = (0..count).into_par_iter();
        all.map(|index| triangle(index).aabb()).collect()
    };
    let triangles = || (0..count).into_par_iter().map(triangle).collect();
    Ok(build_over(count, boxes, Some(&triangles), preset))
}

/// A hierarchy over boxes. Where `triangles` says what is in them, they may be split.
pub(crate) fn build_over(
    count: usize,
    boxes: impl Fn() -> Vec<Aabb>,
    triangles: Option<&dyn Fn() -> Vec<Triangle>>,
    preset: Preset,
) -> Bvh {
    if count == 0 {
        return Bvh::default();
    }
    let mut parameters = parameters(preset);
    parameters.pre_split &= triangles.is_some();
    let binary = match triangles {
        Some(triangles) if parameters.pre_split => {
            let (boxes, indices) = split(&triangles(), boxes());
            agglomerate(boxes, indices, &parameters)
        }
        _ => agglomerate(boxes(), (0..count as u32).collect(), &parameters),
    };
    let wide = collapse(&binary, BINARY_DEPTH_LIMIT)
        .or_else(|| collapse(&median::split(&boxes()), BINARY_DEPTH_LIMIT))
        .expect("halving 2^29 triangles takes 30 levels");
    Bvh {
        nodes: cast_vec(wide.nodes),
        leaf_triangles: wide.primitives,
        depth: wide.depth,
        meshes: Vec::new(),
    }
}

fn parameters(preset: Preset) -> BvhBuildParams {
    match preset {
        Preset::Fast => BvhBuildParams::very_fast_build(),
        Preset::Balanced => BvhBuildParams::medium_build(),
        Preset::Best => BvhBuildParams::very_slow_build(),
    }
}

/// Cuts large triangles' boxes into several; also says of which triangle each is.
fn split(triangles: &[Triangle], mut boxes: Vec<Aabb>) -> (Vec<Aabb>, Vec<u32>) {
    let mut indices: Vec<u32> = (0..triangles.len() as u32).collect();
    let areas = || boxes.iter().map(Aabb::half_area);
    let average = areas().sum::<f32>() / triangles.len() as f32;
    let largest = areas().fold(0.0, f32::max);
    split_aabbs_preset(&mut boxes, &mut indices, triangles, average, largest);
    (boxes, indices)
}

/// Parallel locally-ordered clustering (Meister and Bittner 2018), then reinsertion, as obvhs' presets have it.
fn agglomerate(boxes: Vec<Aabb>, indices: Vec<u32>, parameters: &BvhBuildParams) -> Bvh2 {
    let Some(groups) = Groups::of(&boxes, &indices) else {
        return cluster(boxes, indices, parameters);
    };
    drop((boxes, indices));
    let (boxes, members) = groups.into_parts();
    let numbers = (0..members.groups()).collect();
    members.expanded(cluster(boxes, numbers, parameters))
}

fn cluster(boxes: Vec<Aabb>, indices: Vec<u32>, parameters: &BvhBuildParams) -> Bvh2 {
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        parameters.ploc_search_distance,
        &boxes,
        indices,
        parameters.sort_precision,
        parameters.search_depth_threshold,
    );
    drop(boxes);
    binary.uses_spatial_splits = parameters.pre_split;
    ReinsertionOptimizer::default().run(&mut binary, parameters.reinsertion_batch_ratio, None);
    binary
}
