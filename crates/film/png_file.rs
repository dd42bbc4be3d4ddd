//! PNG: what a screen shows, sRGB encoded, 8 or 16 bits a channel, straight alpha.

use std::io::{BufRead, Seek};

use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::error::ImageError;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, Limits};
use rayon::prelude::*;

use crate::error::Fault;
use crate::film::Film;
use crate::read::{Budget, Picture, Rect};
use crate::tone::{ToneMap, quantise_u8, quantise_u16, srgb_decode, srgb_encode};
use crate::write::{BitDepth, WriteOptions};

/// The film's window as a PNG file's bytes.
pub(crate) fn encode_film(film: &Film, options: &WriteOptions) -> Result<Vec<u8>, String> {
    let gain = options.exposure.exp2();
    let channels_shown = if options.alpha { 4 } else { 3 };
    let pixels = film.radiance.par_iter().zip(&film.alpha);
    let channels = pixels.flat_map_iter(|(radiance, alpha)| {
        let alpha = if options.alpha { *alpha } else { 1.0 };
        let [r, g, b] = displayed(*radiance, alpha, gain, options.tone);
        [r, g, b, alpha].into_iter().take(channels_shown)
    });
    let (bytes, color): (Vec<u8>, _) = match (options.png_bits, options.alpha) {
        (BitDepth::Eight, alpha) => (
            channels.map(quantise_u8).collect(),
            if alpha {
                ExtendedColorType::Rgba8
            } else {
                ExtendedColorType::Rgb8
            },
        ),
        // The encoder takes 16-bit channels in the machine's own byte order.
        (BitDepth::Sixteen, alpha) => (
            channels
                .flat_map_iter(|c| quantise_u16(c).to_ne_bytes())
                .collect(),
            if alpha {
                ExtendedColorType::Rgba16
            } else {
                ExtendedColorType::Rgb16
            },
        ),
    };
    encode(film.width, film.height, &bytes, color)
}

/// A pixel's encoded colour. Radiance carries alpha already; straight alpha takes it out, before the curve, which isn't linear.
fn displayed(radiance: [f32; 3], alpha: f32, gain: f32, tone: ToneMap) -> [f32; 3] {
    let scale = if alpha > 0.0 { gain / alpha } else { 0.0 };
    tone.apply(radiance.map(|c| c * scale)).map(srgb_encode)
}

/// A PNG file's bytes from channels as `color` says, row after row. Quickly rather than tightly: files are a seventh to a third larger than
/// by the default of the encoder, in less than half of its time.
pub(crate) fn encode(
    width: u32,
    height: u32,
    bytes: &[u8],
    color: ExtendedColorType,
) -> Result<Vec<u8>, String> {
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, width, height, color)
        .map_err(|error| error.to_string())?;
    Ok(file)
}

/// Reads any PNG: grey, palette or RGB of any depth, with or without alpha, taken as sRGB whatever its colour chunks say.
pub(crate) fn decode(file: impl BufRead + Seek, budget: Budget) -> Result<Picture, Fault> {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(budget.bytes());
    let decoder = PngDecoder::with_limits(file, limits).map_err(fault)?;
    let (width, height) = decoder.dimensions();
    budget.check(width as usize, height as usize, 0)?;
    let has_alpha = decoder.color_type().has_alpha();
    let pixels = DynamicImage::from_decoder(decoder)
        .map_err(fault)?
        .into_rgba32f();

    let associate = |p: &image::Rgba<f32>| [0, 1, 2].map(|c| srgb_decode(p.0[c]) * p.0[3]);
    Ok(Picture {
        width,
        height,
        rgb: pixels.pixels().map(associate).collect(),
        alpha: has_alpha.then(|| pixels.pixels().map(|p| p.0[3]).collect()),
        data: Rect {
            x: 0,
            y: 0,
            width,
            height,
        },
    })
}

fn fault(error: ImageError) -> Fault {
    match error {
        ImageError::IoError(io) if io.kind() != std::io::ErrorKind::UnexpectedEof => Fault::Io(io),
        ImageError::Unsupported(what) => Fault::Unsupported(what.to_string()),
        other => Fault::Damaged(other.to_string()),
    }
}
