//! Parts of a scene in JSON and in words. World space, metres: what the user knows from the file.

use glam::{DVec3, Vec3};
use raytree::Camera;
use raytree::model::{AlphaMode, Frame, Light, LightKind, Material, Projection};
use serde_json::{Value, json};

/// Linear red, green, blue.
pub fn color_json(color: Vec3) -> Value {
    json!(color.to_array().map(decimal))
}

/// A coordinate triple.
pub fn point_json(point: DVec3) -> Value {
    json!(point.to_array())
}

/// The number that an f32 was meant to be: 0.1, not 0.10000000149011612.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| value.into())
}

pub fn camera_json(camera: &Camera, frame: &Frame) -> Value {
    let projection = match camera.projection {
        Projection::Perspective { yfov, aspect } => json!({
            "type": "perspective",
            "yfov_degrees": decimal(yfov.to_degrees() as f32),
            "aspect": aspect,
        }),
        Projection::Orthographic { xmag, ymag } => json!({
            "type": "orthographic",
            "xmag": xmag / frame.scale,
            "ymag": ymag / frame.scale,
        }),
    };
    json!({
        "name": camera.name,
        "position": point_json(frame.to_world(camera.position)),
        "forward": point_json(camera.forward),
        "up": point_json(camera.up),
        "projection": projection,
    })
}

pub fn camera_text(camera: &Camera, frame: &Frame) -> String {
    let projection = match camera.projection {
        Projection::Perspective { yfov, aspect: None } => {
            format!("perspective, {} degrees", short(yfov.to_degrees()))
        }
        Projection::Perspective {
            yfov,
            aspect: Some(aspect),
        } => {
            format!(
                "perspective, {} degrees, aspect {}",
                short(yfov.to_degrees()),
                short(aspect)
            )
        }
        Projection::Orthographic { xmag, ymag } => {
            format!(
                "orthographic, {} x {} m",
                short(2.0 * xmag / frame.scale),
                short(2.0 * ymag / frame.scale)
            )
        }
    };
    let (position, forward) = (frame.to_world(camera.position), camera.forward);
    format!(
        "'{}'  {projection}, at {}, towards {}",
        camera.name,
        triple(position),
        triple(forward)
    )
}

/// Intensity as in the file: candela for points and spots, lux for directional lights (radiometric either way).
fn file_intensity(light: &Light, frame: &Frame) -> DVec3 {
    match light.kind {
        LightKind::Directional { .. } => light.intensity,
        _ => light.intensity / (frame.scale * frame.scale),
    }
}

pub fn light_json(light: &Light, frame: &Frame) -> Value {
    let mut object = json!({
        "name": light.name,
        "type": kind_name(&light.kind),
        "intensity": point_json(file_intensity(light, frame)),
    });
    let (position, direction, range) = placement(&light.kind);
    if let Some(position) = position {
        object["position"] = point_json(frame.to_world(position));
        // Null where there is none.
        object["range"] = json!(range / frame.scale);
    }
    if let Some(direction) = direction {
        object["direction"] = point_json(direction);
    }
    if let LightKind::Spot {
        inner_cone_angle,
        outer_cone_angle,
        ..
    } = light.kind
    {
        object["cone_degrees"] =
            json!([inner_cone_angle.to_degrees(), outer_cone_angle.to_degrees()]);
    }
    object
}

pub fn light_text(light: &Light, frame: &Frame) -> String {
    let (position, direction, range) = placement(&light.kind);
    let mut text = format!(
        "'{}'  {}, intensity {}",
        light.name,
        kind_name(&light.kind),
        triple(file_intensity(light, frame))
    );
    if let Some(position) = position {
        text += &format!(", at {}", triple(frame.to_world(position)));
    }
    if let Some(direction) = direction {
        text += &format!(", towards {}", triple(direction));
    }
    if range.is_finite() {
        text += &format!(", range {} m", short(range / frame.scale));
    }
    text
}

fn kind_name(kind: &LightKind) -> &'static str {
    match kind {
        LightKind::Directional { .. } => "directional",
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
    }
}

/// Position, direction and range, as far as the kind has them.
fn placement(kind: &LightKind) -> (Option<DVec3>, Option<DVec3>, f64) {
    match *kind {
        LightKind::Directional { direction } => (None, Some(direction), f64::INFINITY),
        LightKind::Point { position, range } => (Some(position), None, range),
        LightKind::Spot {
            position,
            direction,
            range,
            ..
        } => (Some(position), Some(direction), range),
    }
}

/// What is remarkable about a material.
pub fn traits(material: &Material) -> Vec<String> {
    let mut traits = Vec::new();
    let mut note = |remarkable: bool, text: String| {
        if remarkable {
            traits.push(text);
        }
    };
    let m = material;
    note(m.unlit, "unlit".to_owned());
    note(
        !m.unlit,
        format!("metallic {}, roughness {}", m.metallic, m.roughness),
    );
    match m.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => note(true, format!("mask at {cutoff}")),
        AlphaMode::Blend => note(true, "blend".to_owned()),
    }
    note(m.double_sided, "double-sided".to_owned());
    note(
        m.emissive != Vec3::ZERO,
        format!("emissive {}", triple(m.emissive.as_dvec3())),
    );
    note(
        m.transmission > 0.0,
        format!("transmission {}", m.transmission),
    );
    note(m.ior != Material::default().ior, format!("ior {}", m.ior));
    note(
        m.specular != 1.0 || m.specular_color != Vec3::ONE,
        format!(
            "specular {} {}",
            m.specular,
            triple(m.specular_color.as_dvec3())
        ),
    );
    note(m.volume.is_some(), "solid".to_owned());
    note(
        m.volume
            .is_some_and(|volume| volume.attenuation_distance.is_finite()),
        "absorbs".to_owned(),
    );
    note(m.whitted.is_some(), "whitted coefficients".to_owned());
    let maps = texture_uses(m);
    note(!maps.is_empty(), format!("textures: {}", maps.join(", ")));
    traits
}

fn texture_uses(m: &Material) -> Vec<&'static str> {
    let uses = [
        ("base colour", &m.base_color_texture),
        ("metallic-roughness", &m.metallic_roughness_texture),
        ("normal", &m.normal_texture),
        ("occlusion", &m.occlusion_texture),
        ("emissive", &m.emissive_texture),
        ("transmission", &m.transmission_texture),
        ("specular", &m.specular_texture),
        ("specular colour", &m.specular_color_texture),
    ];
    uses.into_iter()
        .filter_map(|(name, texture)| texture.as_ref().map(|_| name))
        .collect()
}

/// `(x, y, z)`.
pub fn triple(vector: DVec3) -> String {
    let [x, y, z] = vector.to_array().map(short);
    format!("({x}, {y}, {z})")
}

/// Four digits are enough for people.
pub fn short(value: f64) -> String {
    let text = format!("{value:.3e}");
    let rounded: f64 = text.parse().unwrap_or(value);
    // Not "-0".
    let rounded = rounded + 0.0;
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        text
    }
}
