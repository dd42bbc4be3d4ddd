//! From the meshes' own spaces into scene space: every instance of every primitive becomes triangles in their place.

use std::collections::HashMap;

use glam::{DMat3, DVec3, Vec3, Vec4};

use super::node::Transform;
use super::primitive::{Dropped, Primitive};
use crate::instances::{Blocks, EMPTY, normal_matrix, placed_tangent};
use crate::model::{Frame, Geometry, Triangle};
use crate::parallel::mapped;
use crate::place::Place;

/// A primitive where a node puts it.
#[derive(Clone, Copy)]
pub(super) struct Instance<'a> {
    pub(super) primitive: &'a Primitive,
    pub(super) world: Transform,
    /// Index into the scene's materials.
    pub(super) material: u32,
    /// Index into the scene's nodes.
    pub(super) node: u32,
}

/// The box around all triangles, (min, max), world space but from `origin` on; empty boxes have min above max.
pub(super) fn bounds_from(origin: Place, instances: &[Instance<'_>]) -> (DVec3, DVec3) {
    let empty = EMPTY;
    let blocks = blocks_of_repeated(instances);
    let around = |instance: &Instance<'_>| {
        let world = &instance.world;
        let offset = world.translation.since(origin);
        if let Some(blocks) = blocks.get(&std::ptr::from_ref(instance.primitive)) {
            return blocks.bounds(&world.linear, offset);
        }
        let points = instance
            .primitive
            .positions
            .iter()
            .map(|&point| world.linear * point + offset);
        points.fold(empty, |(min, max), point| (min.min(point), max.max(point)))
    };
    // What a scale of zero has shrunk to a point has no triangles.
    let boxes = instances.iter().map(around).filter(|(min, max)| min != max);
    boxes.fold(empty, |(min, max), (low, high)| {
        (min.min(low), max.max(high))
    })
}

/// For primitives that are shown so often that a look at all of their points each time would take long.
fn blocks_of_repeated<'a>(instances: &[Instance<'a>]) -> HashMap<*const Primitive, Blocks<'a>> {
    const OFTEN: usize = 4;
    let mut uses = HashMap::new();
    for instance in instances {
        let place = std::ptr::from_ref(instance.primitive);
        uses.entry(place).or_insert((instance.primitive, 0)).1 += 1;
    }
    uses.into_iter()
        .filter(|(_, (_, count))| *count >= OFTEN)
        .map(|(place, (primitive, _))| (place, Blocks::of(&primitive.positions)))
        .collect()
}

/// Which optional attributes the scene has.
pub(super) struct Layout {
    pub(super) uv_sets: usize,
    pub(super) tangents: bool,
    pub(super) colors: bool,
}

/// Puts all instances into one geometry, but those that `shared` names. Also returns how many triangles were left out.
pub(super) fn assemble(
    instances: &[Instance<'_>],
    shared: &[bool],
    frame: &Frame,
    layout: &Layout,
) -> (Geometry, Dropped) {
    let mut geometry = Geometry {
        uv_sets: vec![Vec::new(); layout.uv_sets],
        ..Geometry::default()
    };
    let mut dropped = Dropped::default();
    for (instance, _) in instances.iter().zip(shared).filter(|(_, shared)| !**shared) {
        dropped += append(&mut geometry, instance, frame, layout);
    }
    (geometry, dropped)
}

pub(super) fn append(
    geometry: &mut Geometry,
    instance: &Instance<'_>,
    frame: &Frame,
    layout: &Layout,
) -> Dropped {
    let Instance {
        primitive,
        world,
        material,
        node,
    } = instance;
    let first_vertex = geometry.positions.len();
    let first_triangle = geometry.triangles.len();
    let offset = world.translation.since(frame.origin);
    let to_scene = |point: &DVec3| {
        let DMat3 {
            x_axis,
            y_axis,
            z_axis,
        } = world.linear;
        let steps = [offset, x_axis * point.x, y_axis * point.y, z_axis * point.z];
        frame.to_scene_by(steps).as_vec3()
    };
    geometry
        .positions
        .append(&mut mapped(&primitive.positions, to_scene));

    let mirrored = world.linear.determinant() < 0.0;
    let placed = |&[a, b, c]: &[u32; 3]| {
        let vertices = if mirrored { [a, c, b] } else { [a, b, c] };
        Triangle {
            vertices: vertices.map(|vertex| first_vertex as u32 + vertex),
            material: *material,
            node: *node,
        }
    };
    let positions = &geometry.positions;
    let seen = mapped(&primitive.triangles, |triangle| {
        has_area(positions, &placed(triangle))
    });
    let triangles = primitive.triangles.iter().zip(seen);
    let seen = triangles.filter(|(_, seen)| *seen);
    let placed = seen.map(|(triangle, _)| placed(triangle));
    geometry.triangles.extend(placed);
    let kept = geometry.triangles.len() - first_triangle;
    let mut dropped = primitive.dropped;
    dropped.no_area += primitive.triangles.len() - kept;
    if kept == 0 {
        geometry.positions.truncate(first_vertex);
        return dropped;
    }

    append_normals(geometry, instance, first_triangle);
    let count = primitive.positions.len();
    if layout.tangents {
        append_tangents(geometry, instance, mirrored);
    }
    for (set, values) in geometry.uv_sets.iter_mut().zip(&primitive.uv_sets) {
        set.extend_from_slice(values);
        debug_assert_eq!(set.len(), first_vertex + count);
    }
    if layout.colors {
        extend_or_fill(&mut geometry.colors, &primitive.colors, count, Vec4::ONE);
    }
    dropped
}

fn extend_or_fill<T: Copy>(list: &mut Vec<T>, values: &[T], count: usize, missing: T) {
    if values.is_empty() {
        list.extend(std::iter::repeat_n(missing, count))
    } else {
        list.extend_from_slice(values)
    }
}

/// Does any ray hit it? The area has to be more than nothing in f32, which the device computes in.
fn has_area(positions: &[Vec3], triangle: &Triangle) -> bool {
    area_normal(positions, triangle).abs().max_element() >= f64::from(f32::MIN_POSITIVE)
}

/// Twice the triangle's area along its normal, scene space; zero if in scene space's f32 the corners lie on a line.
fn area_normal(positions: &[Vec3], triangle: &Triangle) -> DVec3 {
    let [a, b, c] = triangle
        .vertices
        .map(|vertex| positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// The vertices' normals, moved into scene space; where there is none, that of a triangle at the vertex.
fn append_normals(geometry: &mut Geometry, instance: &Instance<'_>, first_triangle: usize) {
    let first_vertex = geometry.normals.len();
    let count = instance.primitive.positions.len();
    if instance.primitive.normals.is_empty() {
        geometry.normals.resize(first_vertex + count, Vec3::ZERO);
    } else {
        let matrix = normal_matrix(&instance.world.linear);
        geometry
            .normals
            .append(&mut mapped(&instance.primitive.normals, |normal| {
                (matrix * normal.as_dvec3()).normalize_or_zero().as_vec3()
            }));
    }
    if !geometry.normals[first_vertex..].contains(&Vec3::ZERO) {
        return;
    }
    let triangles = &geometry.triangles[first_triangle..];
    let own = mapped(triangles, |triangle| {
        let normal = area_normal(&geometry.positions, triangle).normalize();
        normal.as_vec3()
    });
    for (triangle, own) in triangles.iter().zip(own) {
        for vertex in triangle.vertices {
            let normal = &mut geometry.normals[vertex as usize];
            if *normal == Vec3::ZERO {
                *normal = own;
            }
        }
    }
    // Vertices of dropped triangles alone: nothing reads them, but they are normals too.
    geometry.normals[first_vertex..]
        .iter_mut()
        .filter(|normal| **normal == Vec3::ZERO)
        .for_each(|normal| *normal = Vec3::Z);
}

/// Mirroring turns the bitangent's side around.
fn append_tangents(geometry: &mut Geometry, instance: &Instance<'_>, mirrored: bool) {
    let first_vertex = geometry.tangents.len();
    let count = instance.primitive.positions.len();
    if instance.primitive.tangents.is_empty() {
        // Nothing reads these.
        geometry
            .tangents
            .resize(first_vertex + count, Vec4::new(1.0, 0.0, 0.0, 1.0));
        return;
    }
    for (tangent, normal) in instance
        .primitive
        .tangents
        .iter()
        .zip(&geometry.normals[first_vertex..])
    {
        let moved = placed_tangent(&instance.world.linear, mirrored, *tangent, *normal);
        geometry.tangents.push(moved);
    }
}
