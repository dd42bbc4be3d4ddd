//! Two mirrors that face each other: every ray has one child, and the answer is a geometric series.

use glam::{DVec2, Vec3};
use raytree_gpu::{RenderSettings, Shading};
use raytree_scene::model::{Material, Projection, Scene, WhittedCoefficients};

use crate::{
    report::Limit,
    scenes::{Build, matte, pinhole},
    stage::{Stage, StressError},
};

/// Levels of the tree below the camera ray.
const DEPTH: u32 = 1000;

/// Half side of the mirrors, and half the distance between them.
const HALF: f32 = 0.5;

/// Relative. A throughput of 1000 factors and a sum of 1000 terms are rounded 1000 times each, which in f32 can come to 1.2e-4
/// in the worst case, and to 4e-6 if roundings are as good as random.
const SERIES_LIMIT: f64 = 1e-4;

/// Of the extent. Half an ulp of 0.5 at every bounce, always to the same side: what a single rounding could do. There are several at
/// each (barycentrics, sum, direction), but as good as random, which makes some 1e-6.
const DRIFT_LIMIT: f64 = 3e-5;

/// Mirrors of this reflectance, each of radiance 1, in the dark.
fn mirrors(reflectance: f32, shading: Shading) -> Scene {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(mirror(reflectance, shading));
    build.square(Vec3::new(0.0, 0.0, HALF), Vec3::NEG_Z, HALF, material);
    build.square(Vec3::new(0.0, 0.0, -HALF), Vec3::Z, HALF, material);
    build.0
}

fn mirror(reflectance: f32, shading: Shading) -> Material {
    let made = match shading {
        Shading::Pbr => Material {
            metallic: 1.0,
            roughness: 0.0,
            ..matte([reflectance; 3])
        },
        Shading::Whitted => Material {
            whitted: Some(WhittedCoefficients {
                ka: Some(0.0),
                kd: Some(0.0),
                ks: Some(Vec3::splat(reflectance)),
                ..WhittedCoefficients::default()
            }),
            ..matte([0.0; 3])
        },
    };
    Material {
        emissive: Vec3::ONE,
        ..made
    }
}

/// From the middle between the mirrors straight at one of them; `half_width` is the slope of the rays at the picture's sides.
fn view(width: u32, height: u32, half_width: f64, shading: Shading) -> RenderSettings {
    let yfov = 2.0 * (half_width * f64::from(height) / f64::from(width)).atan();
    RenderSettings {
        max_depth: DEPTH,
        min_weight: 0.0,
        shading,
        ..RenderSettings::new(width, height, pinhole(Vec3::ZERO, Vec3::Z, yfov))
    }
}

/// What `hits` mirrors in a row send back: 1 + r + .. + r^(hits - 1). (At these angles a metal reflects its base colour: Schlick's
/// term is (1 - cos)^5 < 1e-35.)
fn geometric(reflectance: f64, hits: f64) -> f64 {
    (1.0 - reflectance.powf(hits)) / (1.0 - reflectance)
}

/// How many hits send back this much: the inverse of [`geometric`].
fn hits(reflectance: f64, radiance: f64) -> f64 {
    (1.0 - radiance * (1.0 - reflectance)).ln() / reflectance.ln()
}

/// The largest relative difference of any channel; NaN counts as infinite.
fn worst(radiance: &[[f32; 3]], expected: f64) -> f64 {
    let channels = radiance.iter().flatten();
    channels
        .map(|&channel| (f64::from(channel) / expected - 1.0).abs())
        .fold(0.0, |largest, difference| {
            if difference <= largest {
                largest
            } else if difference.is_nan() {
                f64::INFINITY
            } else {
                difference
            }
        })
}

/// All rays stay between the mirrors, and bring back the whole series.
pub(super) fn series(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for shading in [Shading::Pbr, Shading::Whitted] {
        // Up to 0.28 to the side in 1000 steps.
        let settings = view(16, 16, 2e-4, shading);
        let mut strays = 0;
        for reflectance in [0.99, 0.999] {
            let rendered = stage.render(&mirrors(reflectance, shading), &settings)?;
            let expected = geometric(f64::from(reflectance), f64::from(DEPTH + 1));
            stage.record(
                format!("mirrors of {reflectance}, depth {DEPTH}, {shading:?}: relative error"),
                worst(&rendered.film.radiance, expected),
                Limit::AtMost(SERIES_LIMIT),
            );
            let ended = rendered.counters.unwrap_or_default().ended;
            strays += ended.miss + ended.storage + ended.budget;
        }
        stage.record(
            format!("mirrors, {shading:?}: rays that left or were dropped"),
            strays as f64,
            Limit::AtMost(0.0),
        );
    }
    Ok(())
}

/// Rays slant enough to leave past the mirrors' rims: where each does, says how far it has drifted off the straight line through
/// the unfolded mirrors.
pub(super) fn drift(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let reflectance = 0.999;
    let settings = view(1024, 1, 2e-3, Shading::Pbr);
    let rendered = stage.render(&mirrors(reflectance, Shading::Pbr), &settings)?;
    let drifts = rendered.film.radiance.iter().zip(0_u32..);
    let largest = drifts
        .map(|(&[radiance, ..], x)| {
            let seen = hits(f64::from(reflectance), f64::from(radiance));
            misjudged(slope(&settings, x), seen)
        })
        .fold(0.0, f64::max);
    stage.record_with(
        format!("mirrors, slanting rays: drift in up to {DEPTH} reflections"),
        largest,
        Limit::AtMost(DRIFT_LIMIT),
        "of the extent; by the number of hits before a ray leaves past the rim, which tells drifts above 1e-6",
    );
    Ok(())
}

/// How far to the side the ray of column `x` goes in one unit along the axis.
fn slope(settings: &RenderSettings, x: u32) -> DVec2 {
    let Projection::Perspective { yfov, .. } = settings.camera.projection else {
        return DVec2::ZERO;
    };
    let (width, height) = (f64::from(settings.width), f64::from(settings.height));
    let sideways = (2.0 * (f64::from(x) + 0.5) / width - 1.0) * (0.5 * yfov).tan() * width / height;
    (sideways * settings.camera.right).truncate()
}

/// By how much the rim was misjudged, if the ray of this slope hit the mirrors `seen` times: 0 if that is what the straight line
/// does.
fn misjudged(slope: DVec2, seen: f64) -> f64 {
    let half = f64::from(HALF);
    // The ray starts in the middle: half a distance to the first mirror.
    let to_the_side = |hit: f64| slope.abs().max_element() * 2.0 * half * (hit + 0.5);
    let last = f64::from(DEPTH);
    let seen = seen.round();
    let beyond = if seen > 0.0 {
        to_the_side(seen - 1.0) - half
    } else {
        0.0
    };
    let before = if seen <= last {
        half - to_the_side(seen)
    } else {
        0.0
    };
    if seen.is_nan() {
        f64::INFINITY
    } else {
        beyond.max(before).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_the_sum() {
        let sum: f64 = (0..=DEPTH).map(|k| 0.99_f64.powi(k as i32)).sum();
        assert!((geometric(0.99, f64::from(DEPTH + 1)) / sum - 1.0).abs() < 1e-12);
        for count in [0.0, 1.0, 7.0, 1001.0] {
            assert!((hits(0.999, geometric(0.999, count)) - count).abs() < 1e-6);
        }
    }

    /// The comparisons have to be able to fail.
    #[test]
    fn what_is_off_is_noticed() {
        assert!(worst(&[[2.0; 3]], 2.0) == 0.0);
        assert!(worst(&[[2.0; 3], [2.0, 1.99, 2.0]], 2.0) > SERIES_LIMIT);
        assert_eq!(worst(&[[f32::NAN, 2.0, 2.0], [2.0; 3]], 2.0), f64::INFINITY);

        // Hits at 0.1, 0.3 and 0.5 - 1e-9 of the way to the rim, not at 0.7.
        let slope = DVec2::new(0.0, 0.2 - 1e-9);
        assert_eq!(misjudged(slope, 3.0), 0.0);
        assert!((misjudged(slope, 4.0) - 0.2).abs() < 1e-6);
        assert!((misjudged(slope, 1.0) - 0.2).abs() < 1e-6);
        assert!(misjudged(slope, 2.0) < 1e-6);
        assert_eq!(misjudged(slope, f64::NAN), f64::INFINITY);
        // Never out: every hit up to the depth.
        assert_eq!(misjudged(DVec2::ZERO, f64::from(DEPTH + 1)), 0.0);
        assert!(misjudged(DVec2::ZERO, f64::from(DEPTH)) > 0.4);
    }
}
