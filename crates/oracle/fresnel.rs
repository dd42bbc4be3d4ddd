//! Fresnel's equations and Snell's law: "Fresnel and Snell" in `shaders/README.md`.

use crate::vec::{Rgb, Vec3};

/// A boundary between two media, seen from the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    eta_i: f64,
    eta_t: f64,
}

impl Interface {
    /// From index `eta_i` to index `eta_t`. Indices within 1e-7 of each other are no boundary. An infinite `eta_t`
    /// reflects like a conductor.
    pub fn new(eta_i: f64, eta_t: f64) -> Self {
        const SAME: f64 = 1e-7;
        let same = (eta_i - eta_t).abs() < SAME * eta_i.max(eta_t);
        Self {
            eta_i,
            eta_t: if same { eta_i } else { eta_t },
        }
    }

    /// `eta_i / eta_t`; 0 into an infinite index, whatever the first.
    fn ratio(&self) -> f64 {
        if self.eta_t.is_infinite() {
            0.0
        } else {
            self.eta_i / self.eta_t
        }
    }

    /// Cosine of the refracted ray's angle, where that of the incident ray is `c`; `None` in total internal reflection.
    fn cos_t(&self, c: f64) -> Option<f64> {
        let sin2_t = self.ratio().powi(2) * (1.0 - c) * (1.0 + c);
        (sin2_t < 1.0).then(|| (1.0 - sin2_t).sqrt())
    }

    /// All light is reflected at an incidence of cosine `c`.
    pub fn is_total(&self, c: f64) -> bool {
        self.cos_t(c).is_none()
    }

    /// Share of unpolarised light that a smooth boundary reflects.
    pub fn exact(&self, c: f64) -> f64 {
        if self.eta_t.is_infinite() {
            return 1.0;
        }
        let (eta_i, eta_t) = (self.eta_i, self.eta_t);
        if eta_i == eta_t {
            return 0.0;
        }
        self.cos_t(c).map_or(1.0, |cos_t| {
            let rs = (eta_i * c - eta_t * cos_t) / (eta_i * c + eta_t * cos_t);
            let rp = (eta_t * c - eta_i * cos_t) / (eta_t * c + eta_i * cos_t);
            0.5 * (rs * rs + rp * rp)
        })
    }

    /// The same at normal incidence.
    pub fn r0(&self) -> f64 {
        if self.eta_t.is_infinite() {
            return 1.0;
        }
        ((self.eta_i - self.eta_t) / (self.eta_i + self.eta_t)).powi(2)
    }

    /// Direction of the refracted ray; `None` in total internal reflection. `wo` and `normal` point to the first medium.
    pub fn refracted(&self, wo: Vec3, normal: Vec3) -> Option<Vec3> {
        let c = normal.dot(wo);
        let ratio = self.ratio();
        self.cos_t(c)
            .map(|cos_t| -ratio * wo + (ratio * c - cos_t) * normal)
    }
}

/// A dielectric surface's reflectance: Fresnel's equations, scaled by KHR_materials_specular.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dielectric {
    pub interface: Interface,
    /// At normal incidence.
    pub f0: Rgb,
    /// At grazing incidence.
    pub f90: Rgb,
}

impl Dielectric {
    pub fn new(interface: Interface, specular: f64, specular_color: Rgb) -> Self {
        let f0 = (interface.r0() * specular_color).min(Rgb::ONE) * specular;
        Self {
            interface,
            f0,
            f90: Rgb::splat(specular),
        }
    }

    /// `F(c)`: the share reflected at an incidence of cosine `c`.
    pub fn reflectance(&self, c: f64) -> Rgb {
        if self.interface.is_total(c) {
            return Rgb::ONE;
        }
        let r0 = self.interface.r0();
        if r0 >= 1.0 {
            return self.f0;
        }
        let towards_grazing = (self.interface.exact(c) - r0) / (1.0 - r0);
        // Above an index of 2 + sqrt 3 the equations dip below R0; with F0 = 0 that would be less than nothing.
        (self.f0 + (self.f90 - self.f0) * towards_grazing).max(Rgb::ZERO)
    }
}

/// `wo` mirrored at the surface, kept on the side of the geometric normal `ng`.
pub(crate) fn reflected(wo: Vec3, ns: Vec3, ng: Vec3) -> Vec3 {
    let mirrored = 2.0 * ns.dot(wo) * ns - wo;
    kept_on_side(mirrored, ng)
}

/// `direction`, mirrored at the plane of `ng` if it points away from it.
pub(crate) fn kept_on_side(direction: Vec3, ng: Vec3) -> Vec3 {
    let height = direction.dot(ng);
    let kept = if height < 0.0 {
        direction - 2.0 * height * ng
    } else {
        direction
    };
    kept.normalized()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Interface = Interface {
        eta_i: 1.0,
        eta_t: 1.5,
    };
    const OUT_OF_GLASS: Interface = Interface {
        eta_i: 1.5,
        eta_t: 1.0,
    };
    const UP: Vec3 = Vec3 {
        x: 0.0,
        y: 1.0,
        z: 0.0,
    };

    fn plain(interface: Interface) -> Dielectric {
        Dielectric::new(interface, 1.0, Rgb::ONE)
    }

    fn at_angle(theta: f64) -> Vec3 {
        Vec3::new(theta.sin(), theta.cos(), 0.0)
    }

    #[test]
    fn glass_reflects_four_percent_straight_on_and_all_at_grazing() {
        assert!((GLASS.exact(1.0) - 0.04).abs() < 1e-15);
        assert!((GLASS.r0() - 0.04).abs() < 1e-15);
        assert!((GLASS.exact(0.0) - 1.0).abs() < 1e-15);
        assert!((plain(GLASS).reflectance(1.0).x - 0.04).abs() < 1e-15);
    }

    #[test]
    fn brewster_leaves_half_of_the_s_polarised_part() {
        // tan(theta) = n: rp = 0, rs = (1 - n^2)/(1 + n^2).
        let theta = 1.5_f64.atan();
        let rs = (1.0 - 2.25) / (1.0 + 2.25);
        assert!((GLASS.exact(theta.cos()) - 0.5 * rs * rs).abs() < 1e-15);
    }

    #[test]
    fn reflectance_is_the_same_from_both_sides_of_a_ray() {
        for degrees in [0.0_f64, 20.0, 45.0, 70.0, 89.0] {
            let theta = degrees.to_radians();
            let theta_t = (theta.sin() / 1.5).asin();
            let difference = GLASS.exact(theta.cos()) - OUT_OF_GLASS.exact(theta_t.cos());
            assert!(difference.abs() < 1e-13, "{degrees}: {difference}");
        }
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let critical = (1.0_f64 / 1.5).asin();
        assert!(!OUT_OF_GLASS.is_total((critical - 1e-9).cos()));
        assert!(OUT_OF_GLASS.is_total((critical + 1e-9).cos()));
        // Just below it the reflectance is already close to 1: 1 - O(sqrt(angle)).
        assert!(OUT_OF_GLASS.exact((critical - 1e-9).cos()) > 0.999);
        assert_eq!(
            plain(OUT_OF_GLASS).reflectance((critical + 1e-9).cos()),
            Rgb::ONE
        );
    }

    #[test]
    fn refraction_obeys_snell() {
        let wo = at_angle(0.7);
        let wt = GLASS.refracted(wo, UP).unwrap();
        assert!((wt.length() - 1.0).abs() < 1e-15);
        assert!((wt.x + 0.7_f64.sin() / 1.5).abs() < 1e-15 && wt.y < 0.0 && wt.z == 0.0);
        // And back again along the same path.
        let back = OUT_OF_GLASS.refracted(wt, -UP).unwrap();
        assert!((back - wo).length() < 1e-14);
    }

    #[test]
    fn equal_indices_are_no_boundary() {
        let none = Interface::new(1.33, 1.33 * (1.0 + 5e-8));
        let wo = at_angle(1.2);
        assert!((none.refracted(wo, UP).unwrap() + wo).length() < 1e-15);
        assert_eq!((none.exact(0.3), none.r0()), (0.0, 0.0));
    }

    #[test]
    fn an_infinite_index_reflects_all_at_every_angle() {
        let boundary = Interface::new(1.0, f64::INFINITY);
        let mirror = Dielectric::new(boundary, 0.5, Rgb::new(0.25, 1.0, 3.0));
        for c in [0.0, 0.3, 1.0] {
            assert_eq!(mirror.reflectance(c), Rgb::new(0.125, 0.5, 0.5));
        }
    }

    #[test]
    fn specular_scales_both_ends_and_colour_only_the_first() {
        let tinted = Dielectric::new(GLASS, 0.5, Rgb::new(0.0, 1.0, 50.0));
        assert!((tinted.reflectance(1.0) - Rgb::new(0.0, 0.02, 0.5)).length() < 1e-15);
        assert!((tinted.reflectance(0.0) - Rgb::splat(0.5)).length() < 1e-15);
    }

    #[test]
    fn reflectance_is_never_negative() {
        let steep = Dielectric::new(Interface::new(1.0, 8.0), 1.0, Rgb::ZERO);
        for step in 0..=100 {
            assert!(steep.reflectance(f64::from(step) / 100.0).x >= 0.0);
        }
    }

    #[test]
    fn mirroring_stays_outside_of_the_surface() {
        let ns = at_angle(0.6);
        let wo = at_angle(-0.9);
        let wr = reflected(wo, ns, UP);
        assert!(wr.dot(UP) > 0.0 && (wr.length() - 1.0).abs() < 1e-15);
    }
}
