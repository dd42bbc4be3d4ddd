//! What becomes of a file of a million triangles until the first dispatch, against the least of it: reading the file, and obvhs's own
//! build of the same hierarchy.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use glam::DVec2;
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    triangle::Triangle,
};
use raytree::{Bvh, Device, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures};
use raytree_assets::{
    gltf::{Container, Gltf, Material},
    shapes::relief,
};
use raytree_gpu::Prepared;
use support::{
    Effort,
    findings::{Bar, Findings},
    rays,
    summary::Spread,
    turns::{Sides, Turn},
};

/// Cells along a side of the relief: 999,698 triangles.
const CELLS: u32 = 707;
const TRIANGLES: usize = 2 * (CELLS * CELLS) as usize;
const BAR: Bar = Bar::AtMost(1.5);

/// The hills as a .glb: one mesh, positions, normals and indices.
fn write_file(folder: &Path) -> PathBuf {
    let mut gltf = Gltf::new("million");
    let material = gltf.material(Material::matte("ground", [0.5, 0.4, 0.3]));
    // A relief lies around its middle.
    let height = |x: f64, z: f64| f64::from(rays::height(x as f32 + 0.5, z as f32 + 0.5));
    let hills = relief(DVec2::ONE, CELLS, CELLS, height).plain();
    let mesh = gltf.mesh("hills", &hills, material);
    gltf.place("hills", mesh, 0.0, 0.0, 0.0);
    let file = &gltf.files(Container::Glb)[0];
    let path = folder.join(&file.name);
    fs::write(&path, &file.bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    path
}

fn import(path: &Path) -> Scene {
    let mut scene = raytree::import(path).unwrap_or_else(|error| panic!("{error}"));
    raytree::light_if_dark(&mut scene);
    scene
}

fn build(scene: &Scene) -> Bvh {
    raytree::build_bvh(scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// What our side consists of.
const PARTS: [&str; 3] = ["import", "hierarchy", "layout and upload"];

/// All that `raytree render` does before it dispatches anything, part by part; the device is open.
fn ours(device: &Device, path: &Path) -> [Turn; PARTS.len()] {
    let (importing, scene) = Turn::of(|| import(path));
    let (building, bvh) = Turn::of(|| build(&scene));
    let settings = RenderSettings::new(64, 64, raytree::default_camera(&scene));
    let (uploading, _) = Turn::of(|| {
        let features = ProgramFeatures::of(&SceneFeatures::of(&scene), &settings);
        let prepared = Prepared::new(device, &scene, &bvh, &settings, features);
        prepared.unwrap_or_else(|error| panic!("{error}"));
    });
    assert_eq!(scene.geometry.triangles.len(), TRIANGLES);
    [importing, building, uploading]
}

/// CPU milliseconds of each part.
fn show_parts(turns: &[[Turn; PARTS.len()]]) {
    for (part, name) in PARTS.iter().enumerate() {
        let cpu = Spread::of(turns.iter().map(|turn| 1e3 * turn[part].cpu));
        println!("  {name:<20} {:>8.1} CPU ms", cpu.median);
    }
}

/// The file into memory, and the hierarchy over triangles as obvhs takes them, by the parameters of our preset.
fn theirs(path: &Path, triangles: &[Triangle]) -> (Turn, CwBvh) {
    Turn::of(|| {
        fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut core = Duration::ZERO;
        build_cwbvh_from_tris(triangles, BvhBuildParams::medium_build(), &mut core)
    })
}

fn triangles(scene: &Scene) -> Vec<Triangle> {
    let corner = |vertex: u32| scene.geometry.positions[vertex as usize].into();
    let triangles = scene.geometry.triangles.iter().map(|triangle| {
        let [v0, v1, v2] = triangle.vertices.map(corner);
        Triangle { v0, v1, v2 }
    });
    triangles.collect()
}

/// # Panics
/// If the two sides do not build the same: else their times say nothing.
fn check_same(ours: &Bvh, theirs: &CwBvh) {
    assert_eq!(ours.leaf_triangles.len(), theirs.primitive_indices.len());
    let (ours, theirs) = (ours.nodes.len() as f64, theirs.nodes.len() as f64);
    assert!(
        (ours / theirs - 1.0).abs() < 0.01,
        "{ours} nodes, obvhs has {theirs}"
    );
}

fn main() {
    const NAME: &str = "geometry/1M";
    if !support::cpu_time::available_for("geometry") {
        return;
    }
    if !support::wanted(NAME) {
        return;
    }
    let device = support::device();
    let mut findings = Findings::new(
        "geometry",
        "ours: a file of 999,698 triangles until the first dispatch; theirs: reading it, and obvhs's build",
    );
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let path = write_file(folder.path());
    let scene = import(&path);
    let corners = triangles(&scene);
    check_same(&build(&scene), &theirs(&path, &corners).1);
    let mut parts = Vec::new();
    let sides = Sides::in_turn(
        Effort::chosen().rounds(),
        || {
            let turns = ours(&device, &path);
            parts.push(turns);
            turns.into_iter().sum()
        },
        || theirs(&path, &corners).0,
    );
    findings.compare(NAME, &sides, BAR);
    show_parts(&parts);
    findings.finish();
}
