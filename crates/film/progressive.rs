//! Where in a pixel the samples of a picture lie of which nobody knows beforehand how many a pixel will take: one sequence, of which
//! every beginning of odd length is well spread and symmetric about the pixel's middle.
//!
//! Points: an additive recurrence, from the middle outwards in both directions at once: 0, +1, -1, +2, -2, ... times its step. Any run
//! of it is spread alike, so the samples +-(a+1) .. +-b are as good a set of their own as all of them are together, which is what
//! error estimates compare. The step is among the best of 4,000 for edges of all directions and places (mean error of 5 to 4,097 samples;
//! 7 % less than with the plastic number's, Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
//! Warp: as in [`crate::sample_pattern`].

use crate::sampling::ReconstructionFilter;

/// From a sample to the next, in shares of the filter's integral along x and y.
const STEP: [f64; 2] = [0.136_923_789_606_976_15, 0.814_344_691_916_103_7];

/// The first `count` offsets from the pixel's middle, in pixels, x to the right and y down: the middle, then pairs that mirror each
/// other, following the Blackman-Harris filter.
pub fn progressive_pattern(count: u32) -> Vec<[f32; 2]> {
    let filter = ReconstructionFilter::BlackmanHarris;
    let pairs =
        (1..=count / 2).map(|k| STEP.map(|step| warp(filter, (0.5 + f64::from(k) * step).fract())));
    let mirrored = pairs.flat_map(|[x, y]| [[x, y], [-x, -y]]);
    let pattern = std::iter::once([0.0; 2]).chain(mirrored);
    pattern.take(count as usize).collect()
}

/// As [`ReconstructionFilter::inverse_cdf`], to f32's precision: a picture may want a hundred thousand of them.
fn warp(filter: ReconstructionFilter, share: f64) -> f32 {
    let (mut low, mut high) = (-filter.radius(), filter.radius());
    for _ in 0..28 {
        let middle = 0.5 * (low + high);
        if filter.cdf(middle) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::tests::{edge_error, edges, slope};

    #[test]
    fn it_begins_in_the_middle_and_every_odd_beginning_is_symmetric() {
        let pattern = progressive_pattern(4097);
        assert_eq!(pattern[0], [0.0; 2]);
        for pair in pattern[1..].chunks(2) {
            assert_eq!(pair[0].map(|c| -c), pair[1]);
        }
        assert_eq!(progressive_pattern(0), Vec::<[f32; 2]>::new());
        assert_eq!(progressive_pattern(9), pattern[..9]);
    }

    #[test]
    fn every_pixel_of_the_filter_is_reached() {
        let reach = |axis: usize| {
            let pattern = progressive_pattern(1025);
            pattern.iter().map(|p| p[axis].abs()).fold(0.0, f32::max)
        };
        for axis in [0, 1] {
            assert!(reach(axis) > 1.1 && reach(axis) <= 1.5);
        }
    }

    // N^-3/4 is what jittered sampling reaches on half-planes in the mean (Beck and Chen 1987); measured: N^-0.747.
    #[test]
    fn edges_converge_as_fast_as_jittered_sampling() {
        let filter = ReconstructionFilter::BlackmanHarris;
        let edges = edges(filter);
        let counts: Vec<u32> = (1..=11).map(|k| 1 + (2 << k)).collect();
        let points = counts.iter().map(|&count| {
            let error = edge_error(&progressive_pattern(count), &edges);
            (f64::from(count), error)
        });
        let order = slope(points);
        assert!(order <= -0.74, "error falls as N^{order}");
    }
}
