//! How much two pictures differ, in numbers, and whether that is too much.

use std::cmp::Ordering;
use std::fmt;

use crate::read::Picture;
use crate::tone::{quantise_u8, srgb_encode};

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareOptions {
    /// Clip both pictures to [0, 1] first, so that highlights that no screen shows don't outweigh everything else.
    pub clip: bool,
    /// Count the pixels that differ by more than each of these.
    pub thresholds: Vec<f64>,
    /// Compute FLIP too, which takes ten times longer than all the rest (a second or two for a million pixels).
    pub flip: bool,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            clip: true,
            thresholds: vec![0.02],
            flip: true,
        }
    }
}

/// The differences of two pictures, in linear radiance (white = 1).
///
/// Pixels with a NaN or an infinity in either picture count in [`Self::non_finite`] and among the outliers, and are left out
/// of everything else.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Pixels compared.
    pub pixels: usize,
    /// Root of the mean squared difference over all pixels and channels.
    pub rmse: f64,
    /// Relative mean squared difference, the mean over all pixels and channels of `(a - b)^2 / (a^2 + 0.01)` with `a` what is
    /// expected: what is off by a tenth counts alike in light and in shade (as in Rousselle, Knaus and Zwicker 2011), and the
    /// 0.01 keeps black from counting for infinitely much.
    pub relative_mse: f64,
    /// Mean absolute difference over all pixels and channels.
    pub mean_abs: f64,
    /// The largest absolute difference of any channel of any pixel.
    pub max_abs: f64,
    /// 99th percentile: the least value that the largest channel's difference does not exceed in 99 % of the pixels.
    pub p99_abs: f64,
    /// The largest difference in alpha; a picture without alpha counts as opaque.
    pub max_alpha: f64,
    /// Mean FLIP (Andersson et al. 2020) of the pictures clipped to [0, 1] and encoded as sRGB, at 67 pixels a degree: 0 same, 1
    /// as different as can be. `None` if it was not asked for.
    pub flip_mean: Option<f64>,
    /// For each threshold asked for, in order: the threshold, and the share (0 to 1) of pixels whose largest channel
    /// difference exceeds it.
    pub outliers: Vec<(f64, f64)>,
    /// Pixels with a NaN or an infinity in either picture.
    pub non_finite: usize,
}

/// Why two pictures can't be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The pictures' sizes differ.
    #[error(
        "the pictures' sizes differ: {}x{} and {}x{}; render or crop them to the same size",
        expected.0, expected.1, actual.0, actual.1
    )]
    Sizes {
        /// Width and height of the first.
        expected: (u32, u32),
        /// Width and height of the second.
        actual: (u32, u32),
    },
    /// There is nothing to compare.
    #[error("the pictures have no pixels")]
    Empty,
    /// FLIP counts bytes in 32 bits.
    #[error(
        "{pixels} pixels are too many for FLIP, which takes {limit}; compare without FLIP, or compare parts"
    )]
    TooLargeForFlip {
        /// Pixels in each picture.
        pixels: usize,
        /// Pixels that FLIP takes.
        limit: usize,
    },
}

/// More would overflow the 32-bit sizes inside of FLIP, which keeps three floats for each pixel.
const MOST_FLIP_PIXELS: usize = i32::MAX as usize / 12;

/// Added to squared radiance before it divides, see [`Comparison::relative_mse`].
const RELATIVE_FLOOR: f64 = 0.01;

/// Measures how `actual` differs from `expected`; all but FLIP and the relative mean square is symmetric.
///
/// # Errors
///
/// [`CompareError`] if the sizes differ or the pictures are empty, or too large for FLIP if it is asked for.
pub fn compare(
    expected: &Picture,
    actual: &Picture,
    options: &CompareOptions,
) -> Result<Comparison, CompareError> {
    same_size(expected, actual)?;
    let pixels = expected.rgb.len();
    let pairs = || expected.rgb.iter().zip(&actual.rgb);
    // The largest channel's difference of each pixel; `None` where it is no number.
    let mut largest: Vec<Option<f64>> = Vec::with_capacity(pixels);
    let (mut sum, mut squares, mut relative_squares) = (0.0, 0.0, 0.0);
    for (a, b) in pairs() {
        if !a.iter().chain(b).all(|c| c.is_finite()) {
            largest.push(None);
            continue;
        }
        let differences = channel_differences(*a, *b, options.clip);
        sum += differences.iter().sum::<f64>();
        squares += differences.iter().map(|d| d * d).sum::<f64>();
        relative_squares += relative_squares_of(*a, differences, options.clip);
        largest.push(Some(differences.into_iter().fold(0.0, f64::max)));
    }
    let share = |count: usize| count as f64 / pixels as f64;
    let beyond = |threshold: f64| {
        largest
            .iter()
            .filter(|d| d.is_none_or(|d| d > threshold))
            .count()
    };
    let outliers = options
        .thresholds
        .iter()
        .map(|t| (*t, share(beyond(*t))))
        .collect();
    let mut finite: Vec<f64> = largest.iter().copied().flatten().collect();
    let channels = (3 * finite.len()).max(1) as f64;
    Ok(Comparison {
        pixels,
        rmse: (squares / channels).sqrt(),
        relative_mse: relative_squares / channels,
        mean_abs: sum / channels,
        max_abs: finite.iter().copied().fold(0.0, f64::max),
        p99_abs: percentile_99(&mut finite),
        max_alpha: largest_alpha_difference(expected, actual),
        flip_mean: options
            .flip
            .then(|| flip_mean(expected, actual))
            .transpose()?,
        outliers,
        non_finite: pixels - finite.len(),
    })
}

pub(crate) fn same_size(expected: &Picture, actual: &Picture) -> Result<(), CompareError> {
    let sizes = [expected, actual].map(|picture| (picture.width, picture.height));
    if sizes[0] != sizes[1] {
        return Err(CompareError::Sizes {
            expected: sizes[0],
            actual: sizes[1],
        });
    }
    if expected.rgb.is_empty() {
        return Err(CompareError::Empty);
    }
    Ok(())
}

/// Sum over the channels of the squared difference over what is expected, squared.
fn relative_squares_of(expected: [f32; 3], differences: [f64; 3], clip: bool) -> f64 {
    let relative = |c: usize| {
        let value = channel_value(expected[c], clip);
        differences[c] * differences[c] / (value * value + RELATIVE_FLOOR)
    };
    (0..3).map(relative).sum()
}

/// Absolute differences of finite colours, in f64 so that the sums over a picture keep their digits.
pub(crate) fn channel_differences(a: [f32; 3], b: [f32; 3], clip: bool) -> [f64; 3] {
    [0, 1, 2].map(|c| (channel_value(a[c], clip) - channel_value(b[c], clip)).abs())
}

fn channel_value(channel: f32, clip: bool) -> f64 {
    f64::from(if clip {
        channel.clamp(0.0, 1.0)
    } else {
        channel
    })
}

/// Nearest rank: the `ceil(0.99 n)`th smallest of `n` values.
fn percentile_99(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = (values.len() * 99).div_ceil(100);
    *values.select_nth_unstable_by(rank - 1, f64::total_cmp).1
}

fn largest_alpha_difference(a: &Picture, b: &Picture) -> f64 {
    let alpha = |picture: &Picture, i: usize| {
        picture
            .alpha
            .as_ref()
            .map_or(1.0, |alpha| f64::from(alpha[i]))
    };
    (0..a.rgb.len())
        .map(|i| (alpha(a, i) - alpha(b, i)).abs())
        // `f64::max` would lose a NaN, which has to stay once it is there.
        .fold(0.0, |max, d| if max.is_nan() || d <= max { max } else { d })
}

fn flip_mean(expected: &Picture, actual: &Picture) -> Result<f64, CompareError> {
    if expected.rgb.len() > MOST_FLIP_PIXELS {
        return Err(CompareError::TooLargeForFlip {
            pixels: expected.rgb.len(),
            limit: MOST_FLIP_PIXELS,
        });
    }
    let image = |picture: &Picture| {
        nv_flip::FlipImageRgb8::with_data(picture.width, picture.height, &encode_srgb(&picture.rgb))
    };
    let map = nv_flip::flip(
        image(expected),
        image(actual),
        nv_flip::DEFAULT_PIXELS_PER_DEGREE,
    );
    let errors = map.to_vec();
    Ok(errors.iter().map(|e| f64::from(*e)).sum::<f64>() / errors.len() as f64)
}

/// What a screen shows of linear colours without any tone curve; NaN shows black.
pub(crate) fn encode_srgb(rgb: &[[f32; 3]]) -> Vec<u8> {
    rgb.iter()
        .flatten()
        .map(|c| quantise_u8(srgb_encode(c.clamp(0.0, 1.0))))
        .collect()
}

/// How much two pictures may differ; what is `None` or empty may be anything. Non-finite pixels are never allowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// For [`Comparison::rmse`].
    pub max_rmse: Option<f64>,
    /// For [`Comparison::mean_abs`].
    pub max_mean: Option<f64>,
    /// For [`Comparison::max_abs`].
    pub max_abs: Option<f64>,
    /// For [`Comparison::p99_abs`].
    pub max_p99: Option<f64>,
    /// For [`Comparison::max_alpha`].
    pub max_alpha: Option<f64>,
    /// For [`Comparison::flip_mean`].
    pub max_flip: Option<f64>,
    /// Thresholds, and the share (0 to 1) of pixels that may exceed each.
    pub max_outliers: Vec<(f64, f64)>,
}

/// A limit that a comparison broke.
#[derive(Clone, Debug, PartialEq)]
pub struct BrokenLimit {
    /// What was measured.
    pub what: String,
    /// What came out; NaN if the comparison did not measure it.
    pub value: f64,
    /// What was allowed.
    pub limit: f64,
}

impl fmt::Display for BrokenLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, value, limit } = self;
        if value.is_nan() {
            write!(f, "{what} was not measured or is no number (limit {limit})")
        } else {
            write!(f, "{what} is {value:.6}, above its limit of {limit}")
        }
    }
}

impl Limits {
    /// The least that has to be measured to check these limits.
    pub fn options(&self, clip: bool) -> CompareOptions {
        CompareOptions {
            clip,
            thresholds: self
                .max_outliers
                .iter()
                .map(|(threshold, _)| *threshold)
                .collect(),
            flip: self.max_flip.is_some(),
        }
    }

    /// The limits that `comparison` breaks; none if all is well. A limit on something that was not measured is broken.
    pub fn check(&self, comparison: &Comparison) -> Vec<BrokenLimit> {
        let c = comparison;
        let numbers = [
            ("root mean square difference", c.rmse, self.max_rmse),
            ("mean absolute difference", c.mean_abs, self.max_mean),
            ("largest difference", c.max_abs, self.max_abs),
            ("99th percentile of the difference", c.p99_abs, self.max_p99),
            ("largest difference in alpha", c.max_alpha, self.max_alpha),
            ("mean FLIP", c.flip_mean.unwrap_or(f64::NAN), self.max_flip),
        ];
        let numbers = numbers
            .into_iter()
            .filter_map(|(what, value, limit)| Some((what.to_owned(), value, limit?)));
        let outliers = self.max_outliers.iter().map(|(threshold, limit)| {
            let measured = c.outliers.iter().find(|(t, _)| t == threshold);
            let what = format!("share of pixels off by more than {threshold}");
            (what, measured.map_or(f64::NAN, |(_, share)| *share), *limit)
        });
        let non_finite = (
            "pixels with NaN or infinity".to_owned(),
            c.non_finite as f64,
            0.0,
        );
        numbers
            .chain(outliers)
            .chain([non_finite])
            // Not `value > limit`, which a NaN on either side would pass.
            .filter(|(_, value, limit)| !value.partial_cmp(limit).is_some_and(Ordering::is_le))
            .map(|(what, value, limit)| BrokenLimit { what, value, limit })
            .collect()
    }
}
