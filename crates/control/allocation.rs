//! Which pixels get more samples: those where they make the picture's mean square error fall most for what they cost.
//!
//! With `n` rays a pixel's square error is `v = c n^-3/2`. Of all ways to spread rays over pixels that leave the same sum of square
//! errors, that with the fewest has the same `v / n` in all pixels that get any (Lagrange: the derivative of `v` by `n`). So a
//! pixel is refined if its `v / n` is above a threshold; the threshold is that for which the sum comes out as wanted when every pixel
//! has been brought down to it, `v (threshold n / v)^(3/5)`.

/// Steps of the threshold to an octave, and where they begin and end, octaves.
const STEPS: f32 = 4.0;
const LEAST: f32 = -80.0;
const BINS: usize = 640;

/// What is left of `v` where `v / n` is brought down: a power of the quotient of both.
const REMAINING: f64 = 0.6;

/// A pixel's square error, in any unit, and the rays that it took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) square: f32,
    pub(crate) rays: u32,
}

impl Candidate {
    /// What refining it is worth.
    pub(crate) fn worth(self) -> f32 {
        self.square / self.rays as f32
    }
}

/// The worth above which pixels are to be refined so that the sum of all squares falls to `wanted`; `None` if it is that already.
/// Of candidates that can't be refined any more (`is_final`), all remains.
pub(crate) fn threshold(
    candidates: impl Iterator<Item = (Candidate, bool)>,
    wanted: f64,
) -> Option<f32> {
    let mut whole = vec![0.0; BINS];
    let mut scaled = vec![0.0; BINS];
    let mut remaining = 0.0;
    for (candidate, is_final) in candidates {
        let square = f64::from(candidate.square);
        if is_final || candidate.worth() <= 0.0 || candidate.worth().is_nan() {
            remaining += square;
            continue;
        }
        let bin = bin_of(candidate.worth());
        whole[bin] += square;
        scaled[bin] += square * f64::from(candidate.worth()).powf(-REMAINING);
    }
    let below: f64 = whole.iter().sum();
    if remaining + below <= wanted {
        return None;
    }
    // From above: what is refined is what lies above the threshold.
    let (mut above, mut below) = (0.0, below);
    for bin in (0..BINS).rev() {
        above += scaled[bin];
        below -= whole[bin];
        let threshold = lower_edge(bin);
        let sum = remaining + below + above * f64::from(threshold).powf(REMAINING);
        if above > 0.0 && sum <= wanted {
            return Some(threshold);
        }
    }
    // All of them, and it is not enough: once more, and see.
    Some(0.0)
}

fn bin_of(worth: f32) -> usize {
    (STEPS * (worth.log2() - LEAST)).clamp(0.0, (BINS - 1) as f32) as usize
}

fn lower_edge(bin: usize) -> f32 {
    (bin as f32 / STEPS + LEAST).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(squares: &[f32]) -> impl Iterator<Item = (Candidate, bool)> {
        squares
            .iter()
            .map(|&square| (Candidate { square, rays: 1 }, false))
    }

    #[test]
    fn what_is_good_enough_is_left_alone() {
        assert_eq!(threshold(of(&[1e-4; 100]), 0.02), None);
        assert!(threshold(of(&[1e-4; 100]), 0.005).is_some());
    }

    #[test]
    fn the_worst_pixels_come_first() {
        let mut squares = vec![1e-6; 1000];
        squares.extend([1.0; 10]);
        let threshold = threshold(of(&squares), 0.1).expect("10 is more than 0.1");
        assert!(threshold > 1e-6 && threshold < 1.0, "{threshold}");
    }

    /// Brought down to the threshold, pixels add up to what is wanted.
    #[test]
    fn the_sum_comes_out_as_wanted() {
        let squares: Vec<f32> = (1..1000).map(|k| 1.0 / k as f32).collect();
        let wanted = 0.5;
        let threshold = f64::from(threshold(of(&squares), wanted).expect("7.5 is more than 0.5"));
        let remaining: f64 = squares
            .iter()
            .map(|&square| f64::from(square))
            .map(|square| square * (threshold / square).min(1.0).powf(REMAINING))
            .sum();
        assert!(
            remaining <= 1.01 * wanted && remaining > 0.85 * wanted,
            "{remaining}"
        );
    }

    #[test]
    fn what_can_not_be_refined_is_no_reason_to_refine_others_for_ever() {
        let candidates = [(
            Candidate {
                square: 1.0,
                rays: 9,
            },
            true,
        )];
        assert_eq!(threshold(candidates.into_iter(), 0.5), Some(0.0));
    }
}
