//! What is where no surface is: "Miss", "Environment look-up" and `E`, `G` in `shaders/README.md`.

use std::f64::consts::PI;

use raytree_scene::environment::{Environment, EquirectMap, ROUGH_LEVELS};
use raytree_scene::model::{Background, Surroundings};

use crate::texture::bilinear;
use crate::vec::{Rgb, Vec3};

/// What a ray sees that hits nothing. `straight`: from the camera, at most through BLEND surfaces.
pub(crate) fn background(surroundings: &Surroundings, direction: Vec3, straight: bool) -> Rgb {
    let map = |environment: &Environment| radiance(environment, direction);
    let environment = surroundings.environment.as_ref().map(map);
    let color = match surroundings.background {
        Background::Color(color) => Some(color.to_array().into()),
        Background::Transparent => Some(Rgb::ZERO),
        Background::Environment => None,
    };
    let seen = if straight {
        color.or(environment)
    } else {
        environment.or(color)
    };
    seen.unwrap_or(Rgb::ZERO)
}

/// `E(n)`: what a white diffuse surface reflects of the light from all around.
pub(crate) fn diffuse(surroundings: &Surroundings, normal: Vec3) -> Rgb {
    let irradiance = |environment: &Environment| {
        look_up(&environment.irradiance, turned_back(environment, normal))
    };
    ambient(surroundings)
        + surroundings
            .environment
            .as_ref()
            .map_or(Rgb::ZERO, irradiance)
}

/// `G(d, r)`: what a lobe of roughness `r` gathers around `direction`.
pub(crate) fn glossy(surroundings: &Surroundings, direction: Vec3, roughness: f64) -> Rgb {
    let rough = |environment: &Environment| {
        let direction = turned_back(environment, direction);
        let level = |k: usize| match k {
            0 => look_up(&environment.radiance, direction),
            k => look_up(&environment.rough[k - 1], direction),
        };
        let place = roughness.clamp(0.0, 1.0) * ROUGH_LEVELS as f64;
        let below = (place as usize).min(ROUGH_LEVELS - 1);
        let between = place - below as f64;
        (1.0 - between) * level(below) + between * level(below + 1)
    };
    ambient(surroundings) + surroundings.environment.as_ref().map_or(Rgb::ZERO, rough)
}

fn ambient(surroundings: &Surroundings) -> Rgb {
    surroundings.ambient.to_array().into()
}

fn radiance(environment: &Environment, direction: Vec3) -> Rgb {
    look_up(&environment.radiance, turned_back(environment, direction))
}

/// A direction in the map's own axes: turned by `-rotation` about +Y.
fn turned_back(environment: &Environment, d: Vec3) -> Vec3 {
    let (sin, cos) = environment.rotation.sin_cos();
    Vec3::new(d.x * cos - d.z * sin, d.y, d.x * sin + d.z * cos)
}

fn look_up(map: &EquirectMap, d: Vec3) -> Rgb {
    let u = 0.5 - d.x.atan2(d.z) / (2.0 * PI);
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let (width, height) = (i64::from(map.width), i64::from(map.height));
    let texel = |i: i64, j: i64| {
        let (i, j) = (i.rem_euclid(width), j.clamp(0, height - 1));
        map.texels[(j * width + i) as usize].map(f64::from)
    };
    bilinear(u * width as f64 - 0.5, v * height as f64 - 0.5, texel).into()
}
