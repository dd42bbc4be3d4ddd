//! The cases, one file each. `STRESS.md` at the project's root explains them.

pub(crate) mod boxes;
pub(crate) mod cameras;
pub(crate) mod fresnel;
pub(crate) mod geometry;
pub(crate) mod lights;
pub(crate) mod media;
pub(crate) mod place;
pub(crate) mod scale;
pub(crate) mod self_hits;
pub(crate) mod shading;
pub(crate) mod terminator;
pub(crate) mod thin;
pub(crate) mod trees;
pub(crate) mod watertight;
