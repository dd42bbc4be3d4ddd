//! How far a pixel's mean is off by what lies between its samples.
//!
//! From its second round on a pixel has groups of samples, each spread over the filter as all of them are; how much they disagree says
//! how much their mean is off (batch means; Schmeiser 1982). It may be chance that they agree, so a pixel hears its neighbours too: the filter
//! reaches 1.5 pixels far, so what one sees another sees as well.
//!
//! A pixel with its middle sample alone has nothing to compare but its neighbours' values: by how much it lies off the straight line
//! between two that are opposite to each other. Along a smooth gradient that is nothing, and the filter is symmetric, so that
//! its mean is the value in the middle then.

use crate::pixel::{Groups, Pixel};

/// Of the second difference across an edge, the error of a single sample in the middle of the pixels at its sides, about: calibration
/// makes it right.
const EDGE_ERROR: f32 = 0.25;

/// Power of the number of samples by which errors fall, of which variances have twice.
const ORDER: f32 = 0.75;

/// A picture's pixels, all that estimates see.
pub(crate) struct Picture<'p> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: &'p [Pixel],
    pub(crate) groups: &'p [Groups],
    /// Of all pixels.
    pub(crate) means: &'p [[f32; 3]],
}

impl Picture<'_> {
    /// The standard error of a pixel's mean, root mean square over its channels, uncalibrated.
    pub(crate) fn standard_error(&self, x: usize, y: usize) -> f32 {
        let pixel = &self.pixels[y * self.width + x];
        let variance = self.own_variance(pixel);
        match variance {
            Some(own) => own.max(self.variance_around(x, y, pixel.count)).sqrt(),
            None => EDGE_ERROR * self.bend(x, y),
        }
    }

    fn own_variance(&self, pixel: &Pixel) -> Option<f32> {
        pixel
            .refined
            .map(|index| self.groups[index as usize].variance)
    }

    /// The mean variance of a pixel and its neighbours, as it would be with `count` samples.
    fn variance_around(&self, x: usize, y: usize, count: u32) -> f32 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for row in y.saturating_sub(1)..(y + 2).min(self.height) {
            for column in x.saturating_sub(1)..(x + 2).min(self.width) {
                let pixel = &self.pixels[row * self.width + column];
                if let Some(variance) = self.own_variance(pixel) {
                    let scale = (pixel.count as f32 / count as f32).powf(2.0 * ORDER);
                    sum += variance * scale;
                    weight += 1.0;
                }
            }
        }
        sum / f32::max(weight, 1.0)
    }

    /// The largest second difference through a pixel: along rows, columns and both diagonals. At the picture's edge, the
    /// first difference.
    fn bend(&self, x: usize, y: usize) -> f32 {
        let here = self.means[y * self.width + x];
        let at = |dx: isize, dy: isize| {
            let column = x
                .checked_add_signed(dx)
                .filter(|&column| column < self.width)?;
            let row = y.checked_add_signed(dy).filter(|&row| row < self.height)?;
            Some(self.means[row * self.width + column])
        };
        [(1, 0), (0, 1), (1, 1), (1, -1)]
            .into_iter()
            .map(|(dx, dy)| match (at(dx, dy), at(-dx, -dy)) {
                (Some(a), Some(b)) => over_channels(|c| a[c] - 2.0 * here[c] + b[c]),
                (Some(a), None) | (None, Some(a)) => over_channels(|c| a[c] - here[c]),
                (None, None) => 0.0,
            })
            .fold(0.0, f32::max)
    }
}

/// Root mean square over the channels, as pictures are judged.
pub(crate) fn over_channels(difference: impl Fn(usize) -> f32) -> f32 {
    let square = |channel| f64::from(difference(channel)).powi(2);
    ((square(0) + square(1) + square(2)) / 3.0).sqrt() as f32
}
