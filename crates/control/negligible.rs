//! What may be left out of a sample, and how that is found.
//!
//! A branch of a ray tree is left out if it can't bring more than is *negligible*. How much all that is left out adds up to depends on
//! how many branches there are, which nobody knows beforehand: so what is negligible is tried, at first on a few pixels, and changed by
//! what came of it, as ODE solvers do with a step.

/// Half octaves, from 2^-96 on, as the shaders have it (`shaders/tolerance.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Negligible(u8);

impl Negligible {
    /// The largest that is not above `radiance`; the least for 0 and less.
    pub(crate) fn below(radiance: f32) -> Self {
        // NaN becomes 0.
        Self((2.0 * (radiance.log2() + 96.0)).floor().clamp(0.0, 255.0) as u8)
    }

    /// Linear radiance.
    #[must_use]
    pub fn radiance(self) -> f32 {
        (0.5 * f32::from(self.0) - 96.0).exp2()
    }

    /// As the shaders read it.
    #[must_use]
    pub fn code(self) -> u32 {
        self.0.into()
    }
}

/// Of a pixel's tolerance, what is negligible before anything is known.
pub(crate) const FIRST_GUESS: f32 = 0.25;

/// By how much what is negligible is to change where `lost` was lost and `wanted` was to be, both shares of the tolerance.
pub(crate) fn correction(lost: f32, wanted: f32) -> f32 {
    let factor = if lost > 0.0 { wanted / lost } else { MOST_GAIN };
    // Less is lost than in proportion when less is negligible: of many small branches more are followed, which split again.
    let factor = if factor < 1.0 {
        factor.powf(FALLING)
    } else {
        factor
    };
    factor.clamp(LEAST_GAIN, MOST_GAIN)
}

const FALLING: f32 = 1.5;
const LEAST_GAIN: f32 = 1.0 / 64.0;
const MOST_GAIN: f32 = 32.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_half_octaves_downwards() {
        assert_eq!(Negligible::below(1.0).radiance(), 1.0);
        assert_eq!(Negligible::below(0.99).radiance(), 0.5_f32.sqrt());
        assert_eq!(Negligible::below(0.0).code(), 0);
        assert_eq!(Negligible::below(f32::NAN).code(), 0);
        assert_eq!(Negligible::below(f32::INFINITY).code(), 255);
    }

    #[test]
    fn too_much_lost_makes_less_negligible_and_too_little_more() {
        assert!(correction(0.6, 0.3) < 0.5);
        assert_eq!(correction(0.1, 0.3), 3.0);
        assert_eq!(correction(0.0, 0.3), MOST_GAIN);
        assert_eq!(correction(f32::MAX, 0.3), LEAST_GAIN);
    }
}
