//! How good estimates are, learned while pixels are refined: by how much a pixel's mean has changed says how far it was off before, and
//! that can be held against what was said of it.
//!
//! The samples before are half of those after: if `e` was the error of the mean before, and that of the new half is as large and independent
//! of it, the mean changes by `e / sqrt 2` (root mean square); by more where errors fall faster, as halves then make up for each other.

/// Levels that are told apart.
pub(crate) const LEVELS: usize = 16;

/// Pixels that have to have been refined before they are believed.
const ENOUGH: u64 = 32;

/// How much larger than found errors are said to be: of the pixels that were not refined nobody knows what they would have shown.
/// Measured: tests/tolerance.rs.
const CAUTION: f64 = 2.0;

/// No estimate is changed by more.
const RANGE: std::ops::RangeInclusive<f64> = 0.25..=2.5;

/// Squares of what was said and of what was found, by level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Calibration {
    said: [f64; LEVELS],
    found: [f64; LEVELS],
    pixels: [u64; LEVELS],
}

impl Calibration {
    /// Of a pixel at `level`: the error that was said, uncalibrated, and the change of its mean, as estimates count it.
    pub(crate) fn learn(&mut self, level: u32, said: f32, change: f32) {
        let level = (level as usize).min(LEVELS - 1);
        self.said[level] += f64::from(said).powi(2);
        self.found[level] += f64::from(change).powi(2);
        self.pixels[level] += 1;
    }

    /// What errors that are said of pixels at each level are to be multiplied by: for those of whom nothing is known, by what the
    /// level below says.
    pub(crate) fn factors(&self) -> [f32; LEVELS] {
        let mut before = CAUTION;
        std::array::from_fn(|level| {
            if self.pixels[level] >= ENOUGH && self.said[level] > 0.0 {
                let ratio = 2.0 * self.found[level] / self.said[level];
                before = (CAUTION * ratio.sqrt()).clamp(*RANGE.start(), *RANGE.end());
            }
            before as f32
        })
    }
}

/// How much was lost of what was said: of samples that were taken twice, the second time with less left out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Losses {
    said: f64,
    found: f64,
    /// What was said times what was found, mean over the channels and with its sign.
    along: f64,
    /// With anything to find.
    pixels: u64,
    /// Of all first samples.
    before: f64,
    all: u64,
}

/// Samples that have to have been taken twice before they are believed.
const ENOUGH_LOSSES: u64 = 8;

/// How much larger than found losses are said to be.
const LOSS_CAUTION: f64 = 2.0;

/// Of what branches bring in the mean, by how much any sum of them is off at least.
const LEAST_SPREAD: f64 = 0.25;

impl Losses {
    /// What the first sample of a pixel is said to have lost, by how much less the second, by how much they differ (root mean square over
    /// the channels), and by how much more the second has brought (mean over them).
    pub(crate) fn learn(&mut self, before: f32, said: f32, found: f32, brought: f32) {
        self.before += f64::from(before).powi(2);
        self.all += 1;
        if said > 0.0 {
            self.said += f64::from(said).powi(2);
            self.found += f64::from(found).powi(2);
            self.along += f64::from(said) * f64::from(brought);
            self.pixels += 1;
        }
    }

    /// What first samples are said to have lost: root mean square.
    pub(crate) fn said_before(&self) -> f32 {
        (self.before / self.all.max(1) as f64).sqrt() as f32
    }

    fn is_enough(&self) -> bool {
        self.pixels >= ENOUGH_LOSSES && self.said > 0.0
    }

    /// What is brought in the mean, of what is said to be lost: by least squares.
    pub(crate) fn mean(&self) -> f32 {
        if self.is_enough() {
            (self.along / self.said).max(0.0) as f32
        } else {
            0.0
        }
    }

    /// What is to be said of losses where the mean is shown in their place, of what was said.
    pub(crate) fn factor(&self) -> f32 {
        if !self.is_enough() {
            return LOSS_CAUTION as f32;
        }
        let mean = f64::from(self.mean());
        let rest = (self.found / self.said - mean.powi(2)).max(0.0).sqrt();
        (LOSS_CAUTION * rest.max(LEAST_SPREAD * mean)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_that_are_too_large_are_made_smaller_and_the_other_way_round() {
        let factor = |change: f32| {
            let mut calibration = Calibration::default();
            (0..100).for_each(|_| calibration.learn(2, 1.0, change));
            calibration.factors()
        };
        let exact = std::f32::consts::FRAC_1_SQRT_2;
        assert!((factor(exact)[2] - CAUTION as f32).abs() < 1e-5);
        assert!(factor(0.25 * exact)[2] < 1.0);
        assert!(factor(2.0 * exact)[2] > 2.0);
        // Levels above know no better, levels below know nothing.
        assert_eq!(factor(exact)[9], factor(exact)[2]);
        assert_eq!(factor(exact)[1], CAUTION as f32);
    }

    #[test]
    fn a_few_pixels_say_nothing() {
        let mut calibration = Calibration::default();
        (1..ENOUGH).for_each(|_| calibration.learn(0, 1.0, 0.1));
        assert_eq!(calibration.factors()[0], CAUTION as f32);
    }

    #[test]
    fn losses_are_what_was_found_of_their_bound() {
        let losses = |found: f32, brought: [f32; 2]| {
            let mut losses = Losses::default();
            (0..ENOUGH_LOSSES).for_each(|k| losses.learn(0.1, 0.1, found, brought[k as usize % 2]));
            losses
        };
        // As much more as less: nothing is known of the mean.
        assert!((losses(0.01, [0.01, -0.01]).factor() - 0.2).abs() < 1e-6);
        assert!((losses(0.3, [0.3, -0.3]).factor() - 6.0).abs() < 1e-6);
        assert_eq!(losses(0.3, [0.3, -0.3]).mean(), 0.0);
        // Always as much: that is what can be shown, and little remains.
        let same = losses(0.05, [0.05; 2]);
        assert!((same.mean() - 0.5).abs() < 1e-6);
        assert!((same.factor() - 2.0 * 0.5 * LEAST_SPREAD as f32).abs() < 1e-6);
        assert_eq!(Losses::default().factor(), LOSS_CAUTION as f32);
        assert_eq!(Losses::default().mean(), 0.0);
    }
}
