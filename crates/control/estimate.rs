//! How far a pixel's mean is off by what lies between its samples.
//!
//! From its second round on a pixel has groups of samples, each spread over the filter as all of them are; how much they disagree says
//! how much their mean is off (batch means; Schmeiser 1982). It may be chance that they agree, so a pixel hears its neighbours too: the filter
//! reaches 1.5 pixels far, so what one sees another sees as well.
//!
//! A pixel with its middle sample alone has nothing to compare but its neighbours' values: by how much it lies off the straight line
//! between two that are opposite to each other. Along a smooth gradient that is nothing, and the filter is symmetric, so that
//! its mean is the value in the middle then.
//!
//! Where alpha counts it is looked at like a colour, and the worse of both is taken: what is dark before a transparent background has its
//! edges there alone.

use crate::calibration::LEVELS;
use crate::grid::Grid;
use crate::pixel::{Pixels, level_of};
use crate::standing::larger;

/// Of the second difference across an edge, the error of a single sample in the middle of the pixels at its sides, about: calibration
/// makes it right.
const EDGE_ERROR: f32 = 0.25;

/// Power of the number of samples by which errors fall, of which variances have twice.
const ORDER: f32 = 0.75;

/// A picture's pixels, all that estimates see.
pub(crate) struct Picture<'p> {
    pub(crate) grid: Grid,
    pub(crate) pixels: &'p Pixels,
    /// What errors are to be multiplied by, at each level.
    pub(crate) factors: [f32; LEVELS],
}

impl Picture<'_> {
    /// The standard error of each pixel's mean, as [`over_channels`] has it.
    pub(crate) fn standard_errors(&self, errors: &mut [f32]) {
        let mut differences = vec![0.0; 3 * self.grid.width];
        for (y, errors) in errors.chunks_exact_mut(self.grid.width.max(1)).enumerate() {
            self.bends(y, &mut differences, errors);
            if self.pixels.any_refined() {
                for (x, error) in errors.iter_mut().enumerate() {
                    *error = self.refined_error(x, y).unwrap_or(*error);
                }
            }
        }
    }

    /// That of a pixel which has groups.
    fn refined_error(&self, x: usize, y: usize) -> Option<f32> {
        let index = y * self.grid.width + x;
        let own = self.pixels.variance(index)?;
        let count = self.pixels.count(index);
        let around = self.variance_around(x, y, count);
        Some(self.factors[factor_of(count)] * own.max(around).sqrt())
    }

    /// The mean variance of a pixel and its neighbours, as it would be with `count` samples.
    fn variance_around(&self, x: usize, y: usize, count: u32) -> f32 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for row in y.saturating_sub(1)..(y + 2).min(self.grid.height) {
            for column in x.saturating_sub(1)..(x + 2).min(self.grid.width) {
                let index = row * self.grid.width + column;
                if let Some(variance) = self.pixels.variance(index) {
                    let scale = self.pixels.count(index) as f32 / count as f32;
                    sum += variance * scale.powf(2.0 * ORDER);
                    weight += 1.0;
                }
            }
        }
        sum / f32::max(weight, 1.0)
    }

    /// Of a row's pixels the error of single samples.
    fn bends(&self, y: usize, differences: &mut [f32], errors: &mut [f32]) {
        let single = self.factors[0] * EDGE_ERROR;
        let is_inner = y > 0 && y + 1 < self.grid.height && self.grid.width > 2;
        if is_inner {
            let first = (y - 1) * self.grid.width;
            let three_rows = &self.pixels.radiance()[first..first + 3 * self.grid.width];
            second_differences::<3>(three_rows.as_flattened(), differences);
            let (chunks, _) = differences.as_chunks::<3>();
            for (error, [r, g, b]) in errors[1..].iter_mut().zip(chunks) {
                // As `over_channels`, in fewer digits.
                *error = single * ((r * r + g * g + b * b) / 3.0).sqrt();
            }
            if let Some(alpha) = self.pixels.alpha() {
                second_differences::<1>(&alpha[first..first + 3 * self.grid.width], differences);
                for (error, alpha) in errors[1..self.grid.width - 1].iter_mut().zip(&*differences) {
                    *error = larger(*error, single * alpha);
                }
            }
        }
        let edges = if is_inner {
            [0..1, self.grid.width - 1..self.grid.width]
        } else {
            [0..self.grid.width, 0..0]
        };
        for x in edges.into_iter().flatten() {
            errors[x] = single * over_channels(self.bend(x, y));
        }
        // Squares that f32 does not hold.
        for (x, error) in errors.iter_mut().enumerate() {
            if !error.is_finite() {
                *error = single * over_channels(self.bend(x, y));
            }
        }
    }

    /// In each channel the largest second difference through a pixel, in any of four directions. At the picture's edge, the first
    /// difference.
    fn bend(&self, x: usize, y: usize) -> [f32; 4] {
        let mean = |x: usize, y: usize| self.pixels.judged(y * self.grid.width + x);
        let here = mean(x, y);
        let at = |dx: isize, dy: isize| {
            let column = x
                .checked_add_signed(dx)
                .filter(|&column| column < self.grid.width)?;
            let row = y
                .checked_add_signed(dy)
                .filter(|&row| row < self.grid.height)?;
            Some(mean(column, row))
        };
        let difference = |a: [f32; 4], b: [f32; 4]| {
            let of_channel = |c: usize| (a[c] + b[c] - 2.0 * here[c]).abs();
            [0, 1, 2, 3].map(of_channel)
        };
        [(1, 0), (0, 1), (1, 1), (1, -1)]
            .into_iter()
            .map(|(dx, dy)| match (at(dx, dy), at(-dx, -dy)) {
                (Some(a), Some(b)) => difference(a, b),
                (Some(a), None) | (None, Some(a)) => difference(a, here),
                (None, None) => [0.0; 4],
            })
            .fold([0.0; 4], |most, found| {
                [0, 1, 2, 3].map(|c| larger(most[c], found[c]))
            })
    }
}

/// As [`Picture::bend`], of the middle one of three rows but for its first and last pixel: in one loop over the `CHANNELS` of all pixels,
/// which compilers make vectors of.
fn second_differences<const CHANNELS: usize>(three_rows: &[f32], differences: &mut [f32]) {
    let width = three_rows.len() / 3;
    let count = width - 2 * CHANNELS;
    let differences = &mut differences[..count];
    let shifted = |row: usize, by: usize| &three_rows[row * width + by..][..count];
    let places = [0, CHANNELS, 2 * CHANNELS];
    let [a, b, c] = places.map(|by| shifted(0, by));
    let [d, here, e] = places.map(|by| shifted(1, by));
    let [f, g, h] = places.map(|by| shifted(2, by));
    for k in 0..count {
        let twice = 2.0 * here[k];
        let along = larger((d[k] + e[k] - twice).abs(), (b[k] + g[k] - twice).abs());
        let across = larger((a[k] + h[k] - twice).abs(), (c[k] + f[k] - twice).abs());
        differences[k] = larger(along, across);
    }
}

/// Which of [`Picture::factors`] is that of a pixel with as many samples.
pub(crate) fn factor_of(count: u32) -> usize {
    (level_of(count) as usize).min(LEVELS - 1)
}

/// What is said of a pixel that differs by as much: root mean square over the colour channels, as pictures are judged, or what alpha
/// differs by where that is more.
pub(crate) fn over_channels([r, g, b, alpha]: [f32; 4]) -> f32 {
    let square = |value: f32| f64::from(value).powi(2);
    larger(
        ((square(r) + square(g) + square(b)) / 3.0).sqrt() as f32,
        alpha.abs(),
    )
}

/// As [`over_channels`], of what two pixels differ by: radiance and alpha.
pub(crate) fn difference(a: [f32; 4], b: [f32; 4]) -> f32 {
    over_channels([0, 1, 2, 3].map(|channel| a[channel] - b[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::Sampled;

    fn pixels(width: usize, height: usize, alpha: fn(f32) -> f32, scale: f32) -> Pixels {
        let mut pixels = Pixels::new(width * height, true);
        for index in 0..width * height {
            let value = |k: usize| ((index * 7919 + k * 104_729) % 1000) as f32 / 1000.0;
            let radiance = [
                scale * value(0),
                scale * value(1),
                scale * value(2),
                alpha(value(3)),
            ];
            let sampled = Sampled {
                radiance,
                ..Sampled::default()
            };
            pixels.add_sample(index, sampled);
        }
        pixels
    }

    /// Many at once are as one by one.
    #[test]
    fn rows_have_the_bends_of_their_pixels() {
        let opaque: fn(f32) -> f32 = |_| 1.0;
        let sizes = [(1, 1), (2, 5), (3, 3), (17, 4), (64, 9)];
        let cases = sizes
            .into_iter()
            .flat_map(|size| [opaque, |alpha| 3.0 * alpha - 1.0].map(|alpha| (size, alpha)));
        for ((width, height), alpha) in cases {
            // Also such that squares are beyond f32.
            let scale = if width == 17 { 1e25 } else { 1.0 };
            let pixels = pixels(width, height, alpha, scale);
            let picture = Picture {
                grid: Grid { width, height },
                pixels: &pixels,
                factors: [2.0; LEVELS],
            };
            let mut errors = vec![f32::NAN; width * height];
            picture.standard_errors(&mut errors);
            for (index, &error) in errors.iter().enumerate() {
                let bend = picture.bend(index % width, index / width);
                let expected = 2.0 * EDGE_ERROR * over_channels(bend);
                assert!(
                    (error - expected).abs() <= 1e-6 * expected,
                    "{width}x{height}, {index}: {error} {expected}"
                );
            }
        }
    }
}
