//! Places of shared meshes as the shaders read them (`shaders/instances.wgsl`).

use glam::{DMat3, DVec3, Vec3};
use raytree_bvh::Bvh;
use raytree_scene::{
    instances::{Instance, Placement},
    model::Scene,
};

use crate::hierarchy::half_sides;

/// Texels of an instance; `INSTANCE_WORDS` in `shaders/instances.wgsl`.
pub(crate) const INSTANCE_WORDS: usize = 10;

/// An instance's texels.
pub(crate) type InstanceRecord = [u32; 4 * INSTANCE_WORDS];

/// Instead of a unit normal's x: an entry of `leaf_vertices` that is an instance. `INSTANCE_NORMAL` in `shaders/instances.wgsl`.
pub(crate) const INSTANCE_NORMAL: f32 = 2.0;

/// Instances that a stacked item can name, beside one bit for none.
pub(crate) const MOST_INSTANCES: usize = (1 << 28) - 1;

/// An entry of `leaf_vertices` that stands for an instance.
pub(crate) fn leaf(instance: u32) -> [u32; 12] {
    let mut words = [0; 12];
    words[0] = instance;
    words[9] = INSTANCE_NORMAL.to_bits();
    words
}

/// The records of a scene's instances.
pub(crate) fn records(scene: &Scene, bvh: &Bvh) -> Vec<InstanceRecord> {
    let numbers = scene.first_numbers();
    let all = scene.instances.iter().zip(numbers);
    all.map(|(instance, number)| record(scene, bvh, instance, number))
        .collect()
}

fn record(scene: &Scene, bvh: &Bvh, instance: &Instance, number: u32) -> InstanceRecord {
    let Placement {
        linear,
        translation,
    } = instance.placement;
    let mesh = instance.mesh as usize;
    // A triangle of the mesh has its entry's number, counted from the mesh's first triangle.
    let first = number.wrapping_sub(scene.meshes[mesh].triangles.start);
    let high = translation.as_vec3();
    let low = (translation - high.as_dvec3()).as_vec3();
    let inverse = linear.inverse();
    let normals = scaled(instance.placement.normal_matrix());
    let half = half_sides(instance).as_vec3();
    let flags = instance.node << 1 | u32::from(instance.placement.mirrors());
    let float = f32::to_bits;
    let texels: [(Vec3, u32); INSTANCE_WORDS] = [
        (row(&linear, 0), float(high.x)),
        (row(&linear, 1), float(high.y)),
        (row(&linear, 2), float(high.z)),
        (low, float(slant(&normals))),
        (row(&inverse, 0), flags),
        (row(&inverse, 1), first),
        (row(&inverse, 2), bvh.meshes[mesh].node),
        (row(&normals, 0), float(half.x)),
        (row(&normals, 1), float(half.y)),
        (row(&normals, 2), float(half.z)),
    ];
    let words = texels.map(|(vector, word)| {
        let [x, y, z] = vector.to_array().map(f32::to_bits);
        [x, y, z, word]
    });
    bytemuck::cast(words)
}

fn row(matrix: &DMat3, which: usize) -> Vec3 {
    matrix.row(which).as_vec3()
}

/// The largest entry is 1: lengths of vectors count for nothing.
fn scaled(matrix: DMat3) -> DMat3 {
    let entries = matrix.to_cols_array().into_iter();
    let largest = entries.fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    matrix * largest.recip()
}

/// How far a unit vector that is multiplied by this matrix in f32 may be turned, radians: 4 roundings of each product (the entry's, the
/// vector's, the product's and the sum's), in relation to the shortest vector that may come of it.
fn slant(matrix: &DMat3) -> f32 {
    let across = DVec3::from_array([0, 1, 2].map(|axis| matrix.row(axis).abs().element_sum()));
    // The columns of the inverse are as long as vectors may become shorter.
    let shrinks = matrix.inverse().to_cols_array();
    let shrinks = shrinks
        .iter()
        .map(|entry| entry * entry)
        .sum::<f64>()
        .sqrt();
    (4.0 * 0.5 * f64::from(f32::EPSILON) * across.length() * shrinks) as f32
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;

    #[test]
    fn a_normal_that_is_stretched_may_be_turned_more() {
        let still = slant(&DMat3::IDENTITY);
        assert!(still > 2e-7 && still < 1e-6, "{still}");
        let stretched = slant(&DMat3::from_diagonal(dvec3(1.0, 1.0, 1.0 / 16.0)));
        assert!(stretched > 4.0 * still && stretched < 32.0 * still);
    }
}
