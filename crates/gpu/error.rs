//! Why there is no picture.

use raytree_bvh::BvhError;

use crate::{device::DeviceError, program::ProgramError, upload::TooManyMedia};

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No device, or it failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The shaders are broken.
    #[error("internal error in the shaders: {0}; please report it")]
    Program(#[from] ProgramError),
    /// The hierarchy can't be built.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// Too many media.
    #[error(transparent)]
    Media(#[from] TooManyMedia),
    /// A buffer or table is larger than the device can hold.
    #[error("the scene needs {} MiB for `{buffer}`, but this device holds at most {} MiB of it; use fewer triangles or smaller textures, or another --device", bytes.div_ceil(1 << 20), limit >> 20)]
    TooLarge {
        /// Its name in `shaders/bindings.wgsl`.
        buffer: String,
        /// What it would hold.
        bytes: u64,
        /// What the device holds.
        limit: u64,
    },
    /// A setting makes no sense.
    #[error("{0}")]
    Settings(String),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}
