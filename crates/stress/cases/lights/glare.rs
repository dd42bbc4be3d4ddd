//! Light inside glass, and light that is more than a number can hold.

use glam::{DVec3, Vec3};
use raytree_film::{Film, Picture, ToneMap, WriteOptions};
use raytree_gpu::RenderSettings;
use raytree_scene::{
    environment::{Environment, load_environment},
    model::{Background, LightKind, Material, Volume},
};

use super::{not_finite, worse};
use crate::{
    judge::judge_picture,
    report::Limit,
    scenes::{Build, matte, pinhole},
    stage::{Stage, StressError},
};

/// A light in the middle of a ball of glass before a wall.
pub(super) fn in_a_ball(stage: &mut Stage<'_>) -> Result<(), StressError> {
    const TOLERANCE: f64 = 1e-3;
    let mut build = Build::before([0.1, 0.1, 0.1]);
    let grey = build.material(matte([0.8; 3]));
    let glass = build.material(Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.5,
        volume: Some(Volume {
            attenuation_color: Vec3::ONE,
            attenuation_distance: f64::INFINITY,
        }),
        ..matte([0.9, 1.0, 0.8])
    });
    build.square(Vec3::ZERO, Vec3::Z, 0.5, grey);
    let middle = Vec3::new(0.05, -0.02, 0.3);
    build.ball(middle, 0.2, 3, glass);
    let kind = LightKind::Point {
        position: middle.as_dvec3(),
        range: f64::INFINITY,
    };
    build.light(kind, 0.3);
    let settings = RenderSettings::new(40, 40, pinhole(Vec3::new(0.6, 0.3, 1.2), Vec3::ZERO, 0.8));
    let film = stage.render(&build.0, &settings)?.film;
    let judged = judge_picture(&build.0, &settings, &film, TOLERANCE);
    stage.record_with(
        "a light inside a ball of glass: pixels that the oracle does not see",
        judged.unexplained.len() as f64,
        Limit::AtMost(0.0),
        format!(
            "{} of {} lie on edges",
            judged.outliers.len() - judged.unexplained.len(),
            film.radiance.len()
        ),
    );
    Ok(())
}

/// Mirrors that face each other and shine as brightly as f32 can say.
pub(super) fn emission(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut build = Build::before([0.0; 3]);
    let mirror = build.material(Material {
        metallic: 1.0,
        roughness: 0.0,
        emissive: Vec3::new(f32::MAX, 1e30, 1e25),
        ..matte([0.999; 3])
    });
    build.square(Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z, 0.5, mirror);
    build.square(Vec3::new(0.0, 0.0, -0.5), Vec3::Z, 0.5, mirror);
    let settings = RenderSettings {
        max_depth: 1000,
        min_weight: 0.0,
        ..RenderSettings::new(8, 8, pinhole(Vec3::ZERO, Vec3::Z, 1e-4))
    };
    let film = stage.render(&build.0, &settings)?.film;
    stage.record(
        "emission of 10^25 to 3 * 10^38 between mirrors: pixels infinite or NaN",
        not_finite(&film.radiance) as f64,
        Limit::AtMost(0.0),
    );
    // The least of the three channels is far from any limit: 10^25 times the series of 1001 reflections.
    let series = (1.0 - 0.999_f64.powi(1001)) / 0.001;
    let blue = film.radiance.iter().map(|pixel| f64::from(pixel[2]));
    let off = blue.map(|blue| (blue / (1e25 * series) - 1.0).abs());
    stage.record(
        "emission of 10^25 between mirrors: relative error",
        off.fold(0.0, worse),
        Limit::AtMost(1e-4),
    );
    files(stage, &film)
}

/// What the files hold of such a picture: an EXR all of it, a PNG white.
fn files(stage: &mut Stage<'_>, film: &Film) -> Result<(), StressError> {
    let folder = tempfile::tempdir()?;
    let exr = folder.path().join("bright.exr");
    film.write(&exr, &WriteOptions::default())?;
    stage.record(
        "as EXR: pixels that come back changed",
        changed(&Picture::read(&exr)?.rgb, &film.radiance) as f64,
        Limit::AtMost(0.0),
    );
    let mut dark = 0;
    for tone in [ToneMap::None, ToneMap::Neutral, ToneMap::Agx, ToneMap::Aces] {
        let png = folder.path().join("bright.png");
        let options = WriteOptions {
            tone,
            ..WriteOptions::default()
        };
        film.write(&png, &options)?;
        dark += not_white(&Picture::read(&png)?.rgb);
    }
    stage.record(
        "as PNG by every tone curve: pixels that are not white",
        dark as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

fn changed(read: &[[f32; 3]], written: &[[f32; 3]]) -> usize {
    let same = read.iter().zip(written).filter(|(a, b)| a == b).count();
    written.len() - same
}

fn not_white(pixels: &[[f32; 3]]) -> usize {
    let white = |pixel: &&[f32; 3]| pixel.iter().all(|&channel| channel > 0.97);
    pixels.len() - pixels.iter().filter(white).count()
}

/// An environment map with texels that are no radiance, about a mirror, a rough metal and a matte wall.
pub(super) fn environment(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let odd = [
        f32::INFINITY,
        f32::NAN,
        f32::MAX,
        -1.0,
        f32::NEG_INFINITY,
        1e-40,
    ];
    let mut map = Film::new(32, 16);
    map.radiance.fill([0.5; 3]);
    for (value, texel) in odd.into_iter().zip(map.radiance.iter_mut().step_by(37)) {
        *texel = [value, 0.5, value];
    }
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("odd.exr");
    map.write(&file, &WriteOptions::default())?;
    let loaded = load_environment(&file)?;

    let mut build = Build::before([0.0; 3]);
    let surroundings = &mut build.0.surroundings;
    surroundings.environment = Some(Environment::new(loaded.map, 0.0));
    surroundings.background = Background::Environment;
    for (k, roughness) in [0.0, 0.2, 0.7].into_iter().enumerate() {
        let metal = build.material(Material {
            metallic: 1.0,
            roughness,
            ..matte([0.9; 3])
        });
        build.ball(Vec3::new(0.6 * k as f32 - 0.6, 0.0, 0.3), 0.25, 3, metal);
    }
    let grey = build.material(matte([0.8; 3]));
    build.square(Vec3::ZERO, Vec3::Z, 0.9, grey);
    let camera = pinhole(Vec3::new(0.5, 0.5, 2.0), DVec3::ZERO.as_vec3(), 1.2);
    let film = stage
        .render(&build.0, &RenderSettings::new(64, 64, camera))?
        .film;
    let warnings: Vec<String> = loaded.warnings.iter().map(|w| w.text.clone()).collect();
    stage.record_with(
        "an environment with infinities and NaN: pixels infinite or NaN",
        not_finite(&film.radiance) as f64,
        Limit::AtMost(0.0),
        warnings.join("; "),
    );
    stage.record(
        "an environment with infinities and NaN: warnings of it",
        loaded.warnings.len() as f64,
        Limit::AtLeast(1.0),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparisons have to be able to fail.
    #[test]
    fn changed_and_dark_pixels_are_noticed() {
        let film = [[1e30, 0.5, 0.0], [1.0; 3]];
        assert_eq!(changed(&film, &film), 0);
        assert_eq!(changed(&[[1e30, 0.5, 0.0], [1.0, 1.0, 0.5]], &film), 1);
        assert_eq!(changed(&[[f32::NAN; 3], [1.0; 3]], &film), 1);
        assert_eq!(changed(&film[..1], &film), 1);
        assert_eq!(
            not_white(&[[1.0; 3], [1.0, 0.5, 1.0], [0.0; 3], [f32::NAN; 3]]),
            3
        );
    }
}
