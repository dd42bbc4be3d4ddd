//! The independent judge: the same equation, recursive, in f64, as in the book.
//!
//! Implements `shaders/README.md` from that page alone, in the form of Whitted 1980: [`Oracle::radiance`] is a function
//! that calls itself for the reflected and the refracted ray and returns their light, bottom up. It shares nothing with
//! the renderer that it judges but the [scene model](raytree_scene::model): vectors, intersection, bounding-box tree,
//! texture filtering, environment look-ups and Fresnel equations are its own. Slow and plain on purpose.
//!
//! All lengths are in scene space, all colours linear RGB. The scene is trusted: indices out of range panic.

mod camera;
mod crossing;
mod environment;
mod fresnel;
mod intersect;
mod light;
mod material;
mod media;
mod pbr;
mod radiance;
mod render;
mod shadow;
mod solids;
mod spread;
mod surface;
mod texture;
mod tree;
mod vec;
mod whitted;

pub use intersect::Hit;
pub use render::{Counts, Ended, Picture, Rays, Settings, Shading};
pub use spread::Spread;
pub use surface::FirstHit;

use std::borrow::Cow;

use raytree_scene::model::Scene;

use crate::tree::Tree;

/// A scene made ready to be asked about.
pub struct Oracle<'s> {
    /// With a copy of each shared mesh for each node: nothing here knows of places of meshes.
    scene: Cow<'s, Scene>,
    tree: Tree,
    solids: solids::Memo,
}

impl<'s> Oracle<'s> {
    /// Up to this many triangles every ray is tested against every one of them: nothing simpler can be wrong.
    pub const BRUTE_FORCE_LIMIT: usize = 64;

    /// The oracle of `scene`: brute force for few triangles, a bounding-box tree for more.
    #[must_use]
    pub fn new(scene: &'s Scene) -> Self {
        if scene.placed_triangles() <= Self::BRUTE_FORCE_LIMIT as u64 {
            Self::brute_force(scene)
        } else {
            Self::with_tree(scene)
        }
    }

    /// The oracle that tests every triangle, however many there are.
    #[must_use]
    pub fn brute_force(scene: &'s Scene) -> Self {
        let scene = scene.copied();
        Self {
            tree: Tree::single_leaf(&scene.geometry),
            scene,
            solids: solids::Memo::default(),
        }
    }

    /// The oracle with a bounding-box tree, however few triangles there are.
    #[must_use]
    pub fn with_tree(scene: &'s Scene) -> Self {
        let scene = scene.copied();
        Self {
            tree: Tree::build(&scene.geometry),
            scene,
            solids: solids::Memo::default(),
        }
    }
}
