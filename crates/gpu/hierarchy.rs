//! Where a scene's triangles are, for the room that knows no scenes.

use raytree_bvh::{Bvh, BvhError, Preset};
use raytree_scene::model::Scene;

/// The hierarchy of a scene's triangles.
///
/// # Errors
/// [`BvhError`] if the scene has too many.
pub fn build_bvh(scene: &Scene, preset: Preset) -> Result<Bvh, BvhError> {
    let positions = &scene.geometry.positions;
    let triangles = &scene.geometry.triangles;
    let corners = |index: usize| triangles[index].vertices.map(|v| positions[v as usize]);
    raytree_bvh::build_of(triangles.len(), corners, preset)
}
