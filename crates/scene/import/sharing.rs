//! Which nodes share the memory of their mesh.
//!
//! A copy costs memory and time before the first ray, a shared mesh costs each ray that comes near it a way to and fro: whether it
//! pays is told by how many triangles are saved (`ARCHITECTURE.md`, "Shared meshes", has the figures).

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::document::Document;
use super::error::Outcome;
use super::geometry::{self, Instance, Layout};
use super::node::Transform;
use super::primitive::Dropped;
use super::{ImportOptions, Use};
use crate::features::{transmits, whitted_transmits};
use crate::instances::{
    Blocks, EMPTY, Instance as SceneInstance, Placement, RepeatedMesh, SharedMesh, WhyCopied,
};
use crate::model::{AlphaMode, Frame, Geometry, Material};
use crate::place::Place;

/// Whether nodes may share the memory of their mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sharing {
    /// Where that saves more than it costs.
    #[default]
    WhereItPays,
    /// Each node has a copy.
    Never,
    /// Wherever it can be done: for tests and measurements.
    Always,
}

/// How many triangles copies of a mesh have to take beyond the first for sharing to pay: they are a second and 170 MiB, more than rays
/// lose in a picture of 16 samples.
const LEAST_SAVED: usize = 1 << 20;

/// A place of a mesh takes as much memory as four triangles; of fewer than these nothing was measured.
const LEAST_TRIANGLES: usize = 16;

/// Triangles that are seen have numbers of 32 bits, of which one means none.
const MOST_SEEN: u64 = u32::MAX as u64 - 1;

/// By how much more a node may stretch a mesh along one axis than along another: normals are computed on the device, and lose that
/// much of their precision.
const MOST_STRETCHED: f64 = 16.0;

/// .. and how small a mesh may become, in scene space: rays are brought to its space in f32.
const SMALLEST: f64 = 1e-9;

/// What is to be shared.
pub(super) struct Plan {
    /// For each use, whether it is an instance of a shared mesh.
    pub(super) shared: Vec<bool>,
    /// Uses of each shared mesh, in the order of the file; a node's primitives follow each other.
    meshes: BTreeMap<usize, Vec<usize>>,
    pub(super) repeated: Vec<RepeatedMesh>,
}

impl Plan {
    pub(super) fn new(
        document: &Document,
        uses: &[Use<'_>],
        instances: &[Instance<'_>],
        materials: &[Material],
        frame: &Frame,
        sharing: Sharing,
    ) -> Self {
        let mut by_mesh: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (number, used) in uses.iter().enumerate() {
            by_mesh.entry(used.mesh).or_default().push(number);
        }
        let mut plan = Self {
            shared: vec![false; uses.len()],
            meshes: BTreeMap::new(),
            repeated: Vec::new(),
        };
        for (mesh, uses_of_mesh) in by_mesh {
            let first_node = uses[uses_of_mesh[0]].node.index;
            let primitives: Vec<usize> = uses_of_mesh
                .iter()
                .copied()
                .take_while(|&k| uses[k].node.index == first_node)
                .collect();
            let nodes = uses_of_mesh.len() / primitives.len();
            if nodes < 2 {
                continue;
            }
            let triangles: usize = primitives
                .iter()
                .map(|&k| instances[k].primitive.triangles.len())
                .sum();
            let seen_through = primitives
                .iter()
                .any(|&k| !is_plain(&materials[instances[k].material as usize]));
            let extent = extent(primitives.iter().map(|&k| &instances[k])) * frame.scale;
            let placeable: Vec<usize> = uses_of_mesh
                .iter()
                .copied()
                .filter(|&k| is_placeable(&instances[k].world, extent))
                .collect();
            let sharers = placeable.len() / primitives.len();
            let pays = triangles >= LEAST_TRIANGLES
                && triangles.saturating_mul(sharers.saturating_sub(1)) >= LEAST_SAVED;
            let obstacle = match sharing {
                Sharing::Never => Some(WhyCopied::Asked),
                _ if seen_through => Some(WhyCopied::SeenThrough),
                _ if sharers < 2 || triangles == 0 => Some(WhyCopied::Placement),
                Sharing::WhereItPays if !pays => Some(WhyCopied::Small),
                _ => None,
            };
            let some_copied = (sharers < nodes).then_some(WhyCopied::Placement);
            plan.repeated.push(RepeatedMesh {
                name: document
                    .name("meshes", mesh)
                    .map_or_else(|| document.number("meshes", mesh), str::to_owned),
                nodes,
                triangles,
                sharing: if obstacle.is_none() { sharers } else { 0 },
                copied: obstacle.or(some_copied),
            });
            if obstacle.is_none() {
                for &k in &placeable {
                    plan.shared[k] = true;
                }
                plan.meshes.insert(mesh, placeable);
            }
        }
        plan
    }

    /// Refuses a scene of too many triangles: those that are stored, and, since each that is seen has a number of 32 bits, all.
    pub(super) fn check(
        &self,
        document: &Document,
        uses: &[Use<'_>],
        instances: &[Instance<'_>],
        options: &ImportOptions,
    ) -> Outcome<()> {
        let (mut stored, mut seen) = (0_u64, 0_u64);
        let first_of: BTreeMap<usize, usize> = self
            .meshes
            .iter()
            .map(|(&mesh, uses_of_mesh)| (mesh, uses[uses_of_mesh[0]].node.index))
            .collect();
        for (k, used) in uses.iter().enumerate() {
            let triangles = instances[k].primitive.triangles.len() as u64;
            seen += triangles;
            if !self.shared[k] || first_of[&used.mesh] == used.node.index {
                stored += triangles;
            }
            let too_many = |limit| super::too_many_triangles(document, used.node.index, limit);
            if stored > options.max_triangles {
                return Err(too_many(options.max_triangles));
            }
            if seen > MOST_SEEN {
                return Err(too_many(MOST_SEEN));
            }
        }
        Ok(())
    }

    /// Adds each shared mesh to the geometry, behind all copies.
    pub(super) fn assemble(
        &self,
        document: &Document,
        (uses, instances): (&[Use<'_>], &[Instance<'_>]),
        frame: &Frame,
        layout: &Layout,
        geometry: &mut Geometry,
    ) -> (Vec<SharedMesh>, Vec<SceneInstance>, Dropped) {
        let (mut meshes, mut placed) = (Vec::new(), Vec::new());
        let mut dropped = Dropped::default();
        for (&mesh, uses_of_mesh) in &self.meshes {
            let node = |k: usize| uses[k].node.index;
            let first = uses_of_mesh[0];
            let of_first = || uses_of_mesh.iter().take_while(|&&k| node(k) == node(first));
            let sharers: Vec<usize> = uses_of_mesh
                .chunk_by(|&a, &b| node(a) == node(b))
                .map(|uses_of_node| uses_of_node[0])
                .collect();
            let points = of_first().flat_map(|&k| instances[k].primitive.positions.iter());
            let (min, max) = points.fold(EMPTY, |(min, max), &p| (min.min(p), max.max(p)));
            let (middle, extent) = (0.5 * min + 0.5 * max, (max - min).max_element());
            let own = Frame::new(Place::from(middle), extent);
            let start = (geometry.triangles.len(), geometry.positions.len());
            for &k in of_first() {
                let still = Instance {
                    world: Transform::IDENTITY,
                    node: 0,
                    ..instances[k]
                };
                let left_out = geometry::append(geometry, &still, &own, layout);
                for _ in &sharers {
                    dropped += left_out;
                }
            }
            let end = (geometry.triangles.len(), geometry.positions.len());
            if start.0 == end.0 {
                continue;
            }
            let points: Vec<DVec3> = geometry.positions[start.1..]
                .iter()
                .map(|point| point.as_dvec3())
                .collect();
            let blocks = Blocks::of(&points);
            for k in sharers {
                let placement = placement(&instances[k].world, middle, own.scale, frame);
                placed.push(SceneInstance {
                    mesh: meshes.len() as u32,
                    node: instances[k].node,
                    bounds: blocks.bounds(&placement.linear, placement.translation),
                    placement,
                });
            }
            meshes.push(SharedMesh {
                name: document
                    .name("meshes", mesh)
                    .map_or_else(|| document.number("meshes", mesh), str::to_owned),
                triangles: start.0 as u32..end.0 as u32,
                vertices: start.1 as u32..end.1 as u32,
            });
        }
        (meshes, placed, dropped)
    }
}

/// From a mesh's own space, whose origin lies in `middle` and whose unit is `1 / scale`, into scene space.
fn placement(world: &Transform, middle: DVec3, scale: f64, frame: &Frame) -> Placement {
    let DMat3 {
        x_axis,
        y_axis,
        z_axis,
    } = world.linear;
    let steps = [
        world.translation.since(frame.origin),
        x_axis * middle.x,
        y_axis * middle.y,
        z_axis * middle.z,
    ];
    Placement {
        linear: world.linear * (frame.scale / scale),
        translation: frame.to_scene_by(steps),
    }
}

/// Light neither passes it nor sees holes in it: rays that meet it never have to remember where they met it.
fn is_plain(material: &Material) -> bool {
    material.alpha_mode == AlphaMode::Opaque
        && material.volume.is_none()
        && !transmits(material)
        && material.transmission == 0.0
        && !whitted_transmits(material)
}

/// Neither singular nor stretched or shrunk too far. `extent`: of the mesh, in units of the scene.
fn is_placeable(world: &Transform, extent: f64) -> bool {
    let (least, most) = stretches(&world.linear);
    most * extent > SMALLEST && most.is_finite() && most <= MOST_STRETCHED * least
}

/// The longest side of the box around a mesh, in its own space.
fn extent<'a>(primitives: impl Iterator<Item = &'a Instance<'a>>) -> f64 {
    let points = primitives.flat_map(|instance| &instance.primitive.positions);
    let (min, max) = points.fold(EMPTY, |(min, max), &p| (min.min(p), max.max(p)));
    (max - min).max_element()
}

/// By how much a map stretches at least and at most: bounds of its singular values, of the square roots of the eigenvalues of its
/// Gram matrix (Smith 1961, "Eigenvalues of a symmetric 3 x 3 matrix").
fn stretches(linear: &DMat3) -> (f64, f64) {
    let largest = linear
        .to_cols_array()
        .into_iter()
        .fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return (0.0, largest);
    }
    let scaled = *linear * largest.recip();
    let gram = scaled.transpose() * scaled;
    let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - DMat3::from_diagonal(DVec3::splat(mean));
    let columns = [rest.x_axis, rest.y_axis, rest.z_axis];
    let spread = (columns.map(DVec3::length_squared).iter().sum::<f64>() / 6.0).sqrt();
    if spread <= 1e-15 * mean {
        return (largest * mean.sqrt(), largest * mean.sqrt());
    }
    let half = (0.5 * (rest * spread.recip()).determinant()).clamp(-1.0, 1.0);
    let angle = half.acos() / 3.0;
    let value = |turn: f64| {
        let turned = angle + turn * 2.0 * std::f64::consts::PI / 3.0;
        (mean + 2.0 * spread * turned.cos()).max(0.0).sqrt()
    };
    (largest * value(1.0), largest * value(0.0))
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;

    #[test]
    fn a_map_stretches_by_its_singular_values() {
        let turn = |x: f64, y: f64| {
            DMat3::from_quat(DQuat::from_rotation_x(x) * DQuat::from_rotation_y(y))
        };
        for sides in [
            [1.0, 1.0, 1.0],
            [3.0, -2.0, 0.5],
            [1e-6, 1e-6, 2e-6],
            [1e9, 1e9, 0.0],
        ] {
            let linear =
                turn(0.3, 1.1) * DMat3::from_diagonal(DVec3::from(sides)) * turn(-0.7, 0.4);
            let sizes = sides.map(f64::abs);
            let expected = sizes
                .iter()
                .fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), &s| {
                    (least.min(s), most.max(s))
                });
            let (least, most) = stretches(&linear);
            assert!(
                (least - expected.0).abs() < 1e-7 * expected.1,
                "{sides:?}: {least}"
            );
            assert!(
                (most - expected.1).abs() < 1e-7 * expected.1,
                "{sides:?}: {most}"
            );
        }
        assert_eq!(stretches(&DMat3::ZERO), (0.0, 0.0));
    }
}
