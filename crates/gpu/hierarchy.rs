//! Where a scene's triangles are, for the room that knows no scenes.

use glam::{DMat3, DVec3, Vec3};
use raytree_bvh::{Bvh, BvhError, Placed, Preset};
use raytree_scene::{instances::Instance, model::Scene};

/// The hierarchy of a scene's triangles.
///
/// # Errors
/// [`BvhError`] if the scene has too many.
pub fn build_bvh(scene: &Scene, preset: Preset) -> Result<Bvh, BvhError> {
    let positions = &scene.geometry.positions;
    let triangles = &scene.geometry.triangles;
    let corners = |index: usize| triangles[index].vertices.map(|v| positions[v as usize]);
    if scene.instances.is_empty() {
        return raytree_bvh::build_of(triangles.len(), corners, preset);
    }
    let meshes: Vec<_> = scene
        .meshes
        .iter()
        .map(|mesh| mesh.triangles.clone())
        .collect();
    let instances: Vec<_> = scene.instances.iter().map(bounds_on_device).collect();
    let placed = Placed {
        own: scene.own_triangles(),
        meshes: &meshes,
        instances: &instances,
    };
    raytree_bvh::build_instanced(placed, corners, preset)
}

/// A box around what the device makes of an instance: its corners are up to 5 roundings of what the mesh spans and one of where it
/// is off the exact ones (`placed_point` in `shaders/instances.wgsl`), and the box's own are rounded.
fn bounds_on_device(instance: &Instance) -> (Vec3, Vec3) {
    const ROUNDING: f64 = f32::EPSILON as f64;
    let (min, max) = instance.bounds;
    let slack = 4.0 * ROUNDING * (min.abs().max(max.abs()) + half_sides(instance));
    ((min - slack).as_vec3(), (max + slack).as_vec3())
}

/// Half the sides of the box around a mesh, brought to scene space with signs that don't cancel.
pub(crate) fn half_sides(instance: &Instance) -> DVec3 {
    let DMat3 {
        x_axis,
        y_axis,
        z_axis,
    } = instance.placement.linear;
    0.5 * (x_axis.abs() + y_axis.abs() + z_axis.abs())
}
