//! The picture: what a renderer fills in ([`Film`]), where in a pixel it samples ([`sample_pattern`]), how radiance becomes
//! what a screen shows ([`ToneMap`]), pictures to and from files ([`Film::write`], [`Picture::read`]), and how much two
//! pictures differ ([`compare`], [`difference_picture`]).
//!
//! Nothing here knows of the scene or of the GPU. Colours are linear RGB with Rec. 709 primaries wherever nothing else is
//! said; rows run from top to bottom, pixels in a row from left to right.

mod compare;
mod difference;
mod error;
mod exr_file;
mod film;
mod png_file;
mod progressive;
mod read;
mod sampling;
mod tone;
mod whole_file;
mod write;

pub use compare::{BrokenLimit, CompareError, CompareOptions, Comparison, Limits, compare};
pub use difference::{Rgb8Picture, difference_picture};
pub use error::FilmError;
pub use film::{Aovs, Estimates, Film, MISS_DEPTH, NO_ID, Window};
pub use progressive::progressive_pattern;
pub use read::{Picture, Rect};
pub use sampling::{FILTER_RADIUS, ReconstructionFilter, filtered_pattern, sample_pattern};
pub use tone::{ToneMap, quantise_u8, quantise_u16, srgb_decode, srgb_encode};
pub use whole_file::write_whole;
pub use write::{BitDepth, Format, WriteOptions};
