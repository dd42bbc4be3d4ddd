//! Lights before a matte wall: `L = base / pi * I cos / d^2`.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3, EulerRot, Vec3};
use raytree_gpu::RenderSettings;
use raytree_scene::model::{LightKind, Projection, Scene};

use super::{not_finite, worse};
use crate::{
    random::Random,
    report::Limit,
    scenes::{Build, matte, pinhole},
    stage::{Stage, StressError},
};

const BASE: f32 = 0.8;

/// Relative: some twenty roundings, as for any picture of a lit wall.
const STRENGTH_LIMIT: f64 = 1e-5;

/// Of the light that would arrive head-on. The place on the wall and the light's are rounded to 3e-8; seen from 0.01 away, as near
/// as a pixel's middle comes, that turns the direction by 6e-6.
const NEAR_LIMIT: f64 = 2e-5;

/// Largest relative error of a sum of 10,000 lights.
const MANY_LIMIT: f64 = 1e-4;

/// A wall of side 1 at z = 0 that faces +z, turned.
fn wall(turn: DQuat) -> Build {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(matte([BASE; 3]));
    let facing = (turn * DVec3::Z).as_vec3();
    build.square(Vec3::ZERO, facing, 0.5, material);
    build
}

/// All pixels see the wall; where their number is odd, that in the middle sees the origin.
fn view(size: u32, turn: DQuat) -> RenderSettings {
    let eye = (turn * DVec3::Z).as_vec3();
    RenderSettings::new(size, size, pinhole(eye, Vec3::ZERO, 0.8))
}

/// Where the ray through the middle of each pixel meets the wall, the turn undone.
fn places(settings: &RenderSettings, turn: DQuat) -> impl Iterator<Item = DVec3> + '_ {
    let camera = &settings.camera;
    let half = match camera.projection {
        Projection::Perspective { yfov, .. } => (0.5 * yfov).tan(),
        Projection::Orthographic { ymag, .. } => ymag,
    };
    let eye = turn.inverse() * camera.position;
    (0..settings.height).flat_map(move |row| {
        (0..settings.width).map(move |column| {
            let across = |k: u32, size: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(size) - 1.0;
            let x = across(column, settings.width) * half;
            let y = -across(row, settings.height) * half;
            let direction = camera.forward + x * camera.right + y * camera.up;
            let direction = turn.inverse() * direction;
            eye - (eye.z / direction.z) * direction
        })
    })
}

/// Irradiance of a light of intensity 1 on the wall, and what it would be head-on.
fn irradiance(kind: &LightKind, place: DVec3) -> (f64, f64) {
    match *kind {
        LightKind::Directional { direction } => (-direction.z, 1.0),
        LightKind::Point { position, .. } => {
            let way = position - place;
            let distance = way.length();
            (
                (way.z / distance).max(0.0) / (distance * distance),
                (distance * distance).recip(),
            )
        }
        LightKind::Spot {
            position,
            direction,
            inner_cone_angle,
            outer_cone_angle,
            ..
        } => {
            let (inner, outer) = (inner_cone_angle.cos(), outer_cone_angle.cos());
            let cos = (place - position).normalize().dot(direction);
            let share = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
            let range = f64::INFINITY;
            let (slanted, head_on) = irradiance(&LightKind::Point { position, range }, place);
            (share * slanted, share * head_on)
        }
    }
}

/// A light of each kind, far enough that 10^30 candela are no more irradiance than that.
fn kinds() -> [(&'static str, LightKind); 3] {
    let position = DVec3::new(0.125, 0.25, 1.5);
    let range = f64::INFINITY;
    let direction = DVec3::new(-0.3, 0.2, -1.0).normalize();
    let spot = LightKind::Spot {
        position,
        direction,
        range,
        inner_cone_angle: 0.0,
        outer_cone_angle: FRAC_PI_2,
    };
    [
        ("point", LightKind::Point { position, range }),
        ("spot", spot),
        ("directional", LightKind::Directional { direction }),
    ]
}

pub(super) fn strengths(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let settings = view(16, DQuat::IDENTITY);
    for (name, kind) in kinds() {
        let mut largest = 0.0;
        for exponent in [-30, -20, -10, 0, 10, 20, 30] {
            let intensity = 10_f64.powi(exponent);
            let mut build = wall(DQuat::IDENTITY);
            build.light(kind, intensity);
            let film = stage.render(&build.0, &settings)?.film;
            let pixels = film.radiance.iter().zip(places(&settings, DQuat::IDENTITY));
            for (pixel, place) in pixels {
                let expected = f64::from(BASE) / PI * intensity * irradiance(&kind, place).0;
                for &channel in pixel {
                    largest = worse(largest, (f64::from(channel) / expected - 1.0).abs());
                }
            }
        }
        stage.record(
            format!("{name}, intensities of 10^-30 to 10^30: relative error"),
            largest,
            Limit::AtMost(STRENGTH_LIMIT),
        );
    }
    Ok(())
}

/// At the surface, a little before and a little behind it.
pub(super) fn near(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let turned = DQuat::from_euler(EulerRot::YXZ, 0.7, -0.4, 0.3);
    let (mut broken, mut pixels) = (0, 0);
    for (name, turn) in [("a wall", DQuat::IDENTITY), ("a turned wall", turned)] {
        // Odd: a pixel looks at the light's own place.
        let settings = view(33, turn);
        for height in [0.0, 1e-6, -1e-6] {
            let place = DVec3::new(0.0, 0.0, height);
            for intensity in [1e-30, 1.0, 1e30, 1e38] {
                let mut build = wall(turn);
                build.light(point(turn * place), intensity);
                let film = stage.render(&build.0, &settings)?.film;
                broken += not_finite(&film.radiance);
                pixels += film.radiance.len();
                if intensity == 1.0 {
                    let places = places(&settings, turn);
                    stage.record(
                        format!(
                            "a light {height} of the extent before {name}: error, of head-on light"
                        ),
                        slanted_error(places, &point(place), &film.radiance),
                        Limit::AtMost(NEAR_LIMIT),
                    );
                }
            }
        }
    }
    stage.record_with(
        "lights on and at the walls, of 10^-30 to 10^38: pixels infinite or NaN",
        broken as f64,
        Limit::AtMost(0.0),
        format!("of {pixels}"),
    );
    Ok(())
}

fn point(position: DVec3) -> LightKind {
    LightKind::Point {
        position,
        range: f64::INFINITY,
    }
}

/// The largest error, measured by the light that would arrive head-on; the light's own place left out, where there is no answer.
fn slanted_error(
    places: impl Iterator<Item = DVec3>,
    kind: &LightKind,
    radiance: &[[f32; 3]],
) -> f64 {
    let pixels = radiance.iter().zip(places);
    pixels
        .filter(|(_, place)| place.length() > 1e-3)
        .map(|([channel, ..], place)| {
            let (slanted, head_on) = irradiance(kind, place);
            (f64::from(*channel) * PI / f64::from(BASE) - slanted).abs() / head_on
        })
        .fold(0.0, worse)
}

const LIGHTS: usize = 10_000;

fn many_lights(random: &mut Random) -> Scene {
    let mut build = wall(DQuat::IDENTITY);
    for _ in 0..LIGHTS {
        let position = random.within(Vec3::new(-0.5, -0.5, 0.05), Vec3::new(0.5, 0.5, 0.9));
        build.light(point(position.as_dvec3()), random.unit() / LIGHTS as f64);
    }
    build.0
}

pub(super) fn many(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let scene = many_lights(&mut Random::new(11));
    let settings = view(16, DQuat::IDENTITY);
    let rendered = stage.render(&scene, &settings)?;
    let mut largest = 0.0;
    let pixels = rendered.film.radiance.iter();
    for (pixel, place) in pixels.zip(places(&settings, DQuat::IDENTITY)) {
        let light = |light: &raytree_scene::model::Light| {
            light.intensity.x * irradiance(&light.kind, place).0
        };
        let expected = f64::from(BASE) / PI * scene.lights.iter().map(light).sum::<f64>();
        largest = worse(largest, (f64::from(pixel[0]) / expected - 1.0).abs());
    }
    let rays = rendered.counters.unwrap_or_default().rays;
    stage.record_with(
        format!("{LIGHTS} lights: relative error"),
        largest,
        Limit::AtMost(MANY_LIMIT),
        format!(
            "rendered in {:.1} s, {} iterations",
            rendered.times.render.as_secs_f64(),
            rendered.iterations
        ),
    );
    stage.record(
        format!("{LIGHTS} lights: rays a pixel"),
        rays.total() as f64 / f64::from(settings.width * settings.height),
        Limit::AtMost(LIGHTS as f64 + 1.0),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_on_paper() {
        let kind = point(DVec3::new(0.0, 0.0, 2.0));
        assert_eq!(irradiance(&kind, DVec3::ZERO), (0.25, 0.25));
        // 3-4-5: d = 2.5, cos = 0.8.
        let (slanted, head_on) = irradiance(&kind, DVec3::new(1.5, 0.0, 0.0));
        assert!((slanted - 0.8 / 6.25).abs() < 1e-15 && (head_on - 1.0 / 6.25).abs() < 1e-15);
        let turn = DQuat::from_rotation_y(0.3);
        let settings = view(33, turn);
        let middle = places(&settings, turn).nth(33 * 16 + 16);
        assert!(middle.is_some_and(|place| place.length() < 1e-6));
    }

    /// The comparison has to be able to fail.
    #[test]
    fn a_wrong_slant_is_noticed() {
        let settings = view(3, DQuat::IDENTITY);
        let places = || places(&settings, DQuat::IDENTITY);
        let kind = kinds()[0].1;
        let right: Vec<[f32; 3]> = places()
            .map(|place| [(f64::from(BASE) / PI * irradiance(&kind, place).0) as f32; 3])
            .collect();
        assert!(slanted_error(places(), &kind, &right) < 1e-6);
        let mut wrong = right.clone();
        wrong[0][0] *= 1.001;
        assert!(slanted_error(places(), &kind, &wrong) > NEAR_LIMIT);
        wrong[0][0] = f32::NAN;
        assert_eq!(slanted_error(places(), &kind, &wrong), f64::INFINITY);
    }
}
