//! Our own scenes from 10^-12 to 10^12 times their size.
//!
//! A scene is scaled as a thing of the world is: a node above all others scales it, point lights shine the square of the scale
//! brighter, ranges, attenuation distances and parallel views grow with it. Then it is the same picture.

use glam::DVec3;
use raytree_film::Film;
use raytree_gpu::RenderSettings;
use raytree_scene::model::{LightKind, Material, Projection, Scene};
use serde_json::{Value, json};

use crate::{
    documents::{Document, default_camera},
    judge::{largest_difference, worse},
    report::Limit,
    stage::{Stage, StressError},
};

/// Exponents of the scales: all are imported and compared; these are rendered, and besides them each whose scene differs.
const RENDERED_OF_TWO: [i32; 4] = [-40, -13, 17, 40];
const RENDERED_OF_TEN: [i32; 4] = [-12, -5, 3, 12];

/// Pixels of the pictures.
const SIZE: (u32, u32) = (96, 72);

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for document in Document::own_scenes() {
        let unscaled = Picture::of(stage, document.import()?)?;
        by_powers_of_two(stage, &document, &unscaled)?;
        by_powers_of_ten(stage, &document, &unscaled)?;
    }
    Ok(())
}

/// A scene and what it looks like.
pub(crate) struct Picture {
    pub scene: Scene,
    pub film: Film,
}

impl Picture {
    pub fn of(stage: &mut Stage<'_>, scene: Scene) -> Result<Self, StressError> {
        let settings = RenderSettings::new(SIZE.0, SIZE.1, default_camera(&scene));
        let film = stage.render(&scene, &settings)?.film;
        Ok(Self { scene, film })
    }
}

fn by_powers_of_two(
    stage: &mut Stage<'_>,
    document: &Document,
    unscaled: &Picture,
) -> Result<(), StressError> {
    let (mut scenes, mut pixels) = (0, 0);
    for k in -40..=40 {
        let scene = scaled(document, 2_f64.powi(k)).import()?;
        let differs = !renders_alike(&scene, &unscaled.scene);
        scenes += u32::from(differs);
        if differs || RENDERED_OF_TWO.contains(&k) {
            pixels += different_pixels(&Picture::of(stage, scene)?.film, &unscaled.film);
        }
    }
    let name = &document.name;
    stage.record(
        format!("{name} by 2^k, k = -40..40: scenes that differ in a bit"),
        f64::from(scenes),
        Limit::AtMost(0.0),
    );
    stage.record(
        format!("{name} by 2^-40, 2^-13, 2^17, 2^40: pixels that differ in a bit"),
        pixels as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

fn by_powers_of_ten(
    stage: &mut Stage<'_>,
    document: &Document,
    unscaled: &Picture,
) -> Result<(), StressError> {
    let (mut scenes, mut worst) = (0, 0.0);
    for k in -12..=12 {
        let scene = scaled(document, 10_f64.powi(k)).import()?;
        let differs = !renders_alike(&scene, &unscaled.scene);
        scenes += u32::from(differs);
        if differs || RENDERED_OF_TEN.contains(&k) {
            let film = Picture::of(stage, scene)?.film;
            worst = worse(worst, largest_difference(&film, &unscaled.film));
        }
    }
    stage.record_with(
        format!("{} by 10^k, k = -12..12: worst pixel", document.name),
        worst,
        Limit::AtMost(1e-5),
        format!("{scenes} of the 25 scenes differ in a bit"),
    );
    Ok(())
}

/// The document `scale` times as large.
fn scaled(document: &Document, scale: f64) -> Document {
    let mut document = document.clone();
    let multiply = |value: Option<&mut Value>, by: f64| {
        if let Some(value) = value
            && let Some(number) = value.as_f64()
        {
            *value = json!(number * by);
        }
    };
    document.hang_under(json!({ "name": "scale", "scale": [scale, scale, scale] }));
    for camera in document.elements("cameras") {
        for magnification in ["xmag", "ymag"] {
            let pointer = format!("/orthographic/{magnification}");
            multiply(camera.pointer_mut(&pointer), scale);
        }
    }
    for material in document.elements("materials") {
        let volume = "/extensions/KHR_materials_volume/attenuationDistance";
        multiply(material.pointer_mut(volume), scale);
    }
    let lights = document
        .json
        .pointer_mut("/extensions/KHR_lights_punctual/lights")
        .and_then(Value::as_array_mut);
    for light in lights.into_iter().flatten() {
        multiply(light.get_mut("range"), scale);
        if light["type"] != "directional" {
            // An intensity that the file leaves out is 1.
            let intensity = light["intensity"].as_f64().unwrap_or(1.0);
            light["intensity"] = json!(intensity * scale * scale);
        }
    }
    document
}

/// Is all that the renderer reads the same? Of f64 numbers it reads what f32 keeps of them.
pub(crate) fn renders_alike(a: &Scene, b: &Scene) -> bool {
    let (one, other) = (&a.geometry, &b.geometry);
    one.positions == other.positions
        && one.normals == other.normals
        && one.tangents == other.tangents
        && one.uv_sets == other.uv_sets
        && one.colors == other.colors
        && one.triangles == other.triangles
        && a.textures == b.textures
        && a.images == b.images
        && without_lengths(a) == without_lengths(b)
        && numbers(a) == numbers(b)
}

/// The materials, their lengths left to [`numbers`].
fn without_lengths(scene: &Scene) -> Vec<Material> {
    let mut materials = scene.materials.clone();
    for volume in materials.iter_mut().filter_map(|m| m.volume.as_mut()) {
        volume.attenuation_distance = 0.0;
    }
    materials
}

/// Every f64 of a scene that the renderer reads, rounded.
fn numbers(scene: &Scene) -> Vec<f32> {
    let lights = scene.lights.iter().flat_map(|light| {
        let (vectors, numbers) = match light.kind {
            LightKind::Directional { direction } => ([direction, DVec3::ZERO], [0.0; 3]),
            LightKind::Point { position, range } => ([position, DVec3::ZERO], [range, 0.0, 0.0]),
            LightKind::Spot {
                position,
                direction,
                range,
                inner_cone_angle,
                outer_cone_angle,
            } => (
                [position, direction],
                [range, inner_cone_angle, outer_cone_angle],
            ),
        };
        flat(&[light.intensity, vectors[0], vectors[1]], &numbers)
    });
    let cameras = scene.cameras.iter().flat_map(|camera| {
        let lens = match camera.projection {
            Projection::Perspective { yfov, aspect } => [yfov, aspect.unwrap_or(0.0)],
            Projection::Orthographic { xmag, ymag } => [xmag, ymag],
        };
        flat(
            &[camera.position, camera.right, camera.up, camera.forward],
            &lens,
        )
    });
    let volumes = scene.materials.iter().filter_map(|m| m.volume);
    let numbers = volumes.map(|volume| volume.attenuation_distance);
    let all = lights.chain(cameras).chain(numbers);
    all.map(|number| number as f32).collect()
}

fn flat(vectors: &[DVec3], numbers: &[f64]) -> Vec<f64> {
    let vectors = vectors.iter().flat_map(|vector| vector.to_array());
    vectors.chain(numbers.iter().copied()).collect()
}

/// Pixels of which a bit differs.
fn different_pixels(a: &Film, b: &Film) -> usize {
    let bits = |film: &Film| -> Vec<[u32; 4]> {
        let pixels = film.radiance.iter().zip(&film.alpha);
        pixels
            .map(|([r, g, b], alpha)| [r, g, b, alpha].map(|c| c.to_bits()))
            .collect()
    };
    let (a, b) = (bits(a), bits(b));
    a.len().abs_diff(b.len()) + a.iter().zip(&b).filter(|(a, b)| a != b).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cornell() -> Document {
        let mut all = Document::own_scenes();
        all.retain(|document| document.name == "cornell");
        all.remove(0)
    }

    #[test]
    fn a_bit_is_a_difference() {
        let (one, mut other) = (Film::new(3, 2), Film::new(3, 2));
        assert_eq!(different_pixels(&one, &other), 0);
        other.radiance[1][2] = f32::from_bits(1);
        other.alpha[4] = -0.0;
        assert_eq!(different_pixels(&one, &other), 2);
        assert_eq!(different_pixels(&one, &Film::new(2, 2)), 2);
    }

    #[test]
    fn the_worst_pixel_is_found_and_no_nan_is_passed_over() {
        let (one, mut other) = (Film::new(3, 2), Film::new(3, 2));
        other.radiance[1][2] = 0.25;
        other.radiance[3][0] = 0.125;
        assert_eq!(largest_difference(&one, &other), 0.25);
        other.radiance[2][0] = f32::NAN;
        assert!(largest_difference(&one, &other).is_nan());
        assert!(largest_difference(&one, &Film::new(2, 2)).is_nan());
    }

    #[test]
    fn what_the_renderer_reads_is_compared() {
        let scene = cornell().import().unwrap();
        assert!(renders_alike(&scene, &scene.clone()));
        let differs = |change: fn(&mut Scene)| {
            let mut changed = scene.clone();
            change(&mut changed);
            !renders_alike(&scene, &changed)
        };
        assert!(differs(|scene| scene.geometry.positions[7].y += 1e-7));
        assert!(differs(|scene| scene.lights[0].intensity.x *= 1.0 + 1e-6));
        assert!(differs(|scene| scene.cameras[0].position.z += 1e-6));
        assert!(differs(|scene| scene.materials[0].roughness += 1e-6));
    }

    /// Without the light's share a scaled scene is another picture.
    #[test]
    fn only_what_is_scaled_whole_is_the_same_scene() {
        let (document, unscaled) = (cornell(), cornell().import().unwrap());
        let large = scaled(&document, 8.0);
        assert!(renders_alike(&large.import().unwrap(), &unscaled));
        let mut dark = large;
        dark.json["extensions"] = document.json["extensions"].clone();
        assert!(!renders_alike(&dark.import().unwrap(), &unscaled));
    }
}
