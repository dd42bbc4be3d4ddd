//! KHR_lights_punctual.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;
use serde_json::Value;

use super::document::{Document, index, number, numbers};
use super::error::{Fault, Outcome, Warnings};
use super::node::PlacedNode;
use crate::model::{Frame, Light, LightKind};

/// The lights of the scene's nodes.
pub(super) fn load(
    document: &Document,
    nodes: &[PlacedNode],
    frame: &Frame,
    warnings: &mut Warnings,
) -> Outcome<Vec<Light>> {
    let mut lights = Vec::new();
    for node in nodes {
        let json = &document.elements("nodes")[node.index];
        if let Some(light) = json.pointer("/extensions/KHR_lights_punctual") {
            lights.extend(load_one(document, node, light, frame, warnings)?);
        }
    }
    Ok(lights)
}

fn load_one(
    document: &Document,
    node: &PlacedNode,
    reference: &Value,
    frame: &Frame,
    warnings: &mut Warnings,
) -> Outcome<Option<Light>> {
    let node_place = document.place("nodes", node.index);
    let list = document
        .json()
        .pointer("/extensions/KHR_lights_punctual/lights")
        .and_then(Value::as_array);
    let index = index(reference, "light");
    let Some((index, json)) = index.and_then(|index| Some((index, list?.get(index)?))) else {
        return Err(Fault::invalid(
            node_place,
            "names a light that is not there",
        ));
    };
    let given_name = json
        .get("name")
        .and_then(Value::as_str)
        .filter(|name| !name.is_empty());
    let name = given_name.map_or_else(|| format!("light {index}"), str::to_owned);
    let place = given_name.map_or_else(
        || format!("light {index}"),
        |name| format!("light {index} '{name}'"),
    );

    let color = numbers(json, "color", &place)?.map_or(DVec3::ONE, DVec3::from_array);
    let intensity = color * number(json, "intensity", &place)?.unwrap_or(1.0);
    // In single precision it has to be finite too.
    let largest = f64::from(f32::MAX);
    if !(intensity.min_element() >= 0.0 && intensity.max_element() <= largest) {
        return Err(Fault::invalid(
            place,
            format!("its colour times its intensity must be within 0 and {largest:e}"),
        ));
    }
    let range = match number(json, "range", &place)? {
        None => f64::INFINITY,
        Some(range) if range > 0.0 => range * frame.scale,
        Some(range) => {
            return Err(Fault::invalid(
                place,
                format!("range is {range}, but must be above 0"),
            ));
        }
    };
    // Lights shine along -z; the node's scale leaves range and intensity alone.
    let direction = (-node.world.linear.z_axis).normalize_or_zero();
    let position = frame.to_scene(node.world.translation);
    let kind = match json.get("type").and_then(Value::as_str) {
        Some("directional") => LightKind::Directional { direction },
        Some("point") => LightKind::Point { position, range },
        Some("spot") => {
            let (inner_cone_angle, outer_cone_angle) = cone(json, &place)?;
            LightKind::Spot {
                position,
                direction,
                range,
                inner_cone_angle,
                outer_cone_angle,
            }
        }
        _ => {
            return Err(Fault::invalid(
                place,
                "its type is not one of directional, point, spot",
            ));
        }
    };
    if direction == DVec3::ZERO && !matches!(kind, LightKind::Point { .. }) {
        warnings.push(
            node_place,
            "its scale is zero, so its light shines nowhere and is left out",
        );
        return Ok(None);
    }
    let intensity = match kind {
        LightKind::Directional { .. } => intensity,
        // Squared distances shrink by the square of the scale.
        _ => intensity * frame.scale * frame.scale,
    };
    Ok(Some(Light {
        name,
        kind,
        intensity,
    }))
}

/// Inner and outer angle of a spot.
fn cone(json: &Value, place: &str) -> Outcome<(f64, f64)> {
    let spot = json.get("spot").unwrap_or(&Value::Null);
    let inner = number(spot, "innerConeAngle", place)?.unwrap_or(0.0);
    let mut outer = number(spot, "outerConeAngle", place)?.unwrap_or(FRAC_PI_4);
    // A right angle written in single precision is a little more than one.
    if outer > FRAC_PI_2 && outer as f32 <= FRAC_PI_2 as f32 {
        outer = FRAC_PI_2;
    }
    if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
        let problem =
            format!("its cone angles {inner} and {outer} are not 0 <= inner < outer <= pi/2");
        return Err(Fault::invalid(place, problem));
    }
    Ok((inner, outer))
}
