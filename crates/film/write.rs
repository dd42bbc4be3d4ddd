//! Pictures into files: which format, with which settings.

use std::fmt;
use std::path::Path;

use crate::error::FilmError;
use crate::film::Film;
use crate::tone::ToneMap;
use crate::whole_file::write_whole;
use crate::{exr_file, png_file};

/// A picture file's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Portable Network Graphics: what a screen shows, sRGB.
    Png,
    /// OpenEXR: linear radiance as 32-bit floats and all layers, without loss.
    Exr,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Exr => "OpenEXR",
        })
    }
}

impl Format {
    /// The format that a file of this name gets, by its ending in any case. A special file such as `/dev/null` has no ending
    /// and gets a PNG.
    ///
    /// # Errors
    ///
    /// [`FilmError::UnknownEnding`] for every other name.
    pub fn of_path(path: &Path) -> Result<Self, FilmError> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            None if is_special(path) => Ok(Self::Png),
            _ => Err(FilmError::UnknownEnding { path: path.into() }),
        }
    }
}

fn is_special(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|data| !data.is_file() && !data.is_dir())
}

/// Bits of each channel of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BitDepth {
    /// 256 steps.
    #[default]
    Eight,
    /// 65536 steps: smooth gradients, less error when the picture is compared.
    Sixteen,
}

/// How a film becomes a file. All but the format concerns PNG alone: an EXR is the radiance itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// The curve from radiance to the screen's range.
    pub tone: ToneMap,
    /// Stops: radiance is multiplied by 2 to this power before the curve.
    pub exposure: f32,
    /// Bits of each channel.
    pub png_bits: BitDepth,
    /// Whether to write an alpha channel (straight alpha, as PNG has it) rather than the picture over black.
    pub alpha: bool,
}

impl Film {
    /// Writes the film to `path`, in the format that the name's ending says ([`Format::of_path`]).
    ///
    /// The file is whole or untouched, whatever happens; its bytes depend on the film, the options and the version alone. A
    /// film that is a window of a larger picture becomes a PNG of the window, and an EXR whose data window lies in the
    /// whole picture's display window.
    ///
    /// # Errors
    ///
    /// [`FilmError::UnknownEnding`], [`FilmError::Encode`] (an empty picture, say) or [`FilmError::Write`].
    ///
    /// # Panics
    ///
    /// If a layer has not `width * height` entries, which is a bug in what filled the film.
    pub fn write(&self, path: &Path, options: &WriteOptions) -> Result<(), FilmError> {
        self.assert_filled();
        let encoded = match Format::of_path(path)? {
            Format::Png => png_file::encode_film(self, options),
            Format::Exr => exr_file::encode_film(self),
        };
        save(path, encoded)
    }
}

/// Writes an encoded picture, or reports for `path` why there is none.
pub(crate) fn save(path: &Path, encoded: Result<Vec<u8>, String>) -> Result<(), FilmError> {
    let bytes = encoded.map_err(|reason| FilmError::Encode {
        path: path.into(),
        reason,
    })?;
    write_whole(path, |file| file.write_all(&bytes)).map_err(|source| FilmError::Write {
        path: path.into(),
        source,
    })
}
