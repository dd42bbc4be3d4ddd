//! What a picture may be off by.

/// Of the tolerance, what is to be lost by leaving branches of ray trees out: a quarter of the square error, so that samples have seven
/// eighths of it. Measured on whitted-1980 (128x96, errors of 0.03 and 0.01): rays at equal error with 0.3, 0.5 and 0.7 were 1.05, 1 and
/// 1.29.
pub(crate) const LOSS_SHARE: f32 = 0.5;

/// Below this radiance a relative tolerance is that of this radiance: of black, no share is anything (as in the relative mean square
/// error of renderers).
const LEAST_RADIANCE: f32 = 0.01;

/// No tolerance is less, linear radiance.
const LEAST_ALLOWED: f32 = 1e-9;

/// How far a picture may be off: the root mean square over its pixels and channels of what each is off by, in linear radiance (the
/// display's white is 1). Where the background is transparent, a pixel's alpha counts instead of its channels if it is off by more. In units
/// of `absolute` plus `relative` times the pixel's own radiance (or alpha, if that is more and counts), as ODE solvers have it. At least 0
/// each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Linear radiance.
    pub absolute: f32,
    /// Of the pixel's radiance.
    pub relative: f32,
}

impl Tolerance {
    /// The same for all pixels, linear radiance.
    #[must_use]
    pub fn absolute(error: f32) -> Self {
        Self {
            absolute: error,
            relative: 0.0,
        }
    }

    /// A share of each pixel's radiance; of dark pixels, of a radiance of 0.01.
    #[must_use]
    pub fn relative(share: f32) -> Self {
        Self {
            absolute: LEAST_RADIANCE * share,
            relative: share,
        }
    }

    /// Neither is negative or not a number.
    #[must_use]
    pub fn is_valid(self) -> bool {
        self.absolute >= 0.0 && self.relative >= 0.0
    }

    /// The unit for a pixel of this radiance, largest channel.
    #[must_use]
    pub fn allowed(self, radiance: f32) -> f32 {
        (self.absolute + self.relative * radiance.max(0.0)).max(LEAST_ALLOWED)
    }

    /// The unit for all pixels, where it does not depend on them.
    pub(crate) fn uniform(self) -> Option<f32> {
        (self.relative == 0.0).then(|| self.allowed(0.0))
    }
}
