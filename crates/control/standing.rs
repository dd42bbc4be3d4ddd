//! How far a pixel is off, in tolerances.

use crate::allocation::Candidate;

/// No tolerance is less, linear radiance.
pub(crate) const LEAST_ALLOWED: f32 = 1e-9;

/// A pixel as it is judged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing {
    /// What lies between its samples, standard error.
    pub(crate) error: f32,
    /// What was left out of them.
    pub(crate) lost: f32,
    pub(crate) samples: u32,
    pub(crate) rays: u32,
    /// The tolerance, linear radiance.
    pub(crate) allowed: f32,
}

impl Standing {
    pub(crate) fn candidate(self) -> Candidate {
        Candidate {
            square: self.error * self.error,
            rays: self.rays,
        }
    }

    /// Both parts have nothing to do with each other, so that their squares add up.
    pub(crate) fn total(self) -> f32 {
        self.error.hypot(self.lost)
    }
}

/// Over pixels.
pub(crate) fn root_mean_square(values: impl Iterator<Item = f32>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u64), |(sum, count), value| {
        (sum + f64::from(value).powi(2), count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}
