//! Light of every strength from every distance: right where the answer is a number that f32 has, and finite everywhere.

mod glare;
mod wall;

use crate::stage::{Stage, StressError};

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    wall::strengths(stage)?;
    wall::near(stage)?;
    wall::many(stage)?;
    glare::in_a_ball(stage)?;
    glare::emission(stage)?;
    glare::environment(stage)
}

/// Pixels with a channel that is infinite or not a number.
fn not_finite(radiance: &[[f32; 3]]) -> usize {
    let finite = |pixel: &&[f32; 3]| pixel.iter().all(|channel| channel.is_finite());
    radiance.len() - radiance.iter().filter(finite).count()
}

/// The larger; NaN counts as infinite.
fn worse(largest: f64, other: f64) -> f64 {
    if other.is_nan() {
        f64::INFINITY
    } else {
        largest.max(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparisons have to be able to fail.
    #[test]
    fn what_is_not_finite_is_counted() {
        assert_eq!(not_finite(&[[1.0; 3], [3e38; 3]]), 0);
        assert_eq!(
            not_finite(&[[1.0; 3], [0.0, f32::NAN, 0.0], [f32::INFINITY; 3]]),
            2
        );
        assert_eq!(worse(1.0, 2.0), 2.0);
        assert_eq!(worse(1.0, f64::NAN), f64::INFINITY);
        assert_eq!(worse(f64::INFINITY, 1.0), f64::INFINITY);
    }
}
