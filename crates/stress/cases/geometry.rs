//! Geometry that should not be in a file and is: left out or rendered, counted, warned of.

mod file;
mod left_out;
mod sides;
mod slivers;

use crate::stage::{Stage, StressError};

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    left_out::run(stage)?;
    sides::run(stage)?;
    slivers::run(stage)
}
