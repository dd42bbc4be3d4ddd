//! Environment maps from files: Radiance HDR, OpenEXR, PNG and JPEG, told apart by content.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageError, ImageReader};

use super::{EquirectMap, load_exr, resample};
use crate::model::Warning;

/// The longest side of a loaded map, texels; larger files are averaged down to it.
pub const MAX_SIDE: u32 = 4096;

/// Larger files are refused by their headers, before anything is allocated: a map of 16384 x 8192 is let in.
const MAX_FILE_TEXELS: u64 = 1 << 27;

/// More than any compression gets into a byte (deflate: at most 1032 : 1, and a texel has several bytes), so that a small
/// damaged file can't make us allocate gigabytes.
const MAX_TEXELS_PER_BYTE: u64 = 1024;

/// Up to here [`MAX_TEXELS_PER_BYTE`] is not asked about.
const ALWAYS_ALLOWED_TEXELS: u64 = 1 << 21;

/// What takes the place of infinity where the map has no larger texel: the largest number of EXR's half format, beyond
/// which it writes infinity.
const LARGEST_HALF: f32 = 65504.0;

/// More than anything shines, and little enough that averages of it stay finite.
pub(crate) const LARGEST_RADIANCE: f32 = 1e30;

/// An environment map read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedMap {
    /// The map, at most [`MAX_SIDE`] texels wide and high.
    pub map: EquirectMap,
    /// What was mended (texels that are no radiance) or made smaller.
    pub warnings: Vec<Warning>,
}

/// An environment map that can't be read.
#[derive(Debug, thiserror::Error)]
#[error("environment map {}: {problem}", path.display())]
pub struct EnvironmentError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: EnvironmentProblem,
}

/// Why an environment map can't be read, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentProblem {
    /// The operating system says no.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// A kind of file that we don't read.
    #[error("{what}; {remedy}")]
    Unsupported {
        /// What is not supported.
        what: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// The contents contradict their format.
    #[error("the file is damaged ({0}); export or download it again")]
    Damaged(String),
    /// More texels than we are ready to allocate, or none.
    #[error(
        "it claims to be {width} x {height} texels, but 1 to {MAX_FILE_TEXELS} in all can be read; scale it to 4096 x 2048"
    )]
    Size {
        /// Texels.
        width: u64,
        /// Texels.
        height: u64,
    },
}

/// Reads an environment map from a `.hdr`, `.exr`, `.png` or `.jpg` file; the content decides, not the name. PNG and JPEG
/// are decoded from sRGB. An EXR is its display window, black outside of its data window. Primaries are taken to be
/// Rec. 709, and Radiance's EXPOSURE line is ignored, as most programs do.
///
/// Texels that are no radiance are mended: NaN and negative numbers become 0, infinity the largest finite number of the
/// map, and no number stays above 1e30. Maps larger than [`MAX_SIDE`] are averaged down, energy kept.
///
/// # Errors
/// What is missing, damaged, unsupported or too large, with the file's name and what to do.
pub fn load_environment(path: &Path) -> Result<LoadedMap, EnvironmentError> {
    // The decoders contain assertions and, in debug builds, overflow checks that damaged files can reach (for one, the
    // run lengths of image's `decode_old_rle`), so a panic in there is one more way to say "damaged".
    let pixels = std::panic::catch_unwind(|| decode(path)).unwrap_or_else(|_| {
        Err(EnvironmentProblem::Damaged(
            "its decoder gave up on it".into(),
        ))
    });
    pixels
        .map(|pixels| pixels.into_map(path))
        .map_err(|problem| EnvironmentError {
            path: path.to_owned(),
            problem,
        })
}

/// Linear RGB as a decoder gave it: of any size, not yet mended.
pub(super) struct Pixels {
    pub width: u32,
    pub height: u32,
    /// `3 * width * height` numbers.
    pub channels: Vec<f32>,
}

impl Pixels {
    fn into_map(mut self, path: &Path) -> LoadedMap {
        let mut warnings = Vec::new();
        let mut warn = |text| {
            warnings.push(Warning {
                place: format!("environment map {}", path.display()),
                text,
            });
        };
        if let Some(text) = mend(&mut self.channels).describe() {
            warn(text);
        }
        let size = (self.width, self.height);
        let to = size_within(size, MAX_SIDE);
        let (texels, _) = self.channels.as_chunks::<3>();
        let map = if to == size {
            EquirectMap {
                width: self.width,
                height: self.height,
                texels: texels.to_vec(),
            }
        } else {
            warn(format!(
                "{} x {} texels were averaged down to {} x {}",
                size.0, size.1, to.0, to.1
            ));
            resample::shrink(texels, size, to)
        };
        LoadedMap { map, warnings }
    }
}

/// The size scaled down, sides in proportion, until neither exceeds `max_side`.
fn size_within((width, height): (u32, u32), max_side: u32) -> (u32, u32) {
    let longest = width.max(height);
    if longest <= max_side {
        return (width, height);
    }
    let scaled = |side: u32| {
        let scaled = u64::from(side) * u64::from(max_side) / u64::from(longest);
        u32::try_from(scaled).unwrap_or(max_side).max(1)
    };
    (scaled(width), scaled(height))
}

/// How many texels had to be mended, and why.
#[derive(Debug, Default, PartialEq, Eq)]
struct Mended {
    not_a_number: usize,
    infinite: usize,
    negative: usize,
}

impl Mended {
    fn describe(&self) -> Option<String> {
        let parts: Vec<String> = [
            (self.not_a_number, "not a number (now 0)"),
            (self.infinite, "infinite (now the largest finite value)"),
            (self.negative, "negative (now 0)"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        (!parts.is_empty()).then(|| format!("texels that are no radiance: {}", parts.join(", ")))
    }
}

/// Makes every number finite and not negative.
fn mend(channels: &mut [f32]) -> Mended {
    let largest = channels
        .iter()
        .copied()
        .filter(|value| value.is_finite())
        .fold(0.0, f32::max);
    let instead_of_infinity = if largest > 0.0 { largest } else { LARGEST_HALF };
    let instead_of_infinity = instead_of_infinity.min(LARGEST_RADIANCE);
    let mut mended = Mended::default();
    for texel in channels.as_chunks_mut::<3>().0 {
        mended.not_a_number += usize::from(texel.iter().any(|value| value.is_nan()));
        mended.infinite += usize::from(texel.contains(&f32::INFINITY));
        mended.negative += usize::from(texel.iter().any(|&value| value < 0.0));
        for value in texel {
            // `max` takes the other operand for NaN.
            *value = value.max(0.0).min(if value.is_finite() {
                LARGEST_RADIANCE
            } else {
                instead_of_infinity
            });
        }
    }
    mended
}

/// Refuses sizes that must not be allocated for a file of `bytes`.
pub(super) fn check_size(
    width: u64,
    height: u64,
    bytes: u64,
) -> Result<(u32, u32), EnvironmentProblem> {
    let texels = width.saturating_mul(height);
    let (Ok(w), Ok(h), 1..=MAX_FILE_TEXELS) = (width.try_into(), height.try_into(), texels) else {
        return Err(EnvironmentProblem::Size { width, height });
    };
    if texels > ALWAYS_ALLOWED_TEXELS && texels / MAX_TEXELS_PER_BYTE > bytes {
        return Err(EnvironmentProblem::Damaged(format!(
            "it claims to be {width} x {height} texels in {bytes} bytes"
        )));
    }
    Ok((w, h))
}

fn decode(path: &Path) -> Result<Pixels, EnvironmentProblem> {
    let file = File::open(path)?;
    let bytes = file.metadata()?.len();
    let mut file = BufReader::new(file);
    let mut magic = Vec::new();
    file.by_ref().take(4).read_to_end(&mut magic)?;
    file.rewind()?;
    match magic.as_slice() {
        [0x76, 0x2f, 0x31, 0x01] => load_exr::decode(file, bytes),
        [b'#', b'?', ..] => decode_hdr(file, bytes),
        _ => decode_low_dynamic_range(file, bytes),
    }
}

fn decode_hdr(file: BufReader<File>, bytes: u64) -> Result<Pixels, EnvironmentProblem> {
    // The strict decoder takes the signature #?RADIANCE alone; #?RGBE is as common.
    let decoder = HdrDecoder::new_nonstrict(file).map_err(image_problem)?;
    let (width, height) = checked_dimensions(&decoder, bytes)?;
    let image = DynamicImage::from_decoder(decoder).map_err(image_problem)?;
    Ok(Pixels {
        width,
        height,
        channels: image.into_rgb32f().into_raw(),
    })
}

fn decode_low_dynamic_range(
    file: BufReader<File>,
    bytes: u64,
) -> Result<Pixels, EnvironmentProblem> {
    let reader = ImageReader::new(file).with_guessed_format()?;
    if reader.format().is_none() {
        return Err(EnvironmentProblem::Unsupported {
            what: "it is no Radiance HDR, OpenEXR, PNG or JPEG file".into(),
            remedy: "convert it to one of them",
        });
    }
    let decoder = reader.into_decoder().map_err(image_problem)?;
    let (width, height) = checked_dimensions(&decoder, bytes)?;
    let image = DynamicImage::from_decoder(decoder).map_err(image_problem)?;
    // 16 bits hold 8-bit images exactly (times 257).
    let encoded = image.into_rgb16().into_raw();
    let channels = encoded
        .into_iter()
        .map(|value| srgb_to_linear(f32::from(value) / f32::from(u16::MAX)))
        .collect();
    Ok(Pixels {
        width,
        height,
        channels,
    })
}

fn checked_dimensions(
    decoder: &impl ImageDecoder,
    bytes: u64,
) -> Result<(u32, u32), EnvironmentProblem> {
    let (width, height) = decoder.dimensions();
    check_size(width.into(), height.into(), bytes)
}

/// IEC 61966-2-1.
fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

fn image_problem(error: ImageError) -> EnvironmentProblem {
    match error {
        ImageError::Unsupported(error) => EnvironmentProblem::Unsupported {
            what: error.to_string(),
            remedy: "convert it to Radiance HDR (rows from the top, -Y +X), OpenEXR, PNG or JPEG",
        },
        ImageError::IoError(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            EnvironmentProblem::Io(error)
        }
        other => EnvironmentProblem::Damaged(other.to_string()),
    }
}

#[cfg(test)]
#[path = "load_tests.rs"]
mod tests;
