//! Punctual lights: "Lights" in `shaders/README.md`.

use raytree_scene::model::{Light, LightKind};

use crate::vec::{Rgb, Vec3};

/// Light that would arrive at a point if nothing were in the way.
pub(crate) struct Incident {
    /// Unit, towards the light.
    pub wi: Vec3,
    /// `Ip`: irradiance on a surface that faces the light.
    pub irradiance: Rgb,
    /// To the light; may be infinite.
    pub distance: f64,
}

/// The light of `light` at `point`; `None` in the very place of a light.
pub(crate) fn incident(light: &Light, point: Vec3) -> Option<Incident> {
    let intensity = Rgb::from(light.intensity.to_array());
    match light.kind {
        LightKind::Directional { direction } => {
            let wi = -Vec3::from(direction.to_array()).normalized();
            Some(Incident {
                wi,
                irradiance: intensity,
                distance: f64::INFINITY,
            })
        }
        LightKind::Point { position, range } => {
            let (wi, distance) = towards(position.to_array().into(), point)?;
            let irradiance = intensity * falloff(distance, range);
            Some(Incident {
                wi,
                irradiance,
                distance,
            })
        }
        LightKind::Spot {
            position,
            direction,
            range,
            inner_cone_angle,
            outer_cone_angle,
        } => {
            let (wi, distance) = towards(position.to_array().into(), point)?;
            let axis = Vec3::from(direction.to_array()).normalized();
            let (inner, outer) = (inner_cone_angle.cos(), outer_cone_angle.cos());
            let s = ((-axis.dot(wi) - outer) / (inner - outer)).clamp(0.0, 1.0);
            let irradiance = intensity * (falloff(distance, range) * s * s);
            Some(Incident {
                wi,
                irradiance,
                distance,
            })
        }
    }
}

fn towards(light: Vec3, point: Vec3) -> Option<(Vec3, f64)> {
    let way = light - point;
    let distance = way.length();
    (distance > 0.0).then(|| (way * (1.0 / distance), distance))
}

/// Inverse square, windowed by the range, which may be infinite.
fn falloff(distance: f64, range: f64) -> f64 {
    let window = (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0);
    window / (distance * distance)
}
