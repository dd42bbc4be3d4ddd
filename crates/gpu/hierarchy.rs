//! Where a scene's triangles are, for the room that knows no scenes.

use glam::Vec3;
use raytree_bvh::{Bvh, BvhError, Preset};
use raytree_scene::model::Scene;

/// The hierarchy of a scene's triangles.
///
/// # Errors
/// [`BvhError`] if the scene has too many.
pub fn build_bvh(scene: &Scene, preset: Preset) -> Result<Bvh, BvhError> {
    let positions = &scene.geometry.positions;
    let corner = |vertex: u32| positions[vertex as usize];
    let triangles: Vec<[Vec3; 3]> = scene
        .geometry
        .triangles
        .iter()
        .map(|t| t.vertices.map(corner))
        .collect();
    raytree_bvh::build(&triangles, preset)
}
