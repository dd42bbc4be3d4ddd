//! Triangles that can't be hit and such as are there twice: the picture is that of the file without them, to the bit.

use glam::Vec3;
use raytree_gpu::RenderSettings;
use raytree_scene::model::Scene;
use serde_json::json;

use super::file::File;
use crate::{
    judge::judge_picture,
    report::Limit,
    scenes::pinhole,
    stage::{Stage, StressError},
};

/// Corners of triangles, three by three.
type Corners = Vec<[f32; 3]>;

/// Bad triangles, each of a kind several times, and how they are to be counted.
struct Bad {
    corners: Corners,
    /// Triangles without area.
    no_area: usize,
    /// Triangles with a corner that is infinite or not a number.
    not_finite: usize,
}

/// Of the scene's extent, which is 1: scene space is world space.
fn bad() -> Bad {
    let (nan, inf, tiny) = (f32::NAN, f32::INFINITY, 1e-40);
    let a = [0.1, 0.0, 30.0];
    let no_area = [
        // On a line; two corners in one place; a point. Far away, where they would make the scene large.
        ([[0.0, 0.0, 20.0], [0.1, 0.0, 20.0], [0.2, 0.0, 20.0]], 3),
        ([a, a, [0.0, 0.2, 0.3]], 4),
        ([a, a, a], 5),
        // On a line in f32, by less than its last bit; smaller than f32 can multiply.
        (
            [
                [0.25, 0.25, 0.25],
                [0.3, 0.3, 0.3],
                [0.35, 0.35, 0.35 + 1e-9],
            ],
            2,
        ),
        ([[0.0; 3], [tiny, 0.0, 0.0], [0.0, tiny, 0.0]], 6),
    ];
    let not_finite = [
        ([[nan, 0.0, 0.3], a, [0.0, 0.2, 0.3]], 2),
        ([a, [0.0, inf, 0.3], [0.0, 0.2, 0.3]], 3),
        ([a, [0.0, 0.2, 0.3], [0.3, 0.2, -inf]], 4),
        ([[nan; 3]; 3], 1),
        ([[inf; 3], [-inf; 3], [nan; 3]], 1),
    ];
    let repeated = |kinds: &[([[f32; 3]; 3], usize)]| -> Corners {
        let copies = kinds
            .iter()
            .flat_map(|(corners, count)| vec![*corners; *count]);
        copies.flatten().collect()
    };
    let count = |kinds: &[([[f32; 3]; 3], usize)]| kinds.iter().map(|(_, count)| count).sum();
    Bad {
        corners: [repeated(&no_area), repeated(&not_finite)].concat(),
        no_area: count(&no_area),
        not_finite: count(&not_finite),
    }
}

/// Two triangles.
fn quad(half: f32, z: f32) -> Corners {
    let corner = |x: f32, y: f32| [x * half, y * half, z];
    vec![
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ]
}

/// A lit wall with a square before it that casts a shadow, and whatever is added.
fn wall(added: &[(&Corners, [f64; 3])]) -> Result<Scene, StressError> {
    let mut file = File::new();
    let grey =
        json!({ "baseColorFactor": [0.7, 0.6, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 1 });
    let grey = file.push("materials", json!({ "pbrMetallicRoughness": grey }));
    file.triangles(&[quad(0.5, 0.0), quad(0.1, 0.2)].concat(), grey, json!({}));
    for (corners, translation) in added {
        file.triangles(corners, grey, json!({ "translation": translation }));
    }
    file.light([0.2, 0.3, 0.6], 1.0);
    file.import()
}

fn view() -> RenderSettings {
    let camera = pinhole(Vec3::new(0.1, -0.2, 1.5), Vec3::ZERO, 0.8);
    RenderSettings::new(48, 48, camera)
}

/// The number that a warning starts with, of those that have these words.
fn warned(scene: &Scene, words: &str) -> Option<usize> {
    let warning = scene.warnings.iter().find(|w| w.text.contains(words))?;
    warning.text.split_whitespace().next()?.parse().ok()
}

/// By how much the warnings are off.
fn miscounted(scene: &Scene, expected: &Bad) -> usize {
    let off =
        |words: &str, expected: usize| warned(scene, words).unwrap_or_default().abs_diff(expected);
    off("no area", expected.no_area) + off("infinite or not a number", expected.not_finite)
}

/// Pixels that differ in any bit, and those that are infinite or not a number.
fn different(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    let alike = |(a, b): (&[f32; 3], &[f32; 3])| {
        a.map(f32::to_bits) == b.map(f32::to_bits) && a.iter().all(|x| x.is_finite())
    };
    a.len() - a.iter().zip(b).filter(|&pair| alike(pair)).count()
}

pub(super) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    const TOLERANCE: f64 = 1e-3;
    let settings = view();
    let clean = wall(&[])?;
    let picture = stage.render(&clean, &settings)?.film;
    let judged = judge_picture(&clean, &settings, &picture, TOLERANCE);
    stage.record(
        "a wall and its shadow: pixels that the oracle does not see",
        judged.unexplained.len() as f64,
        Limit::AtMost(0.0),
    );

    // Too small for f32 where it stands, but not in its own space.
    let speck = vec![[0.0; 3], [1e-9, 0.0, 0.0], [0.0, 1e-9, 0.0]];
    let speck_at = [0.3, 0.3, 0.1];
    let mut expected = bad();
    let scene = wall(&[(&expected.corners, [0.0; 3]), (&speck, speck_at)])?;
    expected.no_area += 1;
    stage.record_with(
        "no area, infinite, NaN: triangles counted wrong in the warnings",
        miscounted(&scene, &expected) as f64,
        Limit::AtMost(0.0),
        format!(
            "{} without area, {} infinite or NaN",
            expected.no_area, expected.not_finite
        ),
    );
    let left = scene.geometry.triangles.len();
    stage.record(
        "no area, infinite, NaN: such triangles left in the scene",
        left.abs_diff(clean.geometry.triangles.len()) as f64,
        Limit::AtMost(0.0),
    );
    let broken = stage.render(&scene, &settings)?.film;
    stage.record(
        "no area, infinite, NaN: pixels that they change",
        different(&broken.radiance, &picture.radiance) as f64,
        Limit::AtMost(0.0),
    );

    let again = quad(0.5, 0.0).repeat(200);
    let doubled = stage.render(&wall(&[(&again, [0.0; 3])])?, &settings)?.film;
    stage.record(
        "the wall 201 times: pixels that this changes",
        different(&doubled.radiance, &picture.radiance) as f64,
        Limit::AtMost(0.0),
    );

    denormal(stage, &settings, &picture.radiance)?;
    nothing_left(stage, &settings)
}

/// The wall's corners moved by less than any arithmetic notices.
fn denormal(
    stage: &mut Stage<'_>,
    settings: &RenderSettings,
    picture: &[[f32; 3]],
) -> Result<(), StressError> {
    let mut file = File::new();
    let grey =
        json!({ "baseColorFactor": [0.7, 0.6, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 1 });
    let grey = file.push("materials", json!({ "pbrMetallicRoughness": grey }));
    let mut corners = quad(0.5, 0.0);
    let offsets = [1e-40, -3e-42, 1e-45].into_iter().cycle();
    for (corner, offset) in corners.iter_mut().zip(offsets) {
        corner[2] = offset;
    }
    file.triangles(&[corners, quad(0.1, 0.2)].concat(), grey, json!({}));
    file.light([0.2, 0.3, 0.6], 1.0);
    let film = stage.render(&file.import()?, settings)?.film;
    stage.record(
        "denormal coordinates: pixels that they change",
        different(&film.radiance, picture) as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

/// A file in which no triangle is any good is a picture of the background.
fn nothing_left(stage: &mut Stage<'_>, settings: &RenderSettings) -> Result<(), StressError> {
    let mut file = File::new();
    let material = file.push("materials", json!({}));
    // A file of specks alone is refused: it is smaller than any scene may be.
    let corners = bad().corners;
    let no_speck = |corners: &&[[f32; 3]]| !corners.iter().flatten().any(|x| x.is_subnormal());
    let corners: Corners = corners
        .chunks(3)
        .filter(no_speck)
        .flatten()
        .copied()
        .collect();
    file.triangles(&corners, material, json!({}));
    file.light([0.2, 0.3, 0.6], 1.0);
    let film = stage.render(&file.import()?, settings)?.film;
    let black = vec![[0.0; 3]; film.radiance.len()];
    stage.record(
        "nothing but such triangles: pixels that are not background",
        different(&film.radiance, &black) as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use raytree_scene::model::Warning;

    use super::*;

    /// The comparisons have to be able to fail.
    #[test]
    fn wrong_counts_and_pixels_are_noticed() {
        let mut scene = Scene::default();
        let expected = bad();
        assert_eq!((expected.no_area, expected.not_finite), (20, 11));
        assert_eq!(expected.corners.len(), 3 * 31);
        assert_eq!(miscounted(&scene, &expected), 31);
        let mut warn = |text: &str| {
            scene.warnings.push(Warning {
                place: "meshes".to_owned(),
                text: text.to_owned(),
            });
        };
        warn("20 triangles have no area and are left out");
        warn("12 triangles have a corner that is infinite or not a number and are left out");
        assert_eq!(miscounted(&scene, &expected), 1);

        let a = [[0.5; 3], [0.25; 3]];
        assert_eq!(different(&a, &a), 0);
        assert_eq!(
            different(&a, &[[0.5; 3], [0.25, 0.25, 0.25 + f32::EPSILON]]),
            1
        );
        assert_eq!(different(&[[f32::NAN; 3]], &[[f32::NAN; 3]]), 1);
        assert_eq!(different(&a, &a[..1]), 1);
    }
}
