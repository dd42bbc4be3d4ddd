//! The model `whitted` of `shaders/README.md`: Foley et al., eq. 14.32, after Whitted 1980.

use crate::environment;
use crate::fresnel::Interface;
use crate::radiance::{Arrival, Tracer};
use crate::surface::Surface;
use crate::vec::Rgb;

/// The equation's coefficients at a hit: derived from the glTF material, or the book's own where the author gives them.
pub(crate) struct Coefficients {
    pub ka: f64,
    pub kd: f64,
    pub ks: Rgb,
    pub n: f64,
    pub kt: Rgb,
}

impl Coefficients {
    pub fn of(s: &Surface) -> Self {
        let book = s.material.whitted.unwrap_or_default();
        let not_metal = 1.0 - s.metallic;
        let kd = not_metal * (1.0 - s.transmission);
        // As seen from the air: the book's coefficients don't depend on where the ray is.
        let f0 = s.dielectric(Interface::new(1.0, s.index)).f0;
        let alpha = s.roughness * s.roughness;
        let scalar = |own: Option<f32>, derived| own.map_or(derived, f64::from);
        let color = |own: Option<[f32; 3]>, derived| own.map_or(derived, Rgb::from);
        Self {
            ka: scalar(book.ka, kd),
            kd: scalar(book.kd, kd),
            ks: color(
                book.ks.map(|ks| ks.to_array()),
                not_metal * f0 + s.metallic * s.base,
            ),
            n: scalar(book.n, (2.0 / (alpha * alpha) - 2.0).min(1e6)),
            kt: color(
                book.kt.map(|kt| kt.to_array()),
                not_metal * s.transmission * s.base,
            ),
        }
    }
}

/// `L`.
pub(crate) fn radiance(tracer: &mut Tracer, arrival: &Arrival) -> Rgb {
    let s = &arrival.surface;
    let k = Coefficients::of(s);
    let ambient = environment::diffuse(&tracer.oracle.scene.surroundings, s.ns);

    let mut sum = s.emission + (k.ka * s.occlusion) * s.base * ambient;
    sum += tracer.direct(arrival, |wi| {
        let h = (wi + s.wo).normalized();
        (k.kd * s.ns.dot(wi)) * s.base + s.ns.dot(h).powf(k.n) * k.ks
    });
    let total = arrival.wt.is_none();
    sum += tracer.reflection(arrival, if total { k.ks + k.kt } else { k.ks });
    sum += tracer.refraction(arrival, k.kt);
    sum
}
