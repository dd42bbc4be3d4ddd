//! Scene space: where its origin lies, and its unit.

use glam::DVec3;

use super::document::{Document, index};
use super::error::{Fault, Outcome};
use super::geometry::{self, Instance};
use super::node::PlacedNode;
use crate::model::Frame;
use crate::place::Place;

/// The frame of the scene: see [`Frame`]. Refuses extents at which lengths or intensities in scene space would leave the range
/// of f32.
pub(super) fn of_scene(
    document: &Document,
    nodes: &[PlacedNode],
    instances: &[Instance<'_>],
) -> Outcome<Frame> {
    // Somewhere in the scene, so that coordinates from there on need f64 only.
    let Some(near) = instances.first().map(|first| first.world.translation) else {
        return Ok(Frame::default());
    };
    let (min, max) = geometry::bounds_from(near, instances);
    if min.cmpgt(max).any() {
        return Ok(Frame::default());
    }
    let extent = (max - min).max_element();
    check_size(near, min, max, extent)?;
    let has_camera =
        |node: &&PlacedNode| index(&document.elements("nodes")[node.index], "camera").is_some();
    let origin = match nodes.iter().find(has_camera) {
        Some(node) if is_narrow(document, node, extent) => looked_at(instances, node),
        Some(_) | None => None,
    };
    let origin = origin.unwrap_or_else(|| match nodes.iter().find(has_camera) {
        Some(node) => nearest_in_box(near, min, max, node.world.translation),
        // Halves first: the sum of two large coordinates may overflow.
        None => near.moved(min * 0.5 + max * 0.5),
    });
    Ok(Frame::new(origin, extent))
}

/// Does the node's camera see no more than one spot? Then what it looks at is of one distance, and f32's roundings, seen from
/// the camera as an angle of 1e-7 wherever the camera is the origin, would show.
fn is_narrow(document: &Document, node: &PlacedNode, extent: f64) -> bool {
    /// Radians of a field of view, and extents of a parallel view's half height.
    const NARROW: f64 = 1e-3;
    let camera = index(&document.elements("nodes")[node.index], "camera");
    let lens = camera.and_then(|camera| document.elements("cameras").get(camera));
    let size = |pointer: &str| lens?.pointer(pointer)?.as_f64();
    size("/perspective/yfov").is_some_and(|yfov| yfov < NARROW)
        || size("/orthographic/ymag").is_some_and(|ymag| ymag < NARROW * extent)
}

/// The first point of a triangle on the axis of the node's camera (Moeller and Trumbore 1997).
fn looked_at(instances: &[Instance<'_>], node: &PlacedNode) -> Option<Place> {
    let (eye, forward) = (node.world.translation, -node.world.linear.z_axis);
    let forward = forward.normalize_or_zero();
    let distances = instances.iter().flat_map(|instance| {
        let offset = instance.world.translation.since(eye);
        let vertex = move |index: u32| {
            instance.world.linear * instance.primitive.positions[index as usize] + offset
        };
        let triangles = instance.primitive.triangles.iter();
        triangles.filter_map(move |triangle| distance_to(forward, triangle.map(vertex)))
    });
    let nearest = distances.reduce(f64::min)?;
    Some(eye.moved(nearest * forward))
}

/// Along the unit vector `forward` from the origin to the triangle.
fn distance_to(forward: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = forward.cross(e2);
    let determinant = e1.dot(p);
    let q = (-a).cross(e1);
    let (u, v) = (-a.dot(p) / determinant, forward.dot(q) / determinant);
    let t = e2.dot(q) / determinant;
    // All false where the determinant is 0.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t.is_finite()).then_some(t)
}

/// The point nearest to `to` of the box that lies from `near + min` to `near + max`.
fn nearest_in_box(near: Place, min: DVec3, max: DVec3, to: Place) -> Place {
    let from_near = to.since(near);
    // Of a coordinate that is inside no bit is lost: a camera within the box is the origin exactly, one in a corner of it too,
    // whatever side of it rounding puts it.
    let slack = 1e-12 * (max - min).max_element();
    let inside = from_near.cmpge(min - slack) & from_near.cmple(max + slack);
    Place::select(inside, to, near.moved(from_near.clamp(min, max)))
}

fn check_size(near: Place, min: DVec3, max: DVec3, extent: f64) -> Outcome<()> {
    const SMALLEST: f64 = 1e-15;
    const LARGEST: f64 = 1e18;
    let corner = |offset| near.moved(offset).rounded().abs();
    let farthest = corner(min).max(corner(max)).max_element();
    if farthest <= LARGEST && extent >= SMALLEST {
        return Ok(());
    }
    let problem = format!(
        "it is {extent:e} m large and reaches to {farthest:e} m; scale it to within {SMALLEST:e} and {LARGEST:e} m"
    );
    Err(Fault::limit("the scene", problem))
}
