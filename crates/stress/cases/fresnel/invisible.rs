//! What has the index of its surroundings can't be seen.

use glam::Vec3;
use raytree_gpu::{RenderSettings, Shading};
use raytree_scene::{environment::EquirectMap, model::Background};

use crate::{
    judge::{judge_picture, largest_difference},
    report::Limit,
    scenes::{Build, clear_glass, matte, pinhole, unfiltered},
    stage::{Stage, StressError},
};

pub(super) fn measure(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (shading, name) in [(Shading::Pbr, "pbr"), (Shading::Whitted, "whitted")] {
        let settings = RenderSettings {
            shading,
            ..RenderSettings::new(
                96,
                72,
                pinhole(Vec3::new(0.3, 0.8, 3.0), Vec3::new(0.0, 0.1, 0.0), 0.8),
            )
        };
        let without = stage.render(&surroundings().0, &settings)?.film;
        let with = stage.render(&with_objects(1.0).0, &settings)?.film;
        let seen = largest_difference(&without, &with);
        stage.record(
            format!("index 1, {name}: with and without"),
            seen,
            Limit::AtMost(1e-6),
        );
        let build = with_objects(1.0 + 1e-6);
        let film = stage.render(&build.0, &settings)?.film;
        let judged = judge_picture(&build.0, &settings, &film, 1e-5);
        stage.record(
            format!("index 1 + 1e-6, {name}: against the oracle"),
            judged.worst,
            Limit::AtMost(1e-5),
        );
    }
    Ok(())
}

/// A smooth sky over a matte floor.
fn surroundings() -> Build {
    let (width, height) = (64, 32);
    let texels = (0..width * height)
        .map(|k| {
            let turn = std::f32::consts::TAU * (k % width) as f32 / width as f32;
            let height = (k / width) as f32 / height as f32;
            [
                0.5 + 0.3 * turn.sin(),
                0.5 + 0.3 * turn.cos(),
                1.0 - 0.7 * height,
            ]
        })
        .collect();
    let mut build = Build::before([0.0; 3]);
    build.0.surroundings.background = Background::Environment;
    build.0.surroundings.environment = Some(unfiltered(EquirectMap {
        width,
        height,
        texels,
    }));
    let floor = build.material(matte([0.7, 0.6, 0.5]));
    build.square(Vec3::new(0.0, -0.9, 0.0), Vec3::Y, 1.5, floor);
    build
}

/// .. with a ball and a box of this index before it.
fn with_objects(ior: f32) -> Build {
    let mut build = surroundings();
    let clear = build.material(clear_glass(ior));
    build.ball(Vec3::new(-0.5, 0.0, 0.0), 0.6, 4, clear);
    build.cuboid(Vec3::new(0.3, -0.5, -0.4), Vec3::new(1.0, 0.6, 0.4), clear);
    build
}
