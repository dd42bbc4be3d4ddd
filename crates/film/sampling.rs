//! Where in a pixel the samples lie: a fixed, stratified set of points, the same in every pixel, so that the picture has
//! no noise, warped by the reconstruction filter so that all samples weigh the same.
//!
//! - Points: Kensler 2013, "Correlated Multi-Jittered Sampling", with the jitter left out and golden-ratio permutations for
//!   his shuffles. The plain canonical arrangement lines its points up, and the error on edges fell only as N^-0.6; with
//!   these it falls as N^-0.76, like random jitter in the mean but without its noise (the test below measures it).
//! - Warp: filter importance sampling (Ernst, Stamminger and Greiner 2006; pbrt 4ed 8.8).

use std::f64::consts::PI;

/// Radius of [`ReconstructionFilter::BlackmanHarris`], pixels.
pub const FILTER_RADIUS: f64 = 1.5;

/// How the samples around a pixel's middle make up its value. Both filters are separable and integrate to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ReconstructionFilter {
    /// The pixel's own square, every point of it alike.
    Box,
    /// Harris' four-term window (1978) of radius [`FILTER_RADIUS`]: nearly a Gaussian, never negative, so no ringing.
    BlackmanHarris,
}

/// Harris' coefficients of the minimum four-term window.
const HARRIS: [f64; 4] = [0.35875, 0.48829, 0.14128, 0.01168];

impl ReconstructionFilter {
    /// How far the filter reaches from the pixel's middle along each axis, pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::BlackmanHarris => FILTER_RADIUS,
        }
    }

    /// The filter's value along one axis at `x` pixels from the middle.
    pub fn density(self, x: f64) -> f64 {
        let radius = self.radius();
        if x.abs() > radius {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::BlackmanHarris => {
                let wave = |k: usize| HARRIS[k] * (k as f64 * PI * x / radius).cos();
                (0..4).map(wave).sum::<f64>() / (2.0 * radius * HARRIS[0])
            }
        }
    }

    /// The filter's integral along one axis from its left end to `x` pixels from the middle: 0 to 1.
    pub fn cdf(self, x: f64) -> f64 {
        let radius = self.radius();
        let x = x.clamp(-radius, radius);
        let flat = (x + radius) / (2.0 * radius);
        match self {
            Self::Box => flat,
            Self::BlackmanHarris => {
                let wave = |k: usize| HARRIS[k] / k as f64 * (k as f64 * PI * x / radius).sin();
                flat + (1..4).map(wave).sum::<f64>() / (2.0 * PI * HARRIS[0])
            }
        }
    }

    /// The offset up to which the filter has gathered `share` (0 to 1) of its integral: the inverse of [`Self::cdf`].
    pub fn inverse_cdf(self, share: f64) -> f64 {
        let (mut low, mut high) = (-self.radius(), self.radius());
        // Bisection to the last bit: the pattern is made once a picture, and the filter's flat ends defeat Newton.
        while low < high {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if self.cdf(middle) < share {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// Where a pixel's `spp` samples lie: offsets from the pixel's middle, in pixels, x to the right and y down, each of weight
/// `1 / spp`.
///
/// One sample lies in the middle; more follow the Blackman-Harris filter and reach [`FILTER_RADIUS`] pixels far. The set is
/// symmetric about the middle (its mean is exactly 0, so the picture does not shift) and depends on nothing but `spp`.
/// `spp` = 0 gives no samples.
pub fn sample_pattern(spp: u32) -> Vec<[f32; 2]> {
    match spp {
        1 => filtered_pattern(1, ReconstructionFilter::Box),
        _ => filtered_pattern(spp, ReconstructionFilter::BlackmanHarris),
    }
}

/// As [`sample_pattern`], for a filter of the caller's choice.
pub fn filtered_pattern(spp: u32, filter: ReconstructionFilter) -> Vec<[f32; 2]> {
    let count = spp as usize;
    // Both filters are symmetric: warping the lower half and mirroring makes the set symmetric to the last bit.
    let warp: Vec<f32> = (0..count.div_ceil(2))
        .map(|rank| match 2 * rank + 1 == count {
            true => 0.0,
            false => filter.inverse_cdf((rank as f64 + 0.5) / count as f64) as f32,
        })
        .collect();
    let offset = |rank: usize| match rank < warp.len() {
        true => warp[rank],
        false => -warp[count - 1 - rank],
    };
    stratified_ranks(count)
        .into_iter()
        .map(|[x, y]| [offset(x), offset(y)])
        .collect()
}

/// `count` points of the square `0..count` x `0..count`, one in each column and one in each row (N rooks), symmetric about
/// its middle, and one in each cell of the grid that [`grid`] chooses.
fn stratified_ranks(count: usize) -> Vec<[usize; 2]> {
    let [columns, rows] = grid(count);
    let (in_column, in_row) = (golden_permutation(rows), golden_permutation(columns));
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| {
            [
                column * rows + in_column[row],
                row * columns + in_row[column],
            ]
        })
        .collect()
}

/// Columns and rows of a grid with `count` cells that are at most twice as tall as wide. Where no such grid exists (for
/// primes, say) it is one column, and the golden permutation of its rows is Fibonacci's lattice.
fn grid(count: usize) -> [usize; 2] {
    let columns = (1..=count.isqrt()).rev().find(|c| count.is_multiple_of(*c));
    match columns {
        Some(columns) if count <= 2 * columns * columns => [columns, count / columns],
        _ => [1, count],
    }
}

/// The permutation `k -> (a k + c) mod n` of `0..n` whose step `a` is nearest to the golden section of `n`, so that
/// neighbours land far apart; `c` makes it symmetric: `n - 1 - k` goes to `n - 1 -` the image of `k`.
fn golden_permutation(n: usize) -> Vec<usize> {
    let golden = n as f64 * (5f64.sqrt() - 1.0) / 2.0;
    let distance = |a: &usize| (*a as f64 - golden).abs();
    let step = (1..n)
        .filter(|a| greatest_common_divisor(*a, n) == 1)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(1);
    // Symmetry asks for 2 c = a - 1 (mod n): for even n the coprime a is odd, for odd n one of a - 1 and a - 1 + n is even.
    let twice = if step % 2 == 1 {
        step - 1
    } else {
        step - 1 + n
    };
    (0..n).map(|k| (step * k + twice / 2) % n).collect()
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const FILTERS: [ReconstructionFilter; 2] = [
        ReconstructionFilter::Box,
        ReconstructionFilter::BlackmanHarris,
    ];

    #[test]
    fn one_sample_lies_in_the_middle() {
        assert_eq!(sample_pattern(1), [[0.0, 0.0]]);
        assert!(sample_pattern(0).is_empty());
    }

    #[test]
    fn every_row_column_and_cell_holds_one_sample() {
        for count in 1..=300 {
            let ranks = stratified_ranks(count);
            let [columns, rows] = grid(count);
            assert_eq!(columns * rows, count);
            let mut seen = [vec![0; count], vec![0; count], vec![0; count]];
            for [x, y] in ranks {
                seen[0][x] += 1;
                seen[1][y] += 1;
                seen[2][(y * rows / count) * columns + x * columns / count] += 1;
            }
            assert!(seen.iter().flatten().all(|n| *n == 1), "{count} samples");
        }
    }

    #[test]
    fn the_grid_is_as_square_as_it_can_be() {
        for (count, expected) in [
            (4, [2, 2]),
            (6, [2, 3]),
            (12, [3, 4]),
            (64, [8, 8]),
            (7, [1, 7]),
            (10, [1, 10]),
        ] {
            assert_eq!(grid(count), expected);
        }
    }

    #[test]
    fn the_pattern_is_symmetric_about_the_middle() {
        for count in 1..=300 {
            for filter in FILTERS {
                let pattern = filtered_pattern(count, filter);
                assert_eq!(pattern.len(), count as usize);
                for [x, y] in &pattern {
                    assert!(x.abs().max(y.abs()) <= filter.radius() as f32);
                    assert!(pattern.contains(&[-x, -y]), "{count} samples: {x} {y}");
                }
                // Pairs cancel exactly in f64, whatever the order of summation.
                for axis in 0..2 {
                    let mean: f64 = pattern.iter().map(|p| f64::from(p[axis])).sum();
                    assert!(
                        mean.abs() < 1e-12 * f64::from(count),
                        "{count} samples: {mean}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_cdf_is_the_integral_of_the_density() {
        for filter in FILTERS {
            let (steps, radius) = (20_000, filter.radius());
            let width = 2.0 * radius / f64::from(steps);
            let mut integral = 0.0;
            for step in 0..steps {
                let x = -radius + f64::from(step) * width;
                assert!((filter.cdf(x) - integral).abs() < 1e-8);
                assert!(filter.density(x) >= 0.0);
                integral += filter.density(x + 0.5 * width) * width;
            }
            assert!((integral - 1.0).abs() < 1e-8);
            assert_eq!(filter.density(radius + 0.01), 0.0);
        }
    }

    #[test]
    fn the_inverse_undoes_the_cdf() {
        for filter in FILTERS {
            for step in 0..=1000 {
                let share = f64::from(step) / 1000.0;
                assert!((filter.cdf(filter.inverse_cdf(share)) - share).abs() < 1e-12);
            }
        }
    }

    /// Exact integral of the filter over the half-plane `x cos + y sin <= distance`: midpoints in x, the CDF in y.
    fn half_plane(filter: ReconstructionFilter, angle: f64, distance: f64) -> f64 {
        let (mut cos, mut sin) = (angle.cos(), angle.sin());
        if sin.abs() < cos.abs() {
            (cos, sin) = (sin, cos); // the filter is the same in x and y
        }
        let (steps, radius) = (500, filter.radius());
        let width = 2.0 * radius / f64::from(steps);
        (0..steps)
            .map(|step| {
                let x = -radius + (f64::from(step) + 0.5) * width;
                let below = filter.cdf((distance - x * cos) / sin);
                filter.density(x) * width * if sin > 0.0 { below } else { 1.0 - below }
            })
            .sum()
    }

    /// Edges of many angles and distances from the pixel's middle, each with the filter's exact integral on its one side.
    pub fn edges(filter: ReconstructionFilter) -> Vec<(f64, f64, f64)> {
        let (angles, distances) = (90, 41);
        (0..angles * distances)
            .map(|i| {
                let angle = (f64::from(i / distances) + 0.37) / f64::from(angles) * PI;
                let distance =
                    0.6 * filter.radius() * (f64::from(i % distances) / 20.0 - 1.0) + 0.003;
                (angle, distance, half_plane(filter, angle, distance))
            })
            .collect()
    }

    /// Mean error of `pattern` on `edges`.
    pub fn edge_error(pattern: &[[f32; 2]], edges: &[(f64, f64, f64)]) -> f64 {
        let error = |&(angle, distance, exact): &(f64, f64, f64)| {
            let (sin, cos) = angle.sin_cos();
            let inside = |[x, y]: &&[f32; 2]| f64::from(*x) * cos + f64::from(*y) * sin <= distance;
            (pattern.iter().filter(inside).count() as f64 / pattern.len() as f64 - exact).abs()
        };
        edges.iter().map(error).sum::<f64>() / edges.len() as f64
    }

    /// Slope of the straight line through the points (log spp, log error).
    fn order_of_convergence(counts: &[u32], filter: ReconstructionFilter) -> f64 {
        let edges = edges(filter);
        let error = |n: &u32| edge_error(&filtered_pattern(*n, filter), &edges);
        slope(counts.iter().map(|n| (f64::from(*n), error(n))))
    }

    /// Of the straight line through the logarithms of these points.
    pub fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
        let points: Vec<_> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = points.len() as f64;
        let (mx, my) = points
            .iter()
            .fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
        let covariance: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
        covariance / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
    }

    // N^-3/4 is what jittered sampling reaches on half-planes in the mean (Beck and Chen 1987).
    #[test]
    fn edges_converge_at_least_as_fast_as_jittered_sampling() {
        let squares = [
            4, 9, 16, 25, 36, 49, 64, 81, 100, 121, 144, 169, 196, 225, 256,
        ];
        let others = [5, 7, 8, 12, 13, 20, 32, 37, 64, 72, 97, 128, 211, 256];
        for counts in [&squares[..], &others] {
            let order = order_of_convergence(counts, ReconstructionFilter::BlackmanHarris);
            assert!(order <= -0.75, "error falls as N^{order}");
        }
    }

    #[test]
    fn the_edge_error_is_small_in_absolute_terms() {
        let filter = ReconstructionFilter::BlackmanHarris;
        let edges = edges(filter);
        for (count, limit) in [(4, 0.085), (16, 0.033), (64, 0.0105), (256, 0.0036)] {
            let error = edge_error(&sample_pattern(count), &edges);
            assert!(error < limit, "{count} samples: {error}");
        }
    }
}
