//! The model `pbr` of `shaders/README.md`: glTF 2.0 appendix B with transmission, volume, ior and specular.

use std::f64::consts::PI;

use crate::environment;
use crate::radiance::{Arrival, Tracer};
use crate::vec::{Rgb, Vec3};

/// `L`.
pub(crate) fn radiance(tracer: &mut Tracer, arrival: &Arrival) -> Rgb {
    let surroundings = &tracer.oracle.scene.surroundings;
    let s = &arrival.surface;
    let (m, tr, ao) = (s.metallic, s.transmission, s.occlusion);
    let c = s.ns.dot(s.wo);
    let fresnel = arrival.dielectric.reflectance(c);
    let metal = metal_reflectance(s.base, c);
    let (scale, bias) = split_sum(c, s.roughness);
    let ambient_fresnel = match arrival.wt {
        Some(_) => arrival.dielectric.f0 * scale + arrival.dielectric.f90 * bias,
        None => Rgb::ONE,
    };
    let ambient_metal = s.base * scale + Rgb::splat(bias);
    let w = mirror_share(s.roughness);
    let diffuse_color = (1.0 - m) * (1.0 - tr) * s.base;
    let transmitted = (1.0 - m) * tr * (1.0 - fresnel.largest()) * s.base;

    let mut sum = s.emission;
    sum += tracer.direct(arrival, |wi| {
        s.ns.dot(wi) * brdf(arrival, diffuse_color, wi)
    });
    let not_specular = 1.0 - ((1.0 - w) * ambient_fresnel + w * fresnel).largest();
    sum += ao * not_specular * diffuse_color * environment::diffuse(surroundings, s.ns);
    sum += (ao * (1.0 - w))
        * environment::glossy(surroundings, arrival.wr, s.roughness)
        * ((1.0 - m) * ambient_fresnel + m * ambient_metal);
    if let Some(wt) = arrival.wt {
        sum += (1.0 - w) * transmitted * environment::glossy(surroundings, wt, s.roughness);
    }
    sum += tracer.reflection(arrival, w * ((1.0 - m) * fresnel + m * metal));
    sum += tracer.refraction(arrival, w * transmitted);
    sum
}

/// Share of the light from `wi` that goes to `wo`, per solid angle.
fn brdf(arrival: &Arrival, diffuse_color: Rgb, wi: Vec3) -> Rgb {
    let s = &arrival.surface;
    let h = (wi + s.wo).normalized();
    let c = wi.dot(h);
    let fresnel = arrival.dielectric.reflectance(c);
    let diffuse = (1.0 - fresnel.largest()) / PI * diffuse_color;
    let specular = (1.0 - s.metallic) * fresnel + s.metallic * metal_reflectance(s.base, c);
    let alpha = s.roughness * s.roughness;
    diffuse + microfacets(alpha, s.ns.dot(h), s.ns.dot(wi), s.ns.dot(s.wo)) * specular
}

/// `D V`: GGX with the height-correlated Smith visibility; 0 for a surface too smooth to show a light without size.
fn microfacets(alpha: f64, n_dot_h: f64, n_dot_l: f64, n_dot_v: f64) -> f64 {
    const SMOOTHEST: f64 = 1e-3;
    if alpha < SMOOTHEST {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let d = a2 / (PI * (n_dot_h * n_dot_h * (a2 - 1.0) + 1.0).powi(2));
    let masking = |a: f64, b: f64| a * (b * b * (1.0 - a2) + a2).sqrt();
    d * 0.5 / (masking(n_dot_l, n_dot_v) + masking(n_dot_v, n_dot_l))
}

/// Schlick's approximation, `Fm`.
fn metal_reflectance(base: Rgb, c: f64) -> Rgb {
    base + (Rgb::ONE - base) * (1.0 - c).max(0.0).powi(5)
}

/// `AB`: Karis' fit of the split-sum integral ("Physically Based Shading on Mobile", 2014).
fn split_sum(c: f64, roughness: f64) -> (f64, f64) {
    const SLOPE: [f64; 4] = [-1.0, -0.0275, -0.572, 0.022];
    const START: [f64; 4] = [1.0, 0.0425, 1.04, -0.04];
    let [x, y, z, w] = std::array::from_fn(|k| roughness * SLOPE[k] + START[k]);
    let a = (x * x).min((-9.28 * c).exp2()) * x + y;
    (-1.04 * a + z, 1.04 * a + w)
}

/// `smooth(r)`: the share of the lobe that a mirror ray stands for.
fn mirror_share(roughness: f64) -> f64 {
    let t = ((roughness - 0.1) / (0.4 - 0.1)).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_stand_for_smooth_lobes_only() {
        assert_eq!([0.0, 0.1, 0.4, 1.0].map(mirror_share), [1.0, 1.0, 0.0, 0.0]);
        assert!((mirror_share(0.25) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn rough_microfacets_seen_and_lit_straight_on() {
        // alpha = 1: D = 1/pi, V = 1/4 at normal incidence.
        assert!((microfacets(1.0, 1.0, 1.0, 1.0) - 0.25 / PI).abs() < 1e-15);
        // alpha = 1/2: D = 1/(pi alpha^2).
        assert!((microfacets(0.5, 1.0, 1.0, 1.0) - 1.0 / PI).abs() < 1e-15);
        assert_eq!(microfacets(9e-4, 1.0, 1.0, 1.0), 0.0);
    }

    #[test]
    fn microfacets_reflect_their_albedo() {
        // Integral of D V cos over the hemisphere, by the midpoint rule, seen at 60 degrees. What it should be: sampled
        // by half vectors, with the masking as a sum of Smith's two lambdas (3e5 samples of a program of its own).
        const EXPECTED: f64 = 0.699;
        let (alpha, wo) = (0.5, Vec3::new(0.75_f64.sqrt(), 0.0, 0.5));
        let steps = 400;
        let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(steps);
        let mut sum = 0.0;
        for cos in (0..steps).map(middle) {
            let sin = (1.0 - cos * cos).sqrt();
            for phi in (0..steps).map(|j| 2.0 * PI * middle(j)) {
                let wi = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                let h = (wi + wo).normalized();
                sum += microfacets(alpha, h.z, wi.z, wo.z) * cos;
            }
        }
        let albedo = sum * 2.0 * PI / f64::from(steps * steps);
        assert!((albedo - EXPECTED).abs() < 2e-3, "{albedo}");
    }

    #[test]
    fn metals_shine_white_at_grazing() {
        let gold = Rgb::new(1.0, 0.7, 0.3);
        assert_eq!(metal_reflectance(gold, 1.0), gold);
        assert_eq!(metal_reflectance(gold, 0.0), Rgb::ONE);
    }
}
