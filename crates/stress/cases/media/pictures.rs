//! Pictures against the oracle's, and against pictures of the same thing modelled otherwise.

use glam::{Quat, Vec3};
use raytree_film::Film;
use raytree_scene::model::{Camera, Material, Scene};

use super::scenes::{Blocks, Cut, doubled, glass, settings, slanted, solid, stone, water};
use crate::{
    judge::{difference, judge_picture, largest_difference},
    report::Limit,
    stage::{Stage, StressError},
};

/// Of radiance 1: what no edge explains.
const TOLERANCE: f64 = 1e-3;

/// Pixels that are within it, edges and all.
const NEAR_SHARE: f64 = 0.99;

/// The same thing modelled otherwise, but for other roundings on the way.
const SAME: f64 = 1e-4;

struct Shot {
    name: &'static str,
    scene: Scene,
    camera: Camera,
}

pub(super) fn against_oracle(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let (mut worst, mut near) = (0.0_f64, 1.0_f64);
    for shot in shots() {
        let settings = settings(shot.camera);
        let film = stage.render(&shot.scene, &settings)?.film;
        keep(&film, shot.name);
        let judged = judge_picture(&shot.scene, &settings, &film, TOLERANCE);
        let note = format!(
            "{:.3} % of the pixels within {TOLERANCE}",
            100.0 * judged.near_share
        );
        stage.record_with(shot.name, judged.worst, Limit::AtMost(TOLERANCE), note);
        near = near.min(judged.near_share);
        worst = worst.max(judged.worst);
    }
    stage.record(
        "share of pixels near the oracle's, the lowest of all pictures",
        near,
        Limit::AtLeast(NEAR_SHARE),
    );
    Ok(())
}

/// Leaves the picture where `RAYTREE_STRESS_PICTURES` says, for people to look at.
fn keep(film: &Film, name: &str) {
    if let Some(folder) = std::env::var_os("RAYTREE_STRESS_PICTURES") {
        let name: String = name
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '-' })
            .collect();
        let path = std::path::Path::new(&folder).join(format!("media-{name}.png"));
        let _ = film.write(&path, &raytree_film::WriteOptions::default());
    }
}

fn shots() -> Vec<Shot> {
    let above = (Vec3::new(0.9, 0.8, 2.4), Vec3::new(0.0, 0.05, 0.0));
    let mut shots = Vec::new();
    let mut add = |name, blocks: Blocks, (from, to): (Vec3, Vec3)| {
        let camera = blocks.camera(from, to, 0.6);
        shots.push(Shot {
            name,
            scene: blocks.build.0,
            camera,
        });
    };
    let straight = Quat::IDENTITY;
    add("glass in water, no contact", nested(straight, 0.1), above);
    add(
        "camera in the water",
        nested(straight, 0.1),
        (Vec3::new(0.4, 0.2, 0.42), Vec3::new(-0.1, 0.0, 0.0)),
    );
    add(
        "camera in the glass in the water",
        nested(slanted(), 0.1),
        (Vec3::new(0.1, 0.05, 0.12), Vec3::new(-0.3, 0.1, -1.0)),
    );
    add(
        "glass stands on the tank's bottom",
        nested(straight, 0.0),
        above,
    );
    add("the same, slanted", nested(slanted(), 0.0), above);
    for (turn, cut, name) in [
        (
            straight,
            Cut::Diagonal,
            "water beside glass, same triangles",
        ),
        (straight, Cut::Fan, "water beside glass, other triangles"),
        (
            slanted(),
            Cut::Across,
            "the same, slanted, the other diagonal",
        ),
        (slanted(), Cut::Fan, "the same, slanted, a fan"),
    ] {
        add(name, beside(turn, cut, water(), glass()), above);
    }
    add(
        "camera in glass beside water",
        beside(slanted(), Cut::Fan, water(), glass()),
        (Vec3::new(0.3, 0.1, 0.2), Vec3::new(-0.6, 0.05, -0.1)),
    );
    add("a block of glass on a floor", on_floor(straight), above);
    add("the same, slanted", on_floor(slanted()), above);
    add("overlap, the first has priority", overlap([1, 0]), above);
    add("overlap, the second has priority", overlap([-3, 7]), above);
    add("overlap without priorities", overlap([0, 0]), above);
    add(
        "camera in the overlap",
        overlap([1, 0]),
        (Vec3::new(0.02, 0.03, 0.05), Vec3::new(0.5, 0.2, -1.0)),
    );
    add(
        "a bubble, by the glass's surface turned inwards",
        bubble(None),
        above,
    );
    add(
        "a bubble, as a solid of index 1",
        bubble(Some(solid(1.0, 0.0, 1.0))),
        above,
    );
    shots
}

/// Glass in a tank of water over a floor; `gap` below the glass.
fn nested(turn: Quat, gap: f32) -> Blocks {
    let mut blocks = Blocks::new(turn).lit();
    let [water, glass, floor] = [water(), glass(), stone()].map(|m| blocks.build.material(m));
    blocks.floor(-0.8, 1.0, floor);
    blocks.block(Vec3::splat(-0.5), Vec3::splat(0.5), water, Cut::Diagonal);
    let min = Vec3::new(-0.25, -0.5 + gap, -0.3);
    blocks.block(min, Vec3::new(0.3, 0.2, 0.25), glass, Cut::Across);
    blocks
}

/// Two blocks that share a face, or a part of one.
fn beside(turn: Quat, cut: Cut, left: Material, right: Material) -> Blocks {
    let mut blocks = Blocks::new(turn).lit();
    let [left, right, floor] = [left, right, stone()].map(|m| blocks.build.material(m));
    blocks.floor(-0.8, 1.0, floor);
    let (low, high) = (Vec3::new(-0.7, -0.5, -0.4), Vec3::new(0.0, 0.5, 0.4));
    blocks.block(low, high, left, Cut::Diagonal);
    // With other triangles than a diagonal's also another size.
    let shorter = if matches!(cut, Cut::Fan) { 0.15 } else { 0.0 };
    let (low, high) = (
        Vec3::new(0.0, -0.5, -0.4),
        Vec3::new(0.6, 0.5 - shorter, 0.4),
    );
    blocks.block(low, high, right, cut);
    blocks
}

/// A block of glass whose lower face lies in the floor.
fn on_floor(turn: Quat) -> Blocks {
    let mut blocks = Blocks::new(turn).lit();
    let [glass, floor] = [glass(), stone()].map(|m| blocks.build.material(m));
    // The glass before the floor: its face is met first where both are equally far.
    blocks.block(
        Vec3::new(-0.4, -0.5, -0.4),
        Vec3::new(0.4, 0.3, 0.4),
        glass,
        Cut::Across,
    );
    blocks.floor(-0.5, 0.9, floor);
    blocks
}

/// Two blocks that overlap in part, of these priorities.
fn overlap(priorities: [i32; 2]) -> Blocks {
    let mut blocks = Blocks::new(Quat::IDENTITY).lit();
    let [first, second] =
        [(water(), priorities[0]), (glass(), priorities[1])].map(|(material, priority)| {
            blocks.build.material(Material {
                priority,
                ..material
            })
        });
    let floor = blocks.build.material(stone());
    blocks.floor(-0.8, 1.0, floor);
    blocks.block(
        Vec3::new(-0.6, -0.4, -0.4),
        Vec3::new(0.2, 0.4, 0.4),
        first,
        Cut::Diagonal,
    );
    blocks.block(
        Vec3::new(-0.2, -0.5, -0.3),
        Vec3::new(0.6, 0.3, 0.5),
        second,
        Cut::Diagonal,
    );
    blocks
}

/// A ball of air in a block of glass.
fn bubble(air: Option<Material>) -> Blocks {
    let mut blocks = Blocks::new(Quat::IDENTITY).lit();
    let [clear, floor] = [glass(), stone()].map(|m| blocks.build.material(m));
    blocks.floor(-0.8, 1.0, floor);
    blocks.block(Vec3::splat(-0.5), Vec3::splat(0.5), clear, Cut::Diagonal);
    let first = blocks.build.0.geometry.triangles.len();
    let material = air
        .as_ref()
        .map_or(clear, |air| blocks.build.material(air.clone()));
    blocks
        .build
        .ball(Vec3::new(0.05, 0.0, 0.1), 0.25, 3, material);
    if air.is_none() {
        let geometry = &mut blocks.build.0.geometry;
        for triangle in &mut geometry.triangles[first..] {
            triangle.vertices.reverse();
            // Each vertex of the ball belongs to the ball alone.
            for vertex in triangle.vertices {
                let normal = &mut geometry.normals[vertex as usize];
                let outwards = geometry.positions[vertex as usize] - Vec3::new(0.05, 0.0, 0.1);
                *normal = -outwards.normalize();
            }
        }
    }
    blocks
}

/// The largest difference of two pictures; NaN if any pixel is.
/// Of all pixels but this share, which lie on the outlines of what differs by rounding.
fn difference_but_for_edges(a: &Film, b: &Film) -> f64 {
    const EDGES: f64 = 0.01;
    let mut differences: Vec<f64> = a
        .radiance
        .iter()
        .zip(&b.radiance)
        .map(|(a, b)| difference(a.map(f64::from), b.map(f64::from)))
        .collect();
    // NaN sorts last, so a few of them would be taken for edges.
    if differences.iter().any(|d| d.is_nan()) {
        return f64::NAN;
    }
    differences.sort_by(f64::total_cmp);
    let kept = (differences.len() as f64 * (1.0 - EDGES)) as usize;
    differences
        .get(kept.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

pub(super) fn of_the_same_thing(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let from = Vec3::new(0.9, 0.8, 2.4);
    let mut compare = |name: &str, one: Blocks, other: Scene| {
        let settings = settings(one.camera(from, Vec3::new(0.0, 0.05, 0.0), 0.6));
        let one = stage.render(&one.build.0, &settings)?.film;
        let other = stage.render(&other, &settings)?.film;
        keep(&one, name);
        let measured = difference_but_for_edges(&one, &other);
        let note = format!(
            "the largest of all pixels: {:.1e}",
            largest_difference(&one, &other)
        );
        stage.record_with(name, measured, Limit::AtMost(SAME), note);
        Ok::<(), StressError>(())
    };
    for (name, turn, cut) in [
        (
            "two glued blocks of one glass are one block",
            Quat::IDENTITY,
            Cut::Across,
        ),
        ("the same, slanted", slanted(), Cut::Across),
    ] {
        let mut whole = Blocks::new(turn).lit();
        let [glass_, floor] = [glass(), stone()].map(|m| whole.build.material(m));
        whole.floor(-0.8, 1.0, floor);
        whole.block(
            Vec3::new(-0.7, -0.5, -0.4),
            Vec3::new(0.6, 0.5, 0.4),
            glass_,
            Cut::Diagonal,
        );
        compare(name, beside(turn, cut, glass(), glass()), whole.build.0)?;
    }
    let once = beside(slanted(), Cut::Across, water(), glass());
    let twice = doubled(once.build.0.clone());
    compare("every triangle twice is every triangle once", once, twice)?;
    compare(
        "a bubble is a bubble, whichever way it is modelled",
        bubble(None),
        bubble(Some(solid(1.0, 0.0, 1.0))).build.0,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_and_a_nan_are_noticed() {
        let black = Film::new(40, 40);
        assert_eq!(difference_but_for_edges(&black, &black), 0.0);
        let mut other = black.clone();
        other.radiance[7] = [0.0, 0.5, 0.0];
        assert_eq!(largest_difference(&black, &other), 0.5);
        // One pixel may be an edge, a hundredth of them may; not more.
        assert_eq!(difference_but_for_edges(&black, &other), 0.0);
        for pixel in &mut other.radiance[..20] {
            *pixel = [0.25; 3];
        }
        assert_eq!(difference_but_for_edges(&black, &other), 0.25);
        other.radiance[3] = [f32::NAN, 0.0, 0.0];
        assert!(difference_but_for_edges(&black, &other).is_nan());
        assert!(largest_difference(&black, &other).is_nan());
    }
}
