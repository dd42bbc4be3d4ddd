//! What follows from a material alone, wherever on it a ray hits.

use raytree_scene::model::Material;

use crate::media::Medium;
use crate::render::Shading;
use crate::vec::Rgb;

/// Least channel of an attenuation colour: absorption stays finite.
const LEAST_ATTENUATION: f64 = 1e-6;

/// Light may pass through it somewhere.
pub(crate) fn transmits(material: &Material, shading: Shading) -> bool {
    material.transmission > 0.0 || has_book_transmission(material, shading)
}

/// Its back faces are not there for radiance rays.
pub(crate) fn culls_backs(material: &Material, shading: Shading) -> bool {
    !material.double_sided && !transmits(material, shading)
}

/// What is behind its front faces, if it bounds a solid.
pub(crate) fn medium(material: &Material, shading: Shading) -> Option<Medium> {
    if !transmits(material, shading) {
        return None;
    }
    let sigma = match material.volume {
        Some(volume) => Rgb::from(volume.attenuation_color.to_array())
            .map(|color| -color.max(LEAST_ATTENUATION).ln() / volume.attenuation_distance),
        None if has_book_transmission(material, shading) => Rgb::ZERO,
        None => return None,
    };
    Some(Medium {
        index: index(material, shading),
        sigma,
        priority: material.priority,
    })
}

/// Its index of refraction.
pub(crate) fn index(material: &Material, shading: Shading) -> f64 {
    let book = match shading {
        Shading::Pbr => None,
        Shading::Whitted => material.whitted.and_then(|whitted| whitted.ior),
    };
    f64::from(book.unwrap_or(material.ior))
}

fn has_book_transmission(material: &Material, shading: Shading) -> bool {
    let kt = material.whitted.and_then(|whitted| whitted.kt);
    shading == Shading::Whitted && kt.is_some_and(|kt| Rgb::from(kt.to_array()).largest() > 0.0)
}
