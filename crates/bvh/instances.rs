//! Hierarchies of two levels: one over the scene's own triangles and the places of meshes, and one over each mesh.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use rayon::prelude::*;
use std::ops::Range;

use crate::{
    Bvh, BvhError, CHILDREN_WORD, INSTANCE, LEAVES_WORD, MeshRoot, Preset, build_of,
    builder::{TRIANGLE_LIMIT, build_over},
};

/// What a scene with shared meshes consists of.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// How many triangles are the scene's own: the first ones.
    pub own: usize,
    /// The triangles of each mesh.
    pub meshes: &'a [Range<u32>],
    /// Least and greatest corner of a box around each instance, in the scene's space.
    pub instances: &'a [(Vec3, Vec3)],
}

/// Levels that a traversal keeps beside those of the two hierarchies when it goes down into a mesh: the children of the node that it
/// leaves, and the other instances in it.
const BESIDE: u32 = 2;

/// As [`crate::build_of`], of a scene with shared meshes; `corners` knows each triangle in the space that it lies in. The instances'
/// leaves are not split.
///
/// # Errors
/// [`BvhError`] if there are too many triangles and instances.
pub fn build_instanced(
    placed: Placed<'_>,
    corners: impl Fn(usize) -> [Vec3; 3] + Sync,
    preset: Preset,
) -> Result<Bvh, BvhError> {
    let Placed {
        own,
        meshes,
        instances,
    } = placed;
    let of_meshes: usize = meshes.iter().map(ExactSizeIterator::len).sum();
    let count = own + of_meshes + instances.len();
    if count > TRIANGLE_LIMIT {
        return Err(BvhError::TooManyTriangles {
            count,
            limit: TRIANGLE_LIMIT,
        });
    }
    let boxes = || -> Vec<Aabb> {
        let triangles = (0..own).into_par_iter().map(|index| {
            let corners = corners(index).map(Vec3A::from);
            Aabb::from_points(&corners)
        });
        let places = instances.par_iter();
        let places = places.map(|&(min, max)| Aabb::new(min.into(), max.into()));
        triangles.chain(places).collect()
    };
    let mut all = build_over(own + instances.len(), boxes, None, preset);
    for entry in &mut all.leaf_triangles {
        let index = *entry as usize;
        if index >= own {
            *entry = INSTANCE | (index - own) as u32;
        }
    }
    let mut deepest = 0;
    for mesh in meshes {
        let first = mesh.start as usize;
        let below = build_of(mesh.len(), |index| corners(first + index), preset)?;
        deepest = deepest.max(below.depth);
        all.append(below, mesh.start);
    }
    if !meshes.is_empty() {
        all.depth += BESIDE + deepest;
    }
    Ok(all)
}

impl Bvh {
    /// The hierarchy of the scene's own triangles and instances (`None`), or that of a mesh, as a tree by itself: entries of instances
    /// are counted on from `own`, those of a mesh from its first triangle.
    pub(crate) fn part(&self, mesh: Option<usize>, own: usize, first: u32) -> Self {
        let begin = mesh.map_or(MeshRoot { node: 0, leaf: 0 }, |mesh| self.meshes[mesh]);
        let next = mesh.map_or(0, |mesh| mesh + 1);
        let end = self.meshes.get(next).copied().unwrap_or(MeshRoot {
            node: self.nodes.len() as u32,
            leaf: self.leaf_triangles.len() as u32,
        });
        let nodes = &self.nodes[begin.node as usize..end.node as usize];
        let leaves = &self.leaf_triangles[begin.leaf as usize..end.leaf as usize];
        let entry = |&entry: &u32| match entry & INSTANCE {
            0 => entry.wrapping_sub(first),
            _ => own as u32 + (entry & !INSTANCE),
        };
        Self {
            nodes: nodes
                .iter()
                .map(|&(mut words)| {
                    words[CHILDREN_WORD] = words[CHILDREN_WORD].wrapping_sub(begin.node);
                    words[LEAVES_WORD] = words[LEAVES_WORD].wrapping_sub(begin.leaf);
                    words
                })
                .collect(),
            leaf_triangles: leaves.iter().map(entry).collect(),
            depth: self.depth,
            meshes: Vec::new(),
        }
    }

    /// Adds the hierarchy of a mesh whose triangles are counted from `first`.
    fn append(&mut self, mesh: Self, first: u32) {
        let (node, leaf) = (self.nodes.len() as u32, self.leaf_triangles.len() as u32);
        self.meshes.push(MeshRoot { node, leaf });
        self.nodes.extend(mesh.nodes.into_iter().map(|mut words| {
            words[CHILDREN_WORD] += node;
            words[LEAVES_WORD] += leaf;
            words
        }));
        let triangles = mesh.leaf_triangles.into_iter();
        self.leaf_triangles
            .extend(triangles.map(|triangle| first + triangle));
    }
}
