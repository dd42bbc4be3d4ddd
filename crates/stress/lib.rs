//! The stress suite: stiff and extreme cases, each judged by an answer on paper or by the f64 oracle.
//!
//! `raytree stress` prints its table, `tests/stress.rs` fails where a row does, and `STRESS.md` at the project's root explains
//! for each case what goes wrong in a naive tracer and what this one does.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let device = raytree_gpu::Device::open(&raytree_gpu::DeviceChoice::default())?;
//! let report = raytree_stress::run(&device, &raytree_stress::Selection::all(), &mut |_row| {});
//! assert!(report.passed(), "{}", report.to_text());
//! # Ok(())
//! # }
//! ```

mod case;
mod cases;
mod documents;
mod made;
mod report;
mod stage;

pub mod judge;
pub mod meshes;
pub mod random;
pub mod scenes;

pub use case::{BOOK_TOLERANCE, CASES, Case, Selection, UnknownCase, run, run_beside_book};
pub use report::{Limit, Report, Row};
pub use stage::{Stage, StressError};
