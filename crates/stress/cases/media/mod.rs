//! Glass in water, bubbles in glass, faces that coincide, overlapping solids, cameras inside solids, open meshes.

mod open;
mod paper;
mod pictures;
mod scenes;

use crate::stage::{Stage, StressError};

/// A clear solid that reflects by Fresnel.
pub(super) fn clear(ior: f32) -> raytree_scene::model::Material {
    scenes::solid(ior, 0.0, 1.0)
}

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    pictures::against_oracle(stage)?;
    pictures::of_the_same_thing(stage)?;
    paper::run(stage)?;
    open::run(stage)
}
