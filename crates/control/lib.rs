//! Error control: which pixels need more samples for a tolerance to be kept, and by how much each of them is off.
//!
//! A pixel's error has two parts. What branches of ray trees were left out because they can't matter is said by the
//! renderer, sample by sample ([`Sampled::lost`]), as a bound that is scaled by what a few samples have shown. What samples miss that lie between them is estimated from those that were
//! taken, as an ODE solver does from two formulas of a step (`estimate.rs`). A [`Sampler`] orders samples round by
//! round until the root mean square of both parts over the picture fits the tolerance.
//!
//! Nothing here knows of rays: samples are values at places of a picture.

mod allocation;
mod calibration;
mod estimate;
mod finished;
mod grid;
mod groups;
mod negligible;
mod pixel;
mod report;
mod round;
mod sampler;
mod standing;
mod tolerance;

pub use finished::Finished;
pub use negligible::Negligible;
pub use pixel::Sampled;
pub use report::ErrorReport;
pub use round::Order;
pub use sampler::{FirstSamples, Sampler};
pub use tolerance::Tolerance;
