//! Pictures for textures, painted by formula.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// An RGBA picture, 8 bits a channel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    width: u32,
    height: u32,
    texels: Vec<[u8; 4]>,
}

impl Pixels {
    /// Paints a picture: `paint(u, v)` gives RGBA in [0, 1], encoded as it shall be stored, at a texel's middle;
    /// (0, 0) is the upper left corner, (1, 1) the lower right.
    #[must_use]
    pub fn paint(width: u32, height: u32, paint: impl Fn(f64, f64) -> [f64; 4]) -> Self {
        let texels = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let color = paint(
                    (f64::from(x) + 0.5) / f64::from(width),
                    (f64::from(y) + 0.5) / f64::from(height),
                );
                color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
            })
            .collect();
        Self {
            width,
            height,
            texels,
        }
    }

    /// Squares of two colours, `n` by `n` of them, one texel each.
    #[must_use]
    pub fn checker(n: u32, even: [f64; 3], odd: [f64; 3]) -> Self {
        let cell = |x: f64| (x * f64::from(n)) as u32;
        Self::paint(n, n, |u, v| {
            opaque(if (cell(u) + cell(v)).is_multiple_of(2) {
                even
            } else {
                odd
            })
        })
    }

    /// A tangent-space normal map of `height(u, v)`, in units of the picture's side; it must go on over the borders.
    #[must_use]
    pub fn bumps(size: u32, height: impl Fn(f64, f64) -> f64) -> Self {
        let d = 0.5 / f64::from(size);
        Self::paint(size, size, |u, v| {
            let slope = glam::DVec2::new(
                height(u + d, v) - height(u - d, v),
                // v runs down the picture, the bitangent up.
                height(u, v - d) - height(u, v + d),
            ) / (2.0 * d);
            let n = slope.extend(-1.0).normalize() * -0.5 + 0.5;
            [n.x, n.y, n.z, 1.0]
        })
    }

    /// As a PNG; without an alpha channel where all is opaque.
    ///
    /// # Panics
    ///
    /// Never: writing to memory does not fail, and the texels fit the size.
    #[must_use]
    pub fn to_png(&self) -> Vec<u8> {
        let (color, bytes): (_, Vec<u8>) = if self.texels.iter().all(|texel| texel[3] == 255) {
            (
                ExtendedColorType::Rgb8,
                self.texels
                    .iter()
                    .flat_map(|&[r, g, b, _]| [r, g, b])
                    .collect(),
            )
        } else {
            (
                ExtendedColorType::Rgba8,
                self.texels.iter().copied().flatten().collect(),
            )
        };
        let mut png = Vec::new();
        PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
            .write_image(&bytes, self.width, self.height, color)
            .expect("a PNG of matching size is written to memory");
        png
    }
}

/// A colour without transparency.
#[must_use]
pub fn opaque([r, g, b]: [f64; 3]) -> [f64; 4] {
    [r, g, b, 1.0]
}

/// From `a` to `b` as `t` goes from 0 to 1.
#[must_use]
pub fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// Smooth noise in [0, 1] over a lattice of unit cells that repeats after `period` cells.
#[must_use]
pub fn noise(x: f64, y: f64, period: i64) -> f64 {
    let (cell, smooth) = (
        |t: f64| t.floor() as i64,
        |t: f64| (t - t.floor()).powi(2) * (3.0 - 2.0 * (t - t.floor())),
    );
    let corner = |i: i64, j: i64| {
        hash(
            (cell(x) + i).rem_euclid(period),
            (cell(y) + j).rem_euclid(period),
        )
    };
    let row = |j: i64| corner(0, j) + (corner(1, j) - corner(0, j)) * smooth(x);
    row(0) + (row(1) - row(0)) * smooth(y)
}

/// A number in [0, 1) that looks random.
fn hash(x: i64, y: i64) -> f64 {
    let mut bits = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    // The finaliser of SplitMix64.
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}
