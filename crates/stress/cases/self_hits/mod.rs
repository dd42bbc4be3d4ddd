//! Rays that leave a surface, by the code that pictures are made by: no false hit, no missed neighbour.

mod judge;
mod rays;
mod thing;

use glam::{Quat, Vec3};
use raytree_gpu::types::{SecondaryHit, SecondaryRay};
use raytree_scene::model::Scene;

use crate::{
    meshes::{Mesh, ellipsoid, needles, terrain_box},
    report::Limit,
    stage::{Stage, StressError},
};
use judge::{Judge, Tally};

/// Pairs of rays a mesh.
const PAIRS: usize = 500_000;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut wrong_side = 0;
    let mut first_wrong = None;
    for mesh in meshes() {
        let rays = rays::all_over(&mesh, PAIRS);
        let tally = judge_scene(stage, &mesh.name, &mesh.scene, &rays)?;
        wrong_side += tally.wrong_side;
        first_wrong = first_wrong.or(tally.first_wrong_side);
    }
    let (scene, rays) = thing::scene_and_rays(PAIRS);
    let name = "a thing of 1e-4 m on a plane of 1e6 m";
    let tally = judge_scene(stage, name, &scene, &rays)?;
    wrong_side += tally.wrong_side;
    let note = first_wrong.or(tally.first_wrong_side).unwrap_or_default();
    stage.record_with(
        "rays sent to the wrong side of their facet",
        wrong_side as f64,
        Limit::AtMost(0.0),
        note,
    );
    Ok(())
}

/// Curved from outside and inside, flat and not along the axes, slivers.
fn meshes() -> [Mesh; 6] {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    [
        ellipsoid("a ball", Vec3::new(0.3, -0.2, 0.1), Vec3::splat(0.7), 32),
        terrain_box("flat walls", 32, 0.0),
        turned(terrain_box("flat walls, turned", 32, 0.0), turn),
        turned(terrain_box("a terrain, turned", 48, 0.02), turn),
        // Along the axes: turned, their boxes would all overlap, and each ray would be tested against all of them.
        needles("needles of aspect 16,000", 300, 0.003, 1.0),
        ellipsoid(
            "a spindle of aspect 10,000",
            Vec3::ZERO,
            Vec3::new(1.0, 1e-4, 1e-4),
            24,
        ),
    ]
}

/// The same mesh turned about the origin; its vertices rounded again, so that flat walls are as flat as f32 has them.
fn turned(mut mesh: Mesh, turn: Quat) -> Mesh {
    let geometry = &mut mesh.scene.geometry;
    for vector in geometry.positions.iter_mut().chain(&mut geometry.normals) {
        *vector = turn.mul_vec3(*vector);
    }
    mesh
}

fn judge_scene(
    stage: &mut Stage<'_>,
    name: &str,
    scene: &Scene,
    rays: &[SecondaryRay],
) -> Result<Tally, StressError> {
    let hits: Vec<SecondaryHit> = stage.secondary_prober(scene)?.trace(rays)?;
    let tally = Judge::new(scene).judge_all(rays, &hits);
    stage.count_rays(tally.rays);
    let note = |first: &Option<String>| match first {
        Some(first) => format!("the first: {first}"),
        None => format!(
            "of {} that leave; {} pass beside an outline by less than f32 can tell",
            tally.pairs, tally.beside
        ),
    };
    let none = Limit::AtMost(0.0);
    let count = tally.of_pairs(tally.false_hits);
    stage.record_with(
        format!("false hits: {name}"),
        count,
        none,
        note(&tally.first_false),
    );
    let count = tally.of_pairs(tally.missed);
    stage.record_with(
        format!("missed neighbours: {name}"),
        count,
        none,
        note(&tally.first_missed),
    );
    stage.record_with(
        format!("start of a ray, off in bounds of its error: {name}"),
        tally.start + tally.of_pairs(0),
        Limit::AtMost(1.0),
        tally.farthest_start.clone().unwrap_or_default(),
    );
    Ok(tally)
}
