//! WHERE things are: obvhs builds the hierarchy, this crate lays it out as the shaders read it.
//!
//! The hierarchy is a compressed wide BVH (CWBVH): eight children a node, 80 bytes, boxes quantised to 8 bits on a grid of
//! powers of two (Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs").
//! Triangles go in, in whatever space the caller likes; nodes and an order of triangles come out. Meshes that are seen in several places
//! have hierarchies of their own, below one over these places ([`build_instanced`]).

mod builder;
mod check;
mod coincident;
mod collapse;
mod cpu;
mod instances;
mod median;

pub use builder::{BvhError, Preset, build, build_of};
pub use check::{Defect, check, check_instanced};
pub use cpu::{CpuHit, CpuTraversal};
pub use instances::{Placed, build_instanced};

/// The deepest tree that [`build`] makes: what a traversal stack has to hold at most.
pub const DEPTH_LIMIT: u32 = 64;

/// A node as uploaded: 20 words, the layout of obvhs' `CwBvhNode` (read in `shaders/intersect.wgsl`).
pub type Node = [u32; 20];

/// A hierarchy over triangles.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// The root first; empty for no triangles.
    pub nodes: Vec<Node>,
    /// Leaf order: entry `i` is the index of the triangle that leaves call `i`. Spatial splits name a triangle more than
    /// once. An entry with [`INSTANCE`] is no triangle but a place of a mesh, and the rest of it the number of that.
    pub leaf_triangles: Vec<u32>,
    /// Levels of nodes, the root is 1. Traversal keeps at most one stack entry a level. Those of the deepest mesh are included, and
    /// what a traversal keeps beside when it goes down into one.
    pub depth: u32,
    /// Where the hierarchies of meshes begin, behind that of the scene.
    pub meshes: Vec<MeshRoot>,
}

/// A mesh's hierarchy, in the space of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshRoot {
    /// Its root.
    pub node: u32,
    /// The first of its entries in leaf order.
    pub leaf: u32,
}

/// Of an entry in leaf order: it stands for an instance.
pub const INSTANCE: u32 = 1 << 31;

/// Where a node says which of its children are nodes (bits 24 to 31), and where these begin; words of a [`Node`].
const INNER_WORD: usize = 3;
const CHILDREN_WORD: usize = 4;
/// .. and its leaves.
const LEAVES_WORD: usize = 5;

impl Bvh {
    /// Does a traversal end, whatever the ray? It does where children lie behind their parents and within the tree, as [`build`] leaves
    /// them. For who hands the tree to a device on which nothing else ends it.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let ends = self.nodes.iter().enumerate().all(|(index, node)| {
            let inner = (node[INNER_WORD] >> 24).count_ones() as usize;
            let first = node[CHILDREN_WORD] as usize;
            inner == 0 || (first > index && first + inner <= self.nodes.len())
        });
        ends && !self.leaf_triangles[self.own_leaves()..]
            .iter()
            .any(|&entry| entry & INSTANCE != 0)
    }

    /// How many entries in leaf order are of the scene's own hierarchy; those behind them are of meshes.
    #[must_use]
    pub fn own_leaves(&self) -> usize {
        match self.meshes.first() {
            Some(first) => first.leaf as usize,
            None => self.leaf_triangles.len(),
        }
    }
}
