//! Solids without a meaning: open meshes, and nests that are too deep. Finite, bounded, the same every time, counted.

use glam::{Quat, Vec3};
use raytree_film::Film;
use raytree_gpu::RenderSettings;
use raytree_scene::model::Scene;

use super::scenes::{Blocks, settings, solid};
use crate::{
    judge::{judge_picture, worse},
    report::Limit,
    scenes::{Build, pinhole},
    stage::{Stage, StressError},
};

/// Of radiance 1.
const FURNACE: f64 = 1e-4;

pub(super) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let places = [Vec3::new(0.4, 0.6, 1.8), Vec3::new(0.05, 0.1, 0.15)];
    let mut beyond = 0.0_f64;
    let mut changed = 0;
    for scene in [pane(), ball_with_hole(), crossing_panes()] {
        for from in places {
            let settings = settings(pinhole(from, Vec3::new(0.02, 0.0, -0.3), 1.2));
            let film = stage.render(&scene, &settings)?.film;
            beyond = worse(beyond, outside_of_furnace(&film));
            let small = RenderSettings {
                batch_pixels: Some(128),
                ..settings.clone()
            };
            let again = stage.render(&scene, &small)?.film;
            changed += different_pixels(&film, &again);
        }
    }
    stage.record(
        "open meshes in a white furnace: beyond [0, 1]",
        beyond,
        Limit::AtMost(FURNACE),
    );
    stage.record(
        "open meshes: pixels that differ in another batch size",
        changed as f64,
        Limit::AtMost(0.0),
    );
    nests(stage)
}

/// Balls in balls, eight of different media and nine.
fn nests(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (depth, limit) in [(8, Limit::AtMost(0.0)), (9, Limit::AtLeast(1.0))] {
        let scene = nest(depth);
        // Straight through the middle: nothing is bent much, and the rays get to the innermost.
        let mut settings =
            RenderSettings::new(8, 8, pinhole(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 0.02));
        settings.max_depth = 24;
        settings.min_weight = 0.5;
        let rendered = stage.render(&scene, &settings)?;
        let ended = rendered.counters.unwrap_or_default().ended.storage;
        stage.record(
            format!("{depth} solids in each other: branches ended for lack of storage"),
            ended as f64,
            limit,
        );
        let judged = judge_picture(&scene, &settings, &rendered.film, 1e-3);
        stage.record(
            format!("{depth} solids in each other, by the oracle"),
            judged.worst,
            Limit::AtMost(1e-3),
        );
    }
    Ok(())
}

fn nest(depth: u16) -> Scene {
    let mut blocks = Blocks::new(Quat::IDENTITY);
    for k in 0..depth {
        let material = solid(1.1 + 0.05 * f32::from(k), 0.05 * f32::from(k), 0.0);
        let material = blocks.build.material(material);
        blocks
            .build
            .ball(Vec3::ZERO, 0.9 - 0.09 * f32::from(k), 2, material);
    }
    blocks.build.0
}

fn furnace() -> (Build, u32) {
    let mut build = Build::inside([1.0; 3]);
    let glass = build.material(solid(1.5, 0.0, 1.0));
    (build, glass)
}

/// A single square of a solid's material.
fn pane() -> Scene {
    let (mut build, glass) = furnace();
    build.square(Vec3::ZERO, Vec3::new(0.2, 0.3, 1.0), 0.7, glass);
    build.0
}

/// Squares of solids that cross each other: inside of nothing, or of several.
fn crossing_panes() -> Scene {
    let (mut build, glass) = furnace();
    let dense = build.material(solid(2.4, 0.0, 1.0));
    build.square(
        Vec3::new(0.0, 0.0, -0.2),
        Vec3::new(0.2, 0.3, 1.0),
        0.7,
        glass,
    );
    build.square(
        Vec3::new(0.0, 0.1, 0.0),
        Vec3::new(0.3, 1.0, -0.1),
        0.7,
        dense,
    );
    build.square(
        Vec3::new(0.1, 0.0, 0.0),
        Vec3::new(-1.0, 0.3, 0.2),
        0.7,
        dense,
    );
    build.0
}

/// A ball that lacks a sixth of its triangles.
fn ball_with_hole() -> Scene {
    let (mut build, glass) = furnace();
    build.ball(Vec3::ZERO, 0.6, 3, glass);
    let positions = build.0.geometry.positions.clone();
    build.0.geometry.triangles.retain(|triangle| {
        triangle
            .vertices
            .iter()
            .any(|vertex| positions[*vertex as usize].y < 0.4)
    });
    build.0
}

/// How far any channel of any pixel is below 0 or above 1; NaN if one is.
fn outside_of_furnace(film: &Film) -> f64 {
    film.radiance.iter().flatten().fold(0.0, |worst, &value| {
        let value = f64::from(value);
        // `f64::max` would pass over NaN.
        let beyond = if value > 0.5 { value - 1.0 } else { -value };
        worse(worst, beyond)
    })
}

fn different_pixels(a: &Film, b: &Film) -> usize {
    let bits = |film: &Film| -> Vec<[u32; 3]> {
        film.radiance
            .iter()
            .map(|rgb| rgb.map(f32::to_bits))
            .collect()
    };
    bits(a)
        .iter()
        .zip(bits(b))
        .filter(|(a, b)| **a != *b)
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_the_furnace_is_noticed() {
        let mut film = Film::new(4, 4);
        film.radiance.fill([1.0; 3]);
        assert_eq!(outside_of_furnace(&film), 0.0);
        film.radiance[3] = [1.0, 1.5, 1.0];
        assert_eq!(outside_of_furnace(&film), 0.5);
        film.radiance[3] = [1.0, -2.0, 1.0];
        assert_eq!(outside_of_furnace(&film), 2.0);
        film.radiance[3] = [1.0, f32::NAN, 1.0];
        assert!(outside_of_furnace(&film).is_nan());
    }

    #[test]
    fn a_changed_bit_is_noticed() {
        let one = Film::new(4, 4);
        let mut other = one.clone();
        assert_eq!(different_pixels(&one, &other), 0);
        other.radiance[5][1] = -0.0;
        assert_eq!(different_pixels(&one, &other), 1);
    }
}
