//! The order of anti-aliasing: the error on an edge falls as N^-3/4, as jittered sampling's does in the mean (Beck and Chen 1987), and
//! so faster than the N^-1/2 that independent samples have.

use std::f64::consts::PI;

use raytree_converge::order_of_convergence;
use raytree_film::{ReconstructionFilter, sample_pattern};

const FILTER: ReconstructionFilter = ReconstructionFilter::BlackmanHarris;

/// Squares of whole numbers, whose patterns are the best, from 4 samples on: one has another filter.
const COUNTS: [u32; 9] = [4, 9, 16, 25, 36, 64, 100, 144, 256];

/// An edge through a pixel: the side on which `x cos + y sin <= distance`.
struct Edge {
    cos: f64,
    sin: f64,
    distance: f64,
    /// The filter's integral over that side.
    share: f64,
}

/// Edges of every direction and distance at which the filter sees them.
fn edges() -> Vec<Edge> {
    let (angles, distances) = (60, 31);
    let edge = |i: u32| {
        let angle = (f64::from(i / distances) + 0.37) / f64::from(angles) * PI;
        let across = f64::from(i % distances) / 15.0 - 1.0;
        let distance = 0.6 * FILTER.radius() * across + 0.003;
        let (sin, cos) = angle.sin_cos();
        Edge {
            cos,
            sin,
            distance,
            share: share(cos, sin, distance),
        }
    };
    (0..angles * distances).map(edge).collect()
}

/// Midpoints along one axis, the exact integral along the other, which is the one that the edge is steeper to.
fn share(cos: f64, sin: f64, distance: f64) -> f64 {
    let (cos, sin) = match sin.abs() < cos.abs() {
        true => (sin, cos),
        false => (cos, sin),
    };
    let steps = 400;
    let width = 2.0 * FILTER.radius() / f64::from(steps);
    let strip = |step: u32| {
        let x = (f64::from(step) + 0.5) * width - FILTER.radius();
        let below = FILTER.cdf((distance - x * cos) / sin);
        FILTER.density(x) * width * if sin > 0.0 { below } else { 1.0 - below }
    };
    (0..steps).map(strip).sum()
}

/// Root of the mean squared error of a pattern on all edges.
fn rmse(pattern: &[[f32; 2]], edges: &[Edge]) -> f64 {
    let squared = |edge: &Edge| {
        let inside = |[x, y]: &&[f32; 2]| {
            f64::from(*x) * edge.cos + f64::from(*y) * edge.sin <= edge.distance
        };
        let found = pattern.iter().filter(inside).count() as f64 / pattern.len() as f64;
        (found - edge.share).powi(2)
    };
    (edges.iter().map(squared).sum::<f64>() / edges.len() as f64).sqrt()
}

fn order(pattern: impl Fn(u32) -> Vec<[f32; 2]>) -> raytree_converge::Order {
    let edges = edges();
    let points: Vec<(f64, f64)> = COUNTS
        .iter()
        .map(|n| (f64::from(*n), rmse(&pattern(*n), &edges)))
        .collect();
    order_of_convergence(&points).expect("nine points have an order")
}

#[test]
fn edges_converge_as_n_to_the_three_quarters() {
    let found = order(sample_pattern);
    assert!(found.low > 0.7, "{found:?}");
    assert!((0.72..0.85).contains(&found.order), "{found:?}");
}

/// The same measurement has to tell when it is not so: samples drawn independently (by a small generator of whole numbers) from the
/// same filter have the order 1/2.
#[test]
fn independent_samples_are_told_from_ours() {
    let mut state = 1_u64;
    let mut random = move || {
        // Knuth's MMIX.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let edges = edges();
    let points: Vec<(f64, f64)> = COUNTS
        .iter()
        .map(|n| {
            // The mean of many draws: a single one's error varies by half.
            let draws = 30;
            let squares: f64 = (0..draws)
                .map(|_| {
                    let pattern: Vec<[f32; 2]> = (0..*n)
                        .map(|_| [(); 2].map(|()| FILTER.inverse_cdf(random()) as f32))
                        .collect();
                    rmse(&pattern, &edges).powi(2)
                })
                .sum();
            (f64::from(*n), (squares / f64::from(draws)).sqrt())
        })
        .collect();
    let found = order_of_convergence(&points).expect("nine points have an order");
    assert!((0.42..0.58).contains(&found.order), "{found:?}");
    assert!(found.high < 0.65, "{found:?}");
}
