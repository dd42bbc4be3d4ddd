//! What was achieved.

use crate::standing::{Standing, root_mean_square};

/// A picture's error, as it is estimated: in linear radiance, root mean square over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorReport {
    /// All of it: the root of both parts' squares.
    pub estimated_rmse: f64,
    /// The part that was left out of ray trees.
    pub lost_rmse: f64,
    /// The most that this part could be, whatever the branches met that were left out.
    pub lost_bound_rmse: f64,
    /// The part that lies between samples.
    pub sampling_rmse: f64,
    /// The most that any pixel is said to be off by.
    pub largest: f64,
    /// All of it, each pixel in tolerances of its own: above 1 if pixels had as many samples as they may, if trees were cut off, or if
    /// time was up.
    pub in_tolerances: f64,
    /// Samples taken.
    pub samples: u64,
    /// Samples of the pixel that took most.
    pub most_samples: u32,
    /// Pixels that there was no time for: they show what their neighbours do.
    pub unsampled: u64,
}

impl ErrorReport {
    /// As far as is known.
    #[must_use]
    pub fn keeps_tolerance(&self) -> bool {
        self.in_tolerances <= 1.0
    }

    /// Of a picture's pixels; branches were weighed with `branch_scale` of the most that they could bring.
    pub(crate) fn of(standings: &[Standing], branch_scale: f32) -> Self {
        let over = |of: &dyn Fn(&Standing) -> f32| root_mean_square(standings.iter().map(of));
        let lost_rmse = over(&|standing| standing.lost * standing.allowed);
        let largest = standings
            .iter()
            .map(|standing| standing.total() * standing.allowed)
            .fold(0.0, f32::max);
        Self {
            estimated_rmse: over(&|standing| standing.total() * standing.allowed),
            lost_rmse,
            lost_bound_rmse: lost_rmse / f64::from(branch_scale),
            sampling_rmse: over(&|standing| standing.error * standing.allowed),
            largest: f64::from(largest),
            in_tolerances: over(&|standing| standing.total()),
            samples: standings
                .iter()
                .map(|standing| u64::from(standing.samples))
                .sum(),
            most_samples: standings
                .iter()
                .map(|standing| standing.samples)
                .max()
                .unwrap_or(0),
            unsampled: standings
                .iter()
                .filter(|standing| standing.samples == 0)
                .count() as u64,
        }
    }
}
