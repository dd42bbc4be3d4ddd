//! Trees that double at every level: what bounds them, and what that costs.

use glam::Vec3;
use raytree_gpu::{Counters, RenderSettings, Rendered, Shading};
use raytree_scene::model::{Material, Scene, WhittedCoefficients};

use crate::{
    report::Limit,
    scenes::{Build, matte, pinhole},
    stage::{Stage, StressError},
};

/// The default of [`RenderSettings::max_rays`].
const BUDGET: u32 = 1 << 16;

/// Boxes side by side that reflect all and transmit all: every hit doubles, and a tree of depth 64 has 2^64 rays. Each shines
/// with radiance 1 in the dark, so a picture is its number of hits.
fn row_of_boxes() -> Scene {
    const COUNT: i32 = 24;
    let mut build = Build::before([0.0; 3]);
    let doubling = build.material(Material {
        emissive: Vec3::ONE,
        whitted: Some(WhittedCoefficients {
            ka: Some(0.0),
            kd: Some(0.0),
            ks: Some(Vec3::ONE),
            kt: Some(Vec3::ONE),
            ior: Some(1.0),
            ..WhittedCoefficients::default()
        }),
        ..matte([0.0; 3])
    });
    let half = 1.0 / (4.0 * COUNT as f32);
    for k in 0..COUNT {
        let centre = Vec3::new(0.0, 0.0, -0.5 + (k as f32 + 0.5) / COUNT as f32);
        let reach = Vec3::new(0.25, 0.25, half);
        build.cuboid(centre - reach, centre + reach, doubling);
    }
    build.0
}

/// From before the first box along the row.
fn along_the_row(size: u32, max_depth: u32, max_rays: u32) -> RenderSettings {
    let camera = pinhole(
        Vec3::new(0.03, 0.02, -0.75),
        Vec3::new(0.03, 0.02, 1.0),
        1e-3,
    );
    RenderSettings {
        max_depth,
        max_rays,
        min_weight: 0.0,
        shading: Shading::Whitted,
        ..RenderSettings::new(size, size, camera)
    }
}

/// Time and storage keep their bounds, and no ray that was traced is left out of the picture.
pub(super) fn boxes(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let scene = row_of_boxes();
    for (max_depth, max_rays) in [(64, 1), (64, 1000), (64, BUDGET), (1000, BUDGET)] {
        let rendered = stage.render(&scene, &along_the_row(1, max_depth, max_rays))?;
        let counters = rendered.counters.unwrap_or_default();
        let what = format!("2^{max_depth} rays, at most {max_rays}");
        stage.record(
            format!("{what}: share of the budget that was traced"),
            counters.rays.total() as f64 / f64::from(max_rays),
            Limit::AtMost(1.0),
        );
        stage.record(
            format!("{what}: branches that were reported as dropped"),
            rendered.dropped.budget as f64,
            Limit::AtLeast(1.0),
        );
        stage.record(
            format!("{what}: ended for lack of storage, or hits left out of the picture"),
            rendered.dropped.storage as f64 + left_out(&rendered, &counters),
            Limit::AtMost(0.0),
        );
    }

    // A tree that fits is whole: 2^15 - 1 rays, less those whose parents leave the row.
    let whole = stage.render(&scene, &along_the_row(1, 14, BUDGET))?;
    stage.record(
        format!("depth 14, at most {BUDGET} rays: branches that were dropped"),
        whole.dropped.total() as f64,
        Limit::AtMost(0.0),
    );

    let settings = along_the_row(16, 64, 1000);
    let at_once = stage.render(&scene, &settings)?;
    let in_batches = RenderSettings {
        batch_pixels: Some(64),
        ..settings
    };
    let in_batches = stage.render(&scene, &in_batches)?;
    stage.record(
        "2^64 rays, in 4 batches: pixels that differ from those in one",
        differing(&at_once.film.radiance, &in_batches.film.radiance) as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

/// Hits that were traced and are not in the picture of one pixel, or are in it and were not traced.
fn left_out(rendered: &Rendered, counters: &Counters) -> f64 {
    let hits = counters.rays.total() as f64 - counters.ended.miss as f64;
    let shown = f64::from(rendered.film.radiance[0][0]);
    (shown - hits).abs()
}

/// Pixels that are not the same to the bit.
fn differing(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    let bits = |pixel: &[f32; 3]| pixel.map(f32::to_bits);
    let pairs = a.iter().zip(b);
    pairs.filter(|(a, b)| bits(a) != bits(b)).count() + a.len().abs_diff(b.len())
}

/// A stack of panes of index 1.5, seen from above, the same radiance behind and before: each reflects R = 0.04 and transmits the
/// rest, nothing is absorbed, and the whole tree brings back just that radiance.
const PANES: usize = 8;

fn stack_of_panes() -> Scene {
    let mut build = Build::before([1.0; 3]);
    let glass = build.material(Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.5,
        ..matte([1.0; 3])
    });
    for k in 0..PANES {
        let z = (k as f32 + 0.5) / PANES as f32 - 0.5;
        build.square(Vec3::new(0.0, 0.0, z), Vec3::NEG_Z, 0.5, glass);
    }
    build.0
}

/// What a tree of this depth brings back: the weights of the branches that leave the stack, as a walk between the panes.
fn radiance_of_stack(reflectance: f64, max_depth: u32) -> f64 {
    // Weight of the rays that go down or up and arrive at pane k next; the camera's comes from above.
    let (mut down, mut up) = (vec![0.0; PANES], vec![0.0; PANES]);
    down[0] = 1.0;
    let mut left = 0.0;
    for _ in 0..max_depth {
        let (mut next_down, mut next_up) = (vec![0.0; PANES], vec![0.0; PANES]);
        for k in 0..PANES {
            let going_down = (1.0 - reflectance) * down[k] + reflectance * up[k];
            let going_up = (1.0 - reflectance) * up[k] + reflectance * down[k];
            match next_down.get_mut(k + 1) {
                Some(next) => *next += going_down,
                None => left += going_down,
            }
            match k.checked_sub(1) {
                Some(above) => next_up[above] += going_up,
                None => left += going_up,
            }
        }
        (down, up) = (next_down, next_up);
    }
    left
}

/// What is dropped weighs little: the picture lies just below that of the tree of 2^64 rays, and above that of every whole tree
/// that fits.
pub(super) fn panes(stage: &mut Stage<'_>) -> Result<(), StressError> {
    const DEPTH: u32 = 64;
    /// As many levels of a binary tree as fit into the half of the budget that keeps trees whole.
    const WHOLE_DEPTH: u32 = 14;
    let reflectance = 0.04;
    let camera = pinhole(
        Vec3::new(0.03, 0.02, -1.0),
        Vec3::new(0.03, 0.02, 1.0),
        1e-3,
    );
    let settings = RenderSettings {
        max_depth: DEPTH,
        min_weight: 0.0,
        ..RenderSettings::new(2, 2, camera)
    };
    let rendered = stage.render(&stack_of_panes(), &settings)?;
    let all = radiance_of_stack(reflectance, DEPTH);
    let channels = rendered.film.radiance.iter().flatten();
    let shown: Vec<f64> = channels.map(|&channel| f64::from(channel)).collect();
    let most = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = shown.iter().copied().fold(f64::INFINITY, f64::min);
    stage.record_with(
        format!("{PANES} panes, depth {DEPTH}: share of the light that was dropped"),
        1.0 - least / all,
        Limit::AtMost(0.01),
        format!(
            "{} branches of 4 pixels were dropped, and reported",
            rendered.dropped.budget
        ),
    );
    stage.record(
        format!("{PANES} panes, depth {DEPTH}: more light than the whole tree's (relative)"),
        most / all - 1.0,
        Limit::AtMost(1e-5),
    );
    stage.record(
        format!("{PANES} panes, depth {DEPTH}: light of the tree of depth {WHOLE_DEPTH}, times"),
        least / radiance_of_stack(reflectance, WHOLE_DEPTH),
        Limit::AtLeast(1.0),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walk_between_panes_is_the_series_of_the_stack() {
        // Lossless panes without phase: R = N r / (1 + (N - 1) r), T = 1 - R; all of it leaves in the end.
        assert!((radiance_of_stack(0.04, 20_000) - 1.0).abs() < 1e-9);
        // One reflection, two transmissions and one reflection, four and one: (1 - r)^2 r and so on.
        let first = 0.04;
        let second = 0.96 * 0.04 * 0.96;
        assert!((radiance_of_stack(0.04, 1) - first).abs() < 1e-12);
        assert!((radiance_of_stack(0.04, 3) - first - second).abs() < 1e-12);
    }

    /// The comparisons have to be able to fail.
    #[test]
    fn a_bit_and_a_missing_hit_are_noticed() {
        let a = [[0.0; 3], [1.0; 3]];
        assert_eq!(differing(&a, &a), 0);
        assert_eq!(
            differing(&a, &[[0.0; 3], [1.0, 1.0, 1.0 + f32::EPSILON]]),
            1
        );
        assert_eq!(differing(&a, &a[..1]), 1);
    }
}
