//! What was achieved.

use crate::pixel::Pixels;
use crate::standing::larger;
use crate::tolerance::Tolerance;

/// A picture's error, as it is estimated: in linear radiance, root mean square over pixels and channels; where a pixel's alpha counts
/// and is off by more than its colours, that instead of them.
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
}

/// Sums over a picture's pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Totals {
    /// But for what branches are weighed with.
    report: ErrorReport,
    /// What was left out, in tolerances: root mean square.
    lost: f64,
}

impl Totals {
    /// `errors`: standard error of each pixel, linear radiance.
    pub(crate) fn of(errors: &[f32], pixels: &Pixels, tolerance: Tolerance) -> Self {
        let count = pixels.len().max(1) as f64;
        let root = |sum: f64| (sum / count).sqrt();
        let losses = pixels.losses();
        let error = sum_of_squares(errors);
        let lost = losses.map_or(0.0, sum_of_squares);
        let (all_in_tolerances, lost_in_tolerances) = match tolerance.uniform() {
            Some(allowed) => {
                let unit = f64::from(allowed).powi(2).recip();
                (unit * (error + lost), unit * lost)
            }
            None => in_tolerances(errors, pixels, tolerance),
        };
        let largest = match losses {
            None => errors.iter().copied().fold(0.0, larger).into(),
            Some(losses) => {
                let square = |value: f32| f64::from(value).powi(2);
                let squares = errors.iter().zip(losses);
                let squares = squares.map(|(error, lost)| square(*error) + square(*lost));
                squares.fold(0.0, f64::max).sqrt()
            }
        };
        let samples = pixels.counts();
        Self {
            report: ErrorReport {
                estimated_rmse: root(lost + error),
                lost_rmse: root(lost),
                lost_bound_rmse: 0.0,
                sampling_rmse: root(error),
                largest,
                in_tolerances: root(all_in_tolerances),
                samples: samples.iter().map(|&count| u64::from(count)).sum(),
                most_samples: samples.iter().copied().max().unwrap_or(0),
                unsampled: samples.iter().map(|&count| u64::from(count == 0)).sum(),
            },
            lost: root(lost_in_tolerances),
        }
    }

    /// All that pixels are off by, in tolerances: root mean square.
    pub(crate) fn all(&self) -> f64 {
        self.report.in_tolerances
    }

    /// Of it, what was left out.
    pub(crate) fn lost(&self) -> f64 {
        self.lost
    }

    /// Pixels without a sample.
    pub(crate) fn unsampled(&self) -> u64 {
        self.report.unsampled
    }

    /// With branches weighed by `branch_scale` of the most that they could bring.
    pub(crate) fn report(&self, branch_scale: f32) -> ErrorReport {
        ErrorReport {
            lost_bound_rmse: self.report.lost_rmse / f64::from(branch_scale),
            ..self.report
        }
    }
}

/// Sums of the squares of all, and of what was lost, each pixel in tolerances of its own.
fn in_tolerances(errors: &[f32], pixels: &Pixels, tolerance: Tolerance) -> (f64, f64) {
    let standings = errors.iter().enumerate();
    standings.fold((0.0, 0.0), |(all, lost), (index, error)| {
        let unit = f64::from(pixels.allowed(index, tolerance)).recip();
        let square = |value: f32| (unit * f64::from(value)).powi(2);
        let of_lost = square(pixels.lost(index));
        (all + square(*error) + of_lost, lost + of_lost)
    })
}

/// In eight sums, so that the machine need not wait for one to add to it.
fn sum_of_squares(values: &[f32]) -> f64 {
    let mut sums = [0.0; 8];
    let square = |value: f32| f64::from(value).powi(2);
    let (chunks, rest) = values.as_chunks::<8>();
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += square(*value);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|&value| square(value)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::Sampled;

    /// Pixels of radiance 1 that lose `lost` each.
    fn pixels(count: usize, lost: f32) -> Pixels {
        let mut pixels = Pixels::new(count, false);
        for index in 0..count {
            let sampled = Sampled {
                radiance: [1.0; 4],
                lost,
                rays: 1,
            };
            pixels.add_sample(index, sampled);
        }
        pixels
    }

    #[test]
    fn a_tolerance_of_each_pixel_is_as_one_of_all_where_they_are_alike() {
        for lost in [0.0, 0.3] {
            let pixels = pixels(19, lost);
            let errors: Vec<f32> = (0..19_u8).map(|k| 0.01 * f32::from(k)).collect();
            let all = Totals::of(&errors, &pixels, Tolerance::absolute(0.1));
            let each = Totals::of(
                &errors,
                &pixels,
                Tolerance {
                    absolute: 0.0,
                    relative: 0.1,
                },
            );
            assert!((all.all() - each.all()).abs() < 1e-6 * all.all());
            assert!((all.lost() - each.lost()).abs() <= 1e-6 * all.lost());
            let squares = errors.iter().map(|error| f64::from(*error).powi(2));
            let expected = (squares.sum::<f64>() / 19.0 + f64::from(lost).powi(2)).sqrt();
            let report = all.report(0.5);
            assert!((report.estimated_rmse - expected).abs() < 1e-6 * expected);
            assert!((report.in_tolerances - 10.0 * expected).abs() < 1e-5 * expected);
            assert!((report.largest - 0.18_f64.hypot(lost.into())).abs() < 1e-6);
            assert_eq!(report.lost_bound_rmse, 2.0 * report.lost_rmse);
            assert_eq!((report.samples, report.unsampled), (19, 0));
        }
    }
}
