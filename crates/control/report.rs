//! What was achieved.

use crate::standing::Standing;

/// A picture's error, as it is estimated: in linear radiance, root mean square over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorReport {
    /// All of it: the root of both parts' squares.
    pub estimated_rmse: f64,
    /// The part that was left out of ray trees.
    pub lost_rmse: f64,
    /// .. if all of that were branches, and each had brought the most that any could.
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
        let mut report = Self::default();
        let mut sums = [0.0; 4];
        for standing in standings {
            let parts = [standing.total(), standing.lost, standing.error];
            let [total, lost, error] = parts.map(|part| f64::from(part * standing.allowed));
            let squares = [total, lost, error, f64::from(standing.total())].map(|part| part * part);
            sums.iter_mut()
                .zip(squares)
                .for_each(|(sum, square)| *sum += square);
            report.largest = report.largest.max(total);
            report.samples += u64::from(standing.samples);
            report.most_samples = report.most_samples.max(standing.samples);
            report.unsampled += u64::from(standing.samples == 0);
        }
        let root = |sum: f64| (sum / standings.len().max(1) as f64).sqrt();
        Self {
            estimated_rmse: root(sums[0]),
            lost_rmse: root(sums[1]),
            lost_bound_rmse: root(sums[1]) / f64::from(branch_scale),
            sampling_rmse: root(sums[2]),
            in_tolerances: root(sums[3]),
            ..report
        }
    }
}
