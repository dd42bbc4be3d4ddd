//! What is handed on when sampling has ended.

use raytree_film::Estimates;

use crate::estimate::difference;
use crate::grid::Grid;
use crate::pixel::Pixels;
use crate::report::ErrorReport;
use crate::standing::root_mean_square;

/// A picture whose sampling has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// Mean of each pixel's samples.
    pub radiance: Vec<[f32; 3]>,
    /// Coverage: mean, 0 to 1 but for rounding.
    pub alpha: Vec<f32>,
    /// Rays that each pixel took.
    pub rays: Vec<u32>,
    /// What each pixel is said to be off by, and its samples.
    pub estimates: Estimates,
    /// What was achieved.
    pub report: ErrorReport,
}

/// Gives pixels without a sample what one shows that is near. Of what they are off by nothing is known but how pixels differ.
pub(crate) fn show_neighbours(grid: Grid, pixels: &mut Pixels, errors: &mut [f32]) {
    let sampled: Vec<bool> = pixels.counts().iter().map(|&count| count > 0).collect();
    let values = (0..sampled.len())
        .filter(|&index| sampled[index])
        .map(|index| pixels.mean(index));
    let count = values.clone().count();
    let average = |channel: usize| {
        let sum: f64 = values.clone().map(|mean| f64::from(mean[channel])).sum();
        (sum / count.max(1) as f64) as f32
    };
    let middle = [0, 1, 2, 3].map(average);
    let deviations = values.clone().map(|mean| difference(mean, middle));
    let spread = match count {
        0 => 1.0,
        _ => root_mean_square(deviations) as f32,
    };
    for index in 0..sampled.len() {
        if sampled[index] {
            continue;
        }
        let near = grid.near(index).into_iter().find(|&near| sampled[near]);
        let shown = near.map_or(middle, |near| pixels.mean(near));
        pixels.show(index, shown);
        errors[index] = spread;
    }
}
