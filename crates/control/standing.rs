//! How far a pixel is off, in tolerances.

/// A pixel as it is judged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing {
    /// What lies between its samples, standard error.
    pub(crate) error: f32,
    /// What was left out of them.
    pub(crate) lost: f32,
    /// The tolerance, linear radiance.
    pub(crate) allowed: f32,
}

/// Without the care that `f32::max` takes of NaN, which keeps compilers from working on many at once.
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Over pixels.
pub(crate) fn root_mean_square(values: impl Iterator<Item = f32>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u64), |(sum, count), value| {
        (sum + f64::from(value).powi(2), count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}
