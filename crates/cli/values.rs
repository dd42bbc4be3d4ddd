//! Values of arguments from text; what they refuse, they say what is allowed.

use glam::{DVec3, Vec3};
use std::time::Duration;

use raytree::{Background, Region, Tolerance, srgb_decode};

/// The longest side of a picture, pixels.
const LONGEST_SIDE: u32 = 65536;

/// The brightest constant light or background, linear.
const BRIGHTEST: f64 = 1e6;

/// The farthest coordinate of a camera, metres: as far as a scene may reach.
const FARTHEST: f64 = 1e18;

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// `--camera`.
#[derive(Clone, Debug)]
pub enum CameraChoice {
    /// Frame the scene.
    Auto,
    /// The file's camera of this name or number.
    Named(String),
}

/// A threshold, and the share of pixels that may be off by more.
#[derive(Clone, Copy, Debug)]
pub struct OutlierLimit {
    pub threshold: f64,
    pub share: f64,
}

/// A parser of finite numbers from `min` to `max`.
pub fn number(min: f64, max: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| number_within(text, min, max)
}

/// A parser of whole numbers from `min` to `max`.
pub fn integer(min: u32, max: u32) -> impl Fn(&str) -> Result<u32, String> + Clone {
    move |text| integer_within(text, min, max)
}

fn number_within(text: &str, min: f64, max: f64) -> Result<f64, String> {
    let value = text.trim().parse().ok();
    // NaN is in no range.
    value
        .filter(|value| (min..=max).contains(value))
        .ok_or_else(|| format!("'{text}' is not a number from {min} to {max}"))
}

fn integer_within(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let value = text.trim().parse().ok();
    value
        .filter(|value| (min..=max).contains(value))
        .ok_or_else(|| format!("'{text}' is not a whole number from {min} to {max}"))
}

/// `0.01`, linear radiance, or `1%` of each pixel's own.
pub fn tolerance(text: &str) -> Result<Tolerance, String> {
    let error = |text, most| {
        number_within(text, 1e-6, most)
            .map(|error| error as f32)
            .map_err(|_| format!("'{text}' is not a number from 0.000001 to {most}"))
    };
    match text.trim().strip_suffix('%') {
        Some(percent) => error(percent, 1e6).map(|percent| Tolerance::relative(percent / 100.0)),
        None => error(text, 1e6)
            .map(Tolerance::absolute)
            .map_err(|problem| format!("{problem}, or a percentage as in 1%")),
    }
}

/// `2s`, `500ms`, `1.5m`; plain numbers are seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let text = text.trim();
    let units = [
        ("ms", 1e-3),
        ("s", 1.0),
        ("min", 60.0),
        ("m", 60.0),
        ("h", 3600.0),
    ];
    let found = units
        .iter()
        .find_map(|(unit, seconds)| Some((text.strip_suffix(unit)?, *seconds)));
    let (number, unit) = found.unwrap_or((text, 1.0));
    let seconds = number.trim().parse().ok().map(|value: f64| value * unit);
    seconds
        .filter(|seconds| *seconds > 0.0 && *seconds <= 1e7)
        .map(Duration::from_secs_f64)
        .ok_or_else(|| {
            format!("'{text}' is not a time above 0; write it as in 2s, 500ms or 1.5min")
        })
}

/// `640x480`.
pub fn size(text: &str) -> Result<Size, String> {
    let (width, height) = text
        .split_once(['x', 'X'])
        .ok_or("write width and height as in 640x480")?;
    let side = |text| integer_within(text, 1, LONGEST_SIDE);
    Ok(Size {
        width: side(width)?,
        height: side(height)?,
    })
}

/// `x,y,w,h`.
pub fn region(text: &str) -> Result<Region, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let &[x, y, width, height] = parts.as_slice() else {
        return Err("write left, top, width and height in pixels as in 100,50,64,48".to_owned());
    };
    Ok(Region {
        x: integer_within(x, 0, LONGEST_SIDE - 1)?,
        y: integer_within(y, 0, LONGEST_SIDE - 1)?,
        width: integer_within(width, 1, LONGEST_SIDE)?,
        height: integer_within(height, 1, LONGEST_SIDE)?,
    })
}

/// `auto`, or a camera's name or number.
pub fn camera(text: &str) -> Result<CameraChoice, String> {
    Ok(match text {
        "auto" => CameraChoice::Auto,
        _ => CameraChoice::Named(text.to_owned()),
    })
}

/// `x,y,z`.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let [x, y, z] = triple(text, -FARTHEST, FARTHEST)?;
    Ok(DVec3::new(x, y, z))
}

/// `r,g,b` or one grey, linear.
pub fn color(text: &str) -> Result<Vec3, String> {
    let [r, g, b] = if text.contains(',') {
        triple(text, 0.0, BRIGHTEST)?
    } else {
        [number_within(text, 0.0, BRIGHTEST)?; 3]
    };
    Ok(DVec3::new(r, g, b).as_vec3())
}

fn triple(text: &str, min: f64, max: f64) -> Result<[f64; 3], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let &[a, b, c] = parts.as_slice() else {
        return Err("three numbers with commas between them are wanted, as in 1,0.5,0".to_owned());
    };
    let number = |text| number_within(text, min, max);
    Ok([number(a)?, number(b)?, number(c)?])
}

/// `env`, `transparent`, `#rrggbb` (sRGB) or a linear colour.
pub fn background(text: &str) -> Result<Background, String> {
    Ok(match text {
        "env" => Background::Environment,
        "transparent" => Background::Transparent,
        _ => Background::Color(match text.strip_prefix('#') {
            Some(digits) => hex_color(digits)?,
            None => color(text)
                .map_err(|error| format!("{error}; or write env, transparent or #rrggbb"))?,
        }),
    })
}

fn hex_color(digits: &str) -> Result<Vec3, String> {
    if digits.len() != 6 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err("write an sRGB colour with six hexadecimal digits, as in #ff8000".to_owned());
    }
    let rgb = u32::from_str_radix(digits, 16).map_err(|error| error.to_string())?;
    let channel = |shift: u32| srgb_decode(f32::from((rgb >> shift) as u8) / 255.0);
    Ok(Vec3::new(channel(16), channel(8), channel(0)))
}

/// `threshold:share`.
pub fn outlier_limit(text: &str) -> Result<OutlierLimit, String> {
    let (threshold, share) = text.split_once(':').ok_or(
        "write threshold and share as in 0.02:0.001 (at most 0.1 % off by more than 0.02)",
    )?;
    Ok(OutlierLimit {
        threshold: number_within(threshold, 0.0, 1e9)?,
        share: number_within(share, 0.0, 1.0)?,
    })
}
