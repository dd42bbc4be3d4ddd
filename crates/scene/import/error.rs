//! What can go wrong with a file, and the warnings about what could be mended.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::model::Warning;

/// Why a file could not be imported. One line each: the file, the place in it, what is wrong, what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file, or one that it names, could not be read.
    #[error("{}: {place}: cannot be read: {source}; check that the file is there, and beside the scene if the scene names it", .file.display())]
    Io {
        /// The scene file.
        file: PathBuf,
        /// Which file: "the scene file", or what names it and its path.
        place: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The file breaks the glTF 2.0 specification, or is cut short.
    #[error("{}: {place}: {problem}; export the file again, the Khronos glTF Validator lists all that is wrong with it", .file.display())]
    Invalid {
        /// The scene file.
        file: PathBuf,
        /// Where in it: "accessors\[3\]", "node 4 'wheel'".
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// The file is valid but needs something that this importer does not have.
    #[error("{}: {place}: {problem}", .file.display())]
    Unsupported {
        /// The scene file.
        file: PathBuf,
        /// Where in it: "extension KHR_draco_mesh_compression".
        place: String,
        /// What is missing and how to do without.
        problem: String,
    },
    /// The scene is larger than [`ImportOptions`](super::ImportOptions) allows.
    #[error("{}: {place}: {problem}", .file.display())]
    Limit {
        /// The scene file.
        file: PathBuf,
        /// What is too large.
        place: String,
        /// By how much, and what to do.
        problem: String,
    },
}

/// An [`ImportError`] that does not know its file yet.
#[derive(Debug)]
pub(super) struct Fault {
    kind: Kind,
    place: String,
    problem: String,
}

#[derive(Debug)]
enum Kind {
    Io(io::Error),
    Invalid,
    Unsupported,
    Limit,
}

/// What every step of the import returns.
pub(super) type Outcome<T> = Result<T, Fault>;

impl Fault {
    pub(super) fn io(place: impl Display, source: io::Error) -> Self {
        Self::new(Kind::Io(source), place, "")
    }

    pub(super) fn invalid(place: impl Display, problem: impl Display) -> Self {
        Self::new(Kind::Invalid, place, problem)
    }

    pub(super) fn unsupported(place: impl Display, problem: impl Display) -> Self {
        Self::new(Kind::Unsupported, place, problem)
    }

    pub(super) fn limit(place: impl Display, problem: impl Display) -> Self {
        Self::new(Kind::Limit, place, problem)
    }

    fn new(kind: Kind, place: impl Display, problem: impl Display) -> Self {
        Self {
            kind,
            place: one_line(&place.to_string()),
            problem: one_line(&problem.to_string()),
        }
    }

    pub(super) fn in_file(self, file: &Path) -> ImportError {
        let Self {
            kind,
            place,
            problem,
        } = self;
        let file = file.to_owned();
        match kind {
            Kind::Io(source) => ImportError::Io {
                file,
                place,
                source,
            },
            Kind::Invalid => ImportError::Invalid {
                file,
                place,
                problem,
            },
            Kind::Unsupported => ImportError::Unsupported {
                file,
                place,
                problem,
            },
            Kind::Limit => ImportError::Limit {
                file,
                place,
                problem,
            },
        }
    }
}

/// What the importer had to leave out or mend, in the order in which it met it.
#[derive(Debug, Default)]
pub(super) struct Warnings(pub(super) Vec<Warning>);

impl Warnings {
    pub(super) fn push(&mut self, place: impl Display, text: impl Display) {
        self.0.push(Warning {
            place: one_line(&place.to_string()),
            text: one_line(&text.to_string()),
        });
    }
}

/// Names and URIs come from the file: they may hold line breaks, terminal escapes or megabytes.
fn one_line(text: &str) -> String {
    const LONGEST: usize = 300;
    let mut line: String = text
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        line.push_str("...");
    }
    line
}
