//! Stiff trees: a thousand reflections in a row, and trees that double at every level.

mod doubling;
mod facing;

use crate::stage::{Stage, StressError};

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    facing::series(stage)?;
    facing::drift(stage)?;
    doubling::boxes(stage)?;
    doubling::panes(stage)
}
