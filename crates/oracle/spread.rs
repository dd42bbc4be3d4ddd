//! How far a pixel's value depends on where exactly it is looked at.

use raytree_scene::model::Camera;

use crate::Oracle;
use crate::render::Settings;
use crate::vec::Vec3;

/// The values that a pixel takes when its samples are moved by a little.
///
/// A renderer that rounds more than the oracle does may show any of them: a value outside of the spread is an error, a
/// wide spread means an edge (of a shape, a shadow, a texel, total internal reflection) or steep shading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Linear RGB, the least of each channel.
    pub min: [f64; 3],
    /// Linear RGB, the largest of each channel.
    pub max: [f64; 3],
}

impl Spread {
    /// Difference between largest and least value, of the channel where it is largest.
    #[must_use]
    pub fn width(&self) -> f64 {
        (Vec3::from(self.max) - Vec3::from(self.min)).largest()
    }

    /// Whether `value` lies within, give or take `tolerance`, in every channel.
    #[must_use]
    pub fn contains(&self, value: [f64; 3], tolerance: f64) -> bool {
        (0..3).all(|k| value[k] >= self.min[k] - tolerance && value[k] <= self.max[k] + tolerance)
    }
}

impl Oracle<'_> {
    /// The spread of pixel `(x, y)` of the whole picture over nine positions: where it is, and moved by `radius` pixels
    /// (1e-3, say) in eight directions.
    #[must_use]
    pub fn spread(
        &self,
        camera: &Camera,
        settings: &Settings,
        x: u32,
        y: u32,
        radius: f64,
    ) -> Spread {
        let shifts = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [dx, dy].map(f64::from)));
        let none = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
        let (min, max) = shifts.fold(none, |(min, max), [dx, dy]| {
            let shift = [dx * radius, dy * radius];
            let value = self.shifted_radiance(camera, settings, (x, y), shift);
            (min.min(value), max.max(value))
        });
        Spread {
            min: min.to_array(),
            max: max.to_array(),
        }
    }
}
