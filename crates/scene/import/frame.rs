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
        Some(node) => nearest_in_box(near, min, max, node.world.translation),
        // Halves first: the sum of two large coordinates may overflow.
        None => near.moved(min * 0.5 + max * 0.5),
    };
    Ok(Frame::new(origin, extent))
}

/// The point nearest to `to` of the box that lies from `near + min` to `near + max`.
fn nearest_in_box(near: Place, min: DVec3, max: DVec3, to: Place) -> Place {
    let from_near = to.since(near);
    let inside = from_near.cmpge(min) & from_near.cmple(max);
    // Of a coordinate that is inside no bit is lost: a camera within the box is the origin exactly.
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
