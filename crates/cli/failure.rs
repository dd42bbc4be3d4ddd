//! Why the program ends, and the exit code that says so.

use raytree::{
    CompareError, DeviceError, EnvironmentError, FilmError, ImportError, RenderError, ViewError,
};

/// A comparison failed, or an output could not be written.
pub const FAILED: u8 = 1;
/// The command line makes no sense, by itself or for this scene.
pub const USAGE: u8 = 2;
/// No device, or it was lost.
pub const DEVICE: u8 = 3;
/// The scene, an environment or a picture can't be read.
pub const UNREADABLE: u8 = 4;
/// A limit of the device or of the program.
pub const LIMIT: u8 = 5;
/// Ended by a signal: 128 and the number of SIGINT, as shells have it.
pub const INTERRUPTED: u8 = 130;

/// The command line asks for what this scene does not have, or for what contradicts itself.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Ctrl-C, or a request to terminate.
#[derive(Debug, thiserror::Error)]
#[error("interrupted; every output is as it was before, or whole")]
pub struct Interrupted;

/// The exit code of an error that reached `main`.
pub fn exit_code(error: &anyhow::Error) -> u8 {
    if error.is::<Usage>() || error.is::<ViewError>() {
        USAGE
    } else if error.is::<Interrupted>() {
        INTERRUPTED
    } else if error.is::<DeviceError>() {
        DEVICE
    } else if error.is::<EnvironmentError>() {
        UNREADABLE
    } else if let Some(error) = error.downcast_ref::<ImportError>() {
        of_import(error)
    } else if let Some(error) = error.downcast_ref::<RenderError>() {
        of_render(error)
    } else if let Some(error) = error.downcast_ref::<FilmError>() {
        of_film(error)
    } else if let Some(CompareError::TooLargeForFlip { .. }) = error.downcast_ref() {
        LIMIT
    } else {
        FAILED
    }
}

fn of_import(error: &ImportError) -> u8 {
    match error {
        ImportError::Limit { .. } => LIMIT,
        _ => UNREADABLE,
    }
}

fn of_render(error: &RenderError) -> u8 {
    match error {
        RenderError::Device(_) => DEVICE,
        RenderError::TooLarge { .. } | RenderError::Media(_) | RenderError::Bvh(_) => LIMIT,
        RenderError::Settings(_) => USAGE,
        _ => FAILED,
    }
}

fn of_film(error: &FilmError) -> u8 {
    match error {
        FilmError::UnknownEnding { .. } => USAGE,
        FilmError::Read { .. }
        | FilmError::UnknownFormat { .. }
        | FilmError::Damaged { .. }
        | FilmError::Unsupported { .. }
        | FilmError::TooLarge { .. } => UNREADABLE,
        _ => FAILED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_device_has_no_room_for_is_a_limit() {
        let too_large = RenderError::TooLarge {
            buffer: "leaf_vertices".to_owned(),
            bytes: 3 << 20,
            limit: 2 << 20,
        };
        let message = too_large.to_string();
        assert!(message.contains("3 MiB for `leaf_vertices`"), "{message}");
        assert_eq!(exit_code(&too_large.into()), LIMIT);
    }
}
