//! Two pictures and their difference side by side, to look at.

use std::path::Path;

use image::ExtendedColorType;

use crate::compare::{CompareError, channel_differences, encode_srgb, same_size};
use crate::error::FilmError;
use crate::png_file;
use crate::read::Picture;
use crate::write::save;

/// A picture of 8-bit sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgb8Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` colours, row after row from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl Rgb8Picture {
    /// Writes the picture as PNG, whatever the name; whole or not at all.
    ///
    /// # Errors
    ///
    /// [`FilmError::Encode`] (an empty picture) or [`FilmError::Write`].
    pub fn write_png(&self, path: &Path) -> Result<(), FilmError> {
        let bytes = self.pixels.as_flattened();
        save(
            path,
            png_file::encode(self.width, self.height, bytes, ExtendedColorType::Rgb8),
        )
    }
}

/// Marks a pixel with a NaN or an infinity: green does not occur in the ramp.
const NON_FINITE: [u8; 3] = [0, 255, 0];

/// The difference that is black, and below; each quarter of the ramp is ten times more, up to 1.
const LEAST_SHOWN: f64 = 1e-4;

/// `expected`, `actual` and their difference from left to right, three times as wide as the pictures.
///
/// The pictures are clipped to [0, 1]. The difference is that of the largest channel, in linear radiance after clipping, on
/// a logarithmic scale in the colours of magma: 0.0001 and less black, 0.001 violet, 0.01 red-violet, 0.1 orange, 1 pale
/// yellow; green where either has a NaN or an infinity.
///
/// # Errors
///
/// [`CompareError`] if the sizes differ or the pictures are empty.
pub fn difference_picture(
    expected: &Picture,
    actual: &Picture,
) -> Result<Rgb8Picture, CompareError> {
    same_size(expected, actual)?;
    let shown = [expected, actual].map(|picture| encode_srgb(&picture.rgb));
    let ramp = nv_flip::magma_lut().to_vec();
    let difference: Vec<u8> = expected
        .rgb
        .iter()
        .zip(&actual.rgb)
        .flat_map(|(a, b)| false_color(*a, *b, &ramp))
        .collect();

    let row = 3 * expected.width as usize;
    let rows = shown[0]
        .chunks(row)
        .zip(shown[1].chunks(row))
        .zip(difference.chunks(row));
    let bytes: Vec<u8> = rows.flat_map(|((a, b), d)| [a, b, d].concat()).collect();
    Ok(Rgb8Picture {
        width: 3 * expected.width,
        height: expected.height,
        pixels: bytes.as_chunks().0.to_vec(),
    })
}

fn false_color(a: [f32; 3], b: [f32; 3], ramp: &[u8]) -> [u8; 3] {
    if !a.iter().chain(&b).all(|c| c.is_finite()) {
        return NON_FINITE;
    }
    let largest = channel_differences(a, b, true)
        .into_iter()
        .fold(0.0, f64::max);
    let decades = (largest.max(LEAST_SHOWN) / LEAST_SHOWN).log10();
    let last = ramp.len() / 3 - 1;
    let entry = 3 * ((decades / -LEAST_SHOWN.log10() * last as f64).round() as usize).min(last);
    [ramp[entry], ramp[entry + 1], ramp[entry + 2]]
}
