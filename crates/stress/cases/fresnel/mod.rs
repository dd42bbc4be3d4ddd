//! Snell's law and Fresnel's equations where they are steep: indices from 1/1000 to 1000, angles to within 1e-6 rad of grazing
//! and of the critical angle, what can't be seen, and parallel slabs.

mod interface;
mod invisible;
mod slab;
mod twin;

use crate::stage::{Stage, StressError};

/// Indices of refraction, as materials have them.
const INDICES: [f32; 7] = [1.0, 1.0 + 1e-6, 1.33, 1.5, 2.42, 10.0, 1000.0];

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    interface::measure(stage)?;
    invisible::measure(stage)?;
    slab::measure(stage)
}
