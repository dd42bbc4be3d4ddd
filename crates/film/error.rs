//! What can go wrong between a picture and a file.

use std::io;
use std::path::{Path, PathBuf};

use crate::write::Format;

/// Why a picture could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// The name does not say which format to write.
    #[error(
        "{}: can't tell the picture's format from this name; end it in .png (8 or 16 bit) or .exr (linear, all layers)",
        path.display()
    )]
    UnknownEnding {
        /// Where the picture should have gone.
        path: PathBuf,
    },
    /// The picture could not be put into the format.
    #[error("{}: the picture can't be encoded: {reason}", path.display())]
    Encode {
        /// Where the picture should have gone.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
    /// The file could not be written; what was there before is untouched.
    #[error(
        "{}: can't be written: {source}; check that its folder exists, may be written to, and has room",
        path.display()
    )]
    Write {
        /// Where the picture should have gone.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file could not be read.
    #[error("{}: can't be read: {source}; check the name and that you may read it", path.display())]
    Read {
        /// The picture's file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is of no format that is read.
    #[error("{}: neither a PNG nor an OpenEXR file by its first bytes; convert it to one of them", path.display())]
    UnknownFormat {
        /// The picture's file.
        path: PathBuf,
    },
    /// The file's contents contradict themselves or break off.
    #[error("{}: damaged {format}: {reason}; write or copy it again", path.display())]
    Damaged {
        /// The picture's file.
        path: PathBuf,
        /// What the file is.
        format: Format,
        /// What the decoder said.
        reason: String,
    },
    /// A sound file that uses something that is not read.
    #[error("{}: {what}; save it as a flat RGB or grey picture", path.display())]
    Unsupported {
        /// The picture's file.
        path: PathBuf,
        /// What is not read.
        what: String,
    },
    /// The file claims more pixels than a file of its length plausibly holds.
    #[error(
        "{}: claims {bytes} bytes of pixels, more than the {limit} allowed for a file of its length; it is damaged, or to be made smaller",
        path.display()
    )]
    TooLarge {
        /// The picture's file.
        path: PathBuf,
        /// Memory that the decoded picture would take.
        bytes: u64,
        /// Memory that it may take.
        limit: u64,
    },
}

/// What a decoder reports; the caller knows the path.
#[derive(Debug)]
pub(crate) enum Fault {
    Io(io::Error),
    Damaged(String),
    Unsupported(String),
    TooLarge { bytes: u64, limit: u64 },
}

impl Fault {
    pub(crate) fn at(self, path: &Path, format: Format) -> FilmError {
        let path = path.to_owned();
        match self {
            Fault::Io(source) => FilmError::Read { path, source },
            Fault::Damaged(reason) => FilmError::Damaged {
                path,
                format,
                reason,
            },
            Fault::Unsupported(what) => FilmError::Unsupported { path, what },
            Fault::TooLarge { bytes, limit } => FilmError::TooLarge { path, bytes, limit },
        }
    }
}
