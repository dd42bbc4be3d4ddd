//! Our own scenes from 10^-12 to 10^12 times their size.

use crate::stage::{Stage, StressError};

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let _ = stage.device();
    Ok(())
}
