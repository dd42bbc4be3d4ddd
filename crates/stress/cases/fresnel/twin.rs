//! What happens at a smooth boundary, in f64 from the textbook (Born and Wolf 1999, 1.5): the judge of the shaders' functions.

use glam::{DVec3, Vec3};

/// A boundary that a ray meets, as the shaders get it: nothing here is rounded any further.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encounter {
    /// Towards where the ray came from; its length is 1 but for rounding.
    pub wo: Vec3,
    /// Normal, likewise.
    pub normal: Vec3,
    /// Index on the ray's side.
    pub eta_i: f32,
    /// Index on the other.
    pub eta_t: f32,
}

/// What becomes of the ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Share that is reflected, unpolarised light.
    pub reflectance: f64,
    /// Unit.
    pub reflected: DVec3,
    /// Unit; `None` in total internal reflection.
    pub refracted: Option<DVec3>,
    /// Squared cosine of the refracted angle; negative in total internal reflection.
    pub cos_t_squared: f64,
}

/// The angle is that between the two vectors as they are, whatever their lengths.
pub(super) fn outcome(encounter: &Encounter) -> Outcome {
    let wo = encounter.wo.as_dvec3().normalize();
    let normal = encounter.normal.as_dvec3().normalize();
    let (eta_i, eta_t) = (f64::from(encounter.eta_i), f64::from(encounter.eta_t));
    let ratio = eta_i / eta_t;
    let cos_i = normal.dot(wo);
    // From the cross product: near normal incidence 1 - cos^2 has no digits left, even in f64.
    let across = normal.cross(wo.cross(normal));
    let cos_t_squared = 1.0 - ratio * ratio * across.length_squared();
    let reflected = 2.0 * cos_i * normal - wo;
    if cos_t_squared <= 0.0 {
        return Outcome {
            reflectance: 1.0,
            reflected,
            refracted: None,
            cos_t_squared,
        };
    }
    let cos_t = cos_t_squared.sqrt();
    let share = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let s_polarised = share(eta_i * cos_i, eta_t * cos_t);
    let p_polarised = share(eta_t * cos_i, eta_i * cos_t);
    Outcome {
        reflectance: 0.5 * (s_polarised + p_polarised),
        reflected,
        refracted: Some((-ratio * across - cos_t * normal).normalize()),
        cos_t_squared,
    }
}

/// Angle between two directions, radians; exact for small ones.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64, eta_i: f32, eta_t: f32) -> Outcome {
        let (sin, cos) = degrees.to_radians().sin_cos();
        outcome(&Encounter {
            wo: DVec3::new(sin, cos, 0.0).as_vec3(),
            normal: Vec3::Y,
            eta_i,
            eta_t,
        })
    }

    #[test]
    fn glass_does_what_the_textbook_says() {
        assert!((at(0.0, 1.0, 1.5).reflectance - 0.04).abs() < 1e-9);
        // Brewster's angle: only s is reflected.
        let brewster = at(1.5_f64.atan().to_degrees(), 1.0, 1.5).reflectance;
        assert!((brewster - 0.5 * (1.25_f64 / 3.25).powi(2)).abs() < 1e-7);
        let bent = at(45.0, 1.0, 1.5).refracted.unwrap();
        assert!((bent.x + 0.5_f64.sqrt() / 1.5).abs() < 1e-7 && bent.y < 0.0);
        assert!(at(42.0, 1.5, 1.0).refracted.is_none());
        assert!(at(41.0, 1.5, 1.0).refracted.is_some());
    }

    #[test]
    fn angles_are_exact_when_small() {
        let a = DVec3::new(1e-9, 0.0, 1.0);
        assert!((angle(a, DVec3::Z) - 1e-9).abs() < 1e-20);
        assert!((angle(DVec3::X, DVec3::NEG_X) - std::f64::consts::PI).abs() < 1e-15);
    }
}
