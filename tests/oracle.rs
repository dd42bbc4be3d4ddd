//! The required judge: whole pictures of our own scenes, both shading models, against the f64 oracle. A pixel that differs
//! has to lie on an edge: somewhere where the oracle's own picture jumps close by (`raytree_stress::judge`, which also tests that
//! the comparison does fail).

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

mod support;

use raytree::{Device, RenderSettings, Scene, Shading};
use raytree_oracle::Oracle;
use raytree_stress::judge::{judge_picture, oracle_settings};

const WIDTH: u32 = 200;
const HEIGHT: u32 = 150;

/// Largest difference of a channel, of radiance 1; above 1 it is relative. f32 against f64 through up to nine surfaces.
const TOLERANCE: f64 = 1e-3;

/// Share of the pixels that have to be that near.
const NEAR_SHARE: f64 = 0.999;

fn judge(device: &Device, name: &str, scene: &Scene, shading: Shading) -> Vec<String> {
    let camera = support::camera(scene);
    let mut settings = RenderSettings::new(WIDTH, HEIGHT, camera.clone());
    settings.shading = shading;
    settings.counters = true;
    let ours = support::render(device, scene, &settings);

    let judged = judge_picture(scene, &settings, &ours.film, TOLERANCE);
    if std::env::var_os("RAYTREE_VERBOSE").is_some() {
        for pixel in &judged.outliers {
            println!("  {pixel:.4?}");
        }
    }
    let oracle = Oracle::new(scene);
    let unexplained: Vec<String> = judged
        .unexplained
        .iter()
        .map(|pixel| {
            let hit = oracle.first_hit(&camera, &oracle_settings(&settings), pixel.x, pixel.y);
            let node = hit.map_or("background", |hit| scene.nodes[hit.node].as_str());
            format!("{name} {shading:?}: on {node}: {pixel:.5?}")
        })
        .collect();
    let near = judged.near_share;
    let theirs = &judged.theirs;
    let alpha = ours.film.alpha.iter().zip(&theirs.alpha);
    let alpha_off = alpha
        .filter(|(a, b)| (f64::from(**a) - **b).abs() > TOLERANCE)
        .count();
    println!(
        "{name:16} {shading:7?}: {:.3} % within {TOLERANCE}, {} outliers, {} not explained by an edge, {alpha_off} alpha, storage {}",
        100.0 * near,
        judged.outliers.len(),
        unexplained.len(),
        ours.counters.unwrap_or_default().ended.storage,
    );
    let mut faults = unexplained;
    if near < NEAR_SHARE {
        let path = support::write(&ours.film, &format!("{name}-{shading:?}-ours.png"));
        let mut film = ours.film.clone();
        film.radiance = theirs
            .radiance
            .iter()
            .map(|rgb| rgb.map(|c| c as f32))
            .collect();
        support::write(&film, &format!("{name}-{shading:?}-oracle.png"));
        faults.push(format!(
            "{name} {shading:?}: only {:.3} % near; see {}",
            100.0 * near,
            path.display()
        ));
    }
    if alpha_off as f64 > (1.0 - NEAR_SHARE) * f64::from(WIDTH * HEIGHT) {
        faults.push(format!(
            "{name} {shading:?}: alpha differs in {alpha_off} pixels"
        ));
    }
    if ours.counters.unwrap_or_default().ended.storage > 0 {
        faults.push(format!(
            "{name} {shading:?}: branches ended for lack of storage"
        ));
    }
    faults
}

fn judge_all(shading: Shading) {
    let Some(device) = support::device() else {
        return;
    };
    let only = std::env::var("RAYTREE_ONLY").unwrap_or_default();
    let mut faults = Vec::new();
    for path in support::own_scenes()
        .iter()
        .filter(|path| support::stem(path).contains(&only))
    {
        let mut scene = support::import(path);
        raytree::light_if_dark(&mut scene);
        faults.extend(judge(device, &support::stem(path), &scene, shading));
    }
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
}

#[test]
fn own_scenes_pbr() {
    judge_all(Shading::Pbr);
}

#[test]
fn own_scenes_whitted() {
    judge_all(Shading::Whitted);
}
