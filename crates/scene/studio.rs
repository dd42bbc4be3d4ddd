//! A neutral photographic studio for scenes that bring no light of their own: a bright, seamless room with a large softbox
//! overhead, a smaller one at the front left and a strip as rim light at the back right, and a key light that casts shadows.
//!
//! glTF models face +Z with +Y up, so "front" is +Z, and "left" -X as seen from there. Everything is grey: colours are the
//! scene's. Measured in the tests: a white diffuse surface that faces the key light reflects 0.98, one that
//! faces away 0.42, the floor 0.85.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::environment::{Environment, EquirectMap};
use crate::model::{Background, Light, LightKind, Scene};

/// What the camera sees behind the scene, linear: grey enough for white things to stand out, light enough for black ones;
/// also the wall at the horizon, so that what glass shows of the room blends in.
pub const BACKGROUND: f32 = 0.45;

/// What the key light adds to a white diffuse surface that faces it.
const KEY_REFLECTED: f64 = 0.43;

/// Texels of the painted map; the edges of its softboxes are several texels wide.
const SIZE: (u32, u32) = (256, 128);

/// Lights `scene` by the studio: environment, key light and a plain background. Meant for scenes without lights for which
/// no environment was given; replaces the surroundings' environment and background, keeps lights that are there.
pub fn add_studio(scene: &mut Scene) {
    scene.surroundings.environment = Some(studio_environment());
    scene.surroundings.background = Background::Color(Vec3::splat(BACKGROUND));
    scene.lights.push(key_light());
}

/// The studio as light from all around; neutral grey, mean radiance about 0.5.
#[must_use]
pub fn studio_environment() -> Environment {
    let softboxes = softboxes();
    let map = EquirectMap::from_directions(SIZE.0, SIZE.1, |direction| {
        let boxes: f64 = softboxes.iter().map(|softbox| softbox.at(direction)).sum();
        DVec3::splat(room(direction.y) + boxes)
    });
    Environment::new(map, 0.0)
}

/// The key light: directional, from above at the front left.
#[must_use]
pub fn key_light() -> Light {
    Light {
        name: "studio key".to_owned(),
        kind: LightKind::Directional {
            direction: -towards_key(),
        },
        intensity: DVec3::splat(KEY_REFLECTED * PI),
    }
}

/// 40 degrees up, 40 degrees to the left of the front.
fn towards_key() -> DVec3 {
    DVec3::new(-0.492, 0.643, 0.587).normalize()
}

/// The room without its softboxes, by the height of the direction: 0.35 at the floor, 0.3 at the ceiling, and in
/// between, at the horizon, as bright as the background.
fn room(y: f64) -> f64 {
    const FLOOR: f64 = 0.35;
    const CEILING: f64 = 0.3;
    let horizon = f64::from(BACKGROUND);
    let end = if y < 0.0 { FLOOR } else { CEILING };
    horizon + (end - horizon) * smoothstep(0.1, 0.9, y.abs())
}

/// A rectangle of light at unit distance, facing the scene.
struct Softbox {
    /// Unit direction of its middle.
    towards: DVec3,
    /// Its horizontal axis.
    across: DVec3,
    /// Its other axis.
    along: DVec3,
    /// Half sizes along the two axes.
    half_size: [f64; 2],
    /// What it adds to the room.
    radiance: f64,
}

fn softboxes() -> [Softbox; 3] {
    [
        Softbox::new(DVec3::new(0.0, 1.0, 0.1), [0.5, 0.35], 1.5),
        Softbox::new(towards_key(), [0.18, 0.18], 2.0),
        Softbox::new(DVec3::new(0.85, 0.25, -0.45), [0.1, 0.5], 1.2),
    ]
}

impl Softbox {
    fn new(towards: DVec3, half_size: [f64; 2], radiance: f64) -> Self {
        let towards = towards.normalize();
        let across = DVec3::Y.cross(towards).normalize();
        Self {
            towards,
            across,
            along: towards.cross(across),
            half_size,
            radiance,
        }
    }

    /// What it adds in `direction`; its edges fade over the outer 40 % of each half size.
    fn at(&self, direction: DVec3) -> f64 {
        let distance = direction.dot(self.towards);
        if distance <= 0.0 {
            return 0.0;
        }
        let fade = |axis: DVec3, half_size: f64| {
            let position = (direction.dot(axis) / distance).abs() / half_size;
            1.0 - smoothstep(0.6, 1.0, position)
        };
        self.radiance * fade(self.across, self.half_size[0]) * fade(self.along, self.half_size[1])
    }
}

fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a white diffuse surface reflects, lit by the environment and the key light, nothing in between.
    fn white_diffuse(environment: &Environment, normal: DVec3) -> f64 {
        let key = KEY_REFLECTED * normal.dot(towards_key()).max(0.0);
        environment.sample_irradiance(normal).x + key
    }

    #[test]
    fn exposes_white_surfaces_well() {
        let environment = studio_environment();
        let at = |normal| white_diffuse(&environment, normal);
        let facing = at(towards_key());
        assert!((0.9..1.0).contains(&facing), "facing the key: {facing}");
        for (name, normal) in [
            ("away from the key", -towards_key()),
            ("right", DVec3::X),
            ("back", DVec3::NEG_Z),
        ] {
            let shade = at(normal);
            assert!((0.4..0.55).contains(&shade), "{name}: {shade}");
        }
        let up = at(DVec3::Y);
        assert!((0.8..1.0).contains(&up), "up: {up}");
    }

    #[test]
    fn is_neutral_and_smooth() {
        let map = studio_environment().radiance;
        assert!(
            map.texels
                .iter()
                .all(|&[r, g, b]| r == g && g == b && r > 0.0)
        );
        let (width, height) = (map.width as usize, map.height as usize);
        let at = |x: usize, y: usize| map.texels[y * width + x % width][0];
        let brightest = map
            .texels
            .iter()
            .fold(0.0f32, |max, texel| max.max(texel[0]));
        let steepest = (0..height - 1)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                (at(x, y) - at(x + 1, y))
                    .abs()
                    .max((at(x, y) - at(x, y + 1)).abs())
            })
            .fold(0.0, f32::max);
        assert!(
            steepest < 0.5 * brightest,
            "steepest edge {steepest} of {brightest}"
        );
    }

    #[test]
    fn key_light_comes_from_the_front_left_above() {
        let LightKind::Directional { direction } = key_light().kind else {
            panic!("the key light is directional");
        };
        assert!((direction.length() - 1.0).abs() < 1e-12);
        assert!(direction.x > 0.0 && direction.y < 0.0 && direction.z < 0.0);
    }

    #[test]
    fn lights_a_scene() {
        let mut scene = Scene::default();
        add_studio(&mut scene);
        assert_eq!(scene.lights, [key_light()]);
        assert!(scene.surroundings.environment.is_some());
        assert_eq!(
            scene.surroundings.background,
            Background::Color(Vec3::splat(BACKGROUND))
        );
    }
}
