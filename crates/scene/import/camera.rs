//! Cameras (glTF 2.0, 3.10).

use std::f64::consts::PI;

use serde_json::Value;

use super::document::{Document, index, number};
use super::error::{Fault, Outcome, Warnings};
use super::node::PlacedNode;
use crate::model::{Camera, Frame, Projection};

/// The cameras of the scene's nodes.
pub(super) fn load(
    document: &Document,
    nodes: &[PlacedNode],
    frame: &Frame,
    warnings: &mut Warnings,
) -> Outcome<Vec<Camera>> {
    let mut cameras = Vec::new();
    for node in nodes {
        let Some(camera) = index(&document.elements("nodes")[node.index], "camera") else {
            continue;
        };
        let projection = projection(document, camera, frame)?;
        let name = document
            .name("nodes", node.index)
            .or_else(|| document.name("cameras", camera));
        let name = name.map_or_else(|| document.number("cameras", camera), str::to_owned);
        cameras.extend(place_camera(
            document, node, frame, name, projection, warnings,
        ));
    }
    Ok(cameras)
}

/// Scale and shear of the node do not count (3.10.2): the axes are made orthonormal, first where the camera looks.
fn place_camera(
    document: &Document,
    node: &PlacedNode,
    frame: &Frame,
    name: String,
    projection: Projection,
    warnings: &mut Warnings,
) -> Option<Camera> {
    let place = document.place("nodes", node.index);
    let axes = node.world.linear;
    let forward = -axes.z_axis.normalize_or_zero();
    let up = axes.y_axis.normalize_or_zero();
    let up = (up - up.dot(forward) * forward).normalize_or_zero();
    let right = forward.cross(up);
    if !right.is_normalized() {
        warnings.push(
            place,
            "its scale is zero, so its camera looks nowhere and is left out",
        );
        return None;
    }
    if axes.determinant() < 0.0 {
        warnings.push(
            place,
            "it mirrors its camera, whose picture is not mirrored here",
        );
    }
    Some(Camera {
        name,
        position: frame.to_scene(node.world.translation),
        right,
        up,
        forward,
        projection,
    })
}

fn projection(document: &Document, camera: usize, frame: &Frame) -> Outcome<Projection> {
    let json = &document.elements("cameras")[camera];
    let place = document.place("cameras", camera);
    let kind = json.get("type").and_then(Value::as_str);
    let (Some(kind @ ("perspective" | "orthographic")), Some(lens)) =
        (kind, kind.and_then(|kind| json.get(kind)))
    else {
        return Err(Fault::invalid(
            place,
            "is neither a perspective nor an orthographic camera",
        ));
    };
    let field = |name: &str, limit: f64| match number(lens, name, &place)? {
        Some(value) if value > 0.0 && value < limit => Ok(Some(value)),
        Some(value) => Err(Fault::invalid(
            &place,
            format!("{name} is {value}, but must be above 0 and below {limit}"),
        )),
        None => Ok(None),
    };
    let required = |name: &str, limit: f64| {
        field(name, limit)?.ok_or_else(|| Fault::invalid(&place, format!("{name} is missing")))
    };
    Ok(match kind {
        "perspective" => Projection::Perspective {
            yfov: required("yfov", PI)?,
            aspect: field("aspectRatio", f64::INFINITY)?,
        },
        _ => Projection::Orthographic {
            xmag: required("xmag", f64::INFINITY)? * frame.scale,
            ymag: required("ymag", f64::INFINITY)? * frame.scale,
        },
    })
}
