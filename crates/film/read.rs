//! Pictures from files, of this program's making or another's, as linear RGB.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

use crate::error::{Fault, FilmError};
use crate::film::Film;
use crate::write::Format;
use crate::{exr_file, png_file};

/// A rectangle of pixels in a picture, from its top left corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A picture to look at or to compare. Lists have `width * height` entries, row after row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear Rec. 709, multiplied by alpha already (what is seen over black). NaN and infinity are kept as they are.
    pub rgb: Vec<[f32; 3]>,
    /// How much of the pixel is covered, if the file says.
    pub alpha: Option<Vec<f32>>,
    /// Where the file has pixels; all others are black and transparent. The whole picture, except for an EXR whose data
    /// window does not fill its display window.
    pub data: Rect,
}

impl Picture {
    /// Reads a PNG or OpenEXR file; its first bytes say which it is.
    ///
    /// PNG: any depth and colour type, taken as sRGB. EXR: the channels `R G B` or `Y` (grey), else those of a layer (the
    /// one named `Combined`, `beauty`, `rgba`, `color` or `image` if there is one); half, float or integer, any compression that the
    /// crate `exr` reads. The picture is the display window; data outside of it is cut off.
    ///
    /// # Errors
    ///
    /// See [`FilmError`]. A damaged file gives an error, and never takes more memory than a sound one of its length might.
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        let unreadable = |source| FilmError::Read {
            path: path.into(),
            source,
        };
        let file = File::open(path).map_err(unreadable)?;
        let budget = Budget::for_file_of(file.metadata().map_err(unreadable)?.len());
        let mut file = BufReader::new(file);
        match format_of(&mut file).map_err(unreadable)? {
            Some(Format::Png) => {
                png_file::decode(file, budget).map_err(|fault| fault.at(path, Format::Png))
            }
            Some(Format::Exr) => {
                exr_file::decode(file, budget).map_err(|fault| fault.at(path, Format::Exr))
            }
            None => Err(FilmError::UnknownFormat { path: path.into() }),
        }
    }

    /// The part of the picture that lies in `rect`, or `None` if `rect` reaches beyond the picture.
    pub fn crop(&self, rect: Rect) -> Option<Self> {
        let fits = |start: u32, length: u32, all: u32| {
            start.checked_add(length).is_some_and(|end| end <= all)
        };
        if !fits(rect.x, rect.width, self.width) || !fits(rect.y, rect.height, self.height) {
            return None;
        }
        let indices = (rect.y..rect.y + rect.height).flat_map(|y| {
            let row = y as usize * self.width as usize;
            (rect.x..rect.x + rect.width).map(move |x| row + x as usize)
        });
        Some(Self {
            width: rect.width,
            height: rect.height,
            rgb: indices.clone().map(|i| self.rgb[i]).collect(),
            alpha: self
                .alpha
                .as_ref()
                .map(|alpha| indices.map(|i| alpha[i]).collect()),
            data: intersection(self.data, rect),
        })
    }
}

/// What of `data` lies in `rect`, seen from `rect`'s corner.
fn intersection(data: Rect, rect: Rect) -> Rect {
    let overlap = |start: u32, length: u32, from: u32, size: u32| {
        let low = start.clamp(from, from + size);
        let high = (start + length).clamp(from, from + size);
        (low - from, high - low)
    };
    let (x, width) = overlap(data.x, data.width, rect.x, rect.width);
    let (y, height) = overlap(data.y, data.height, rect.y, rect.height);
    Rect {
        x,
        y,
        width,
        height,
    }
}

/// A film as others will see it: the rendered window alone, whose data is all there.
impl From<&Film> for Picture {
    fn from(film: &Film) -> Self {
        film.assert_filled();
        Self {
            width: film.width,
            height: film.height,
            rgb: film.radiance.clone(),
            alpha: Some(film.alpha.clone()),
            data: Rect {
                x: 0,
                y: 0,
                width: film.width,
                height: film.height,
            },
        }
    }
}

fn format_of(file: &mut (impl BufRead + Seek)) -> std::io::Result<Option<Format>> {
    let mut start = Vec::new();
    file.by_ref().take(8).read_to_end(&mut start)?;
    file.rewind()?;
    Ok(match start[..] {
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'] => Some(Format::Png),
        [0x76, 0x2f, 0x31, 0x01, ..] => Some(Format::Exr),
        _ => None,
    })
}

/// How much memory a file may ask for: a few damaged bytes can claim a picture of any size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    file: u64,
}

/// Of a decoded pixel: three colours and alpha.
const BYTES_PER_PIXEL: usize = 16;

impl Budget {
    pub(crate) fn for_file_of(bytes: u64) -> Self {
        Self { file: bytes }
    }

    /// The file's own length; nothing in the file can be longer.
    pub(crate) fn file_bytes(self) -> u64 {
        self.file
    }

    /// 256 MiB (4096 x 4096 pixels) whatever the file's length, and beyond that 2000 times it: zlib reaches 1032, and half
    /// floats become twice as long.
    pub(crate) fn bytes(self) -> u64 {
        self.file.saturating_mul(2000).max(256 << 20)
    }

    /// Whether the decoded picture, and the file's data at `stored` bytes a pixel, keep within the budget.
    pub(crate) fn check(self, width: usize, height: usize, stored: usize) -> Result<(), Fault> {
        let pixel = stored.max(BYTES_PER_PIXEL) as u64;
        let bytes = (width as u64)
            .saturating_mul(height as u64)
            .saturating_mul(pixel);
        let limit = self.bytes();
        if bytes > limit {
            return Err(Fault::TooLarge { bytes, limit });
        }
        Ok(())
    }
}
