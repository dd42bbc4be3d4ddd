//! Writes a mesh that many nodes show: `cargo run --release --example herd -- 10000 100000 herd.glb` has 10,000 nodes on one mesh of
//! about 100,000 triangles. With a fourth argument, `shared` or `copied`, it writes nothing but says what importing, building and
//! rendering that file takes (512x512, one sample, and 16), with the mesh shared or a copy for each node.
#![allow(clippy::print_stdout, reason = "a program for people")]

use std::{env, f64::consts::TAU, fs, path::Path, time::Instant};

use anyhow::{Context, bail, ensure};
use glam::{DQuat, DVec2, DVec3};
use raytree::{
    Device, DeviceChoice, ImportOptions, Preset, RenderSettings, Sharing, build_bvh,
    default_camera, light_if_dark, unobserved,
};
use raytree_assets::{
    gltf::{Container, Gltf, Material, Node},
    shapes::relief,
};

const USAGE: &str = "usage: herd NODES TRIANGLES FILE.glb [shared|copied]";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    ensure!((3..=4).contains(&arguments.len()), USAGE);
    let file = Path::new(&arguments[2]);
    match arguments.get(3).map(String::as_str) {
        None => write(
            arguments[0].parse().context(USAGE)?,
            arguments[1].parse().context(USAGE)?,
            file,
        ),
        Some("shared") => measure(file, Sharing::Always),
        Some("copied") => measure(file, Sharing::Never),
        Some(_) => bail!(USAGE),
    }
}

/// Nodes in rows on a plain, each turned and of a size of its own, the same every time.
fn write(nodes: u32, triangles: u32, file: &Path) -> anyhow::Result<()> {
    let side = (f64::from(triangles) / 2.0).sqrt().round().max(1.0) as u32;
    let mut gltf = Gltf::new("herd");
    let hide = gltf.material(Material::matte("hide", [0.6, 0.45, 0.3]));
    let grass = gltf.material(Material::matte("grass", [0.25, 0.45, 0.2]));
    let bump = relief(DVec2::splat(2.0), side, side, bump).plain();
    let mesh = gltf.mesh("bump", &bump, hide);
    let columns = f64::from(nodes).sqrt().ceil() as u32;
    let plain = relief(DVec2::splat(2.4 * f64::from(columns)), 1, 1, |_, _| -0.3).plain();
    let plain = gltf.mesh("plain", &plain, grass);
    gltf.node(Node::new("plain").mesh(plain));
    let middle = 0.5 * f64::from(columns - 1);
    for node in 0..nodes {
        let (column, row) = (f64::from(node % columns), f64::from(node / columns));
        let place = 2.0 * DVec3::new(column - middle, 0.0, row - middle);
        let turn = f64::from(node.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let size = 0.6 + 0.4 * turn;
        let turned = DQuat::from_rotation_y(TAU * turn) * DQuat::from_rotation_x(0.6 * turn);
        gltf.node(
            Node::new("bump")
                .at(place.x, place.y, place.z)
                .oriented(turned)
                .scaled(size, size, size)
                .mesh(mesh),
        );
    }
    let far = f64::from(columns);
    let eye = DVec3::new(0.3 * far, 0.5 * far, 1.2 * far + 2.0);
    gltf.perspective("camera", eye, DVec3::new(0.0, 0.0, 0.2 * far), 50.0);
    for written in gltf.files(Container::Glb) {
        fs::write(file, &written.bytes)?;
        let total = u64::from(nodes) * u64::from(2 * side * side);
        println!("{total} triangles seen, {} bytes", written.bytes.len());
    }
    Ok(())
}

fn bump(x: f64, z: f64) -> f64 {
    let height = (1.0 - 0.9 * (x * x + z * z)).max(0.0).sqrt();
    height + 0.04 * (9.0 * x).sin() * (11.0 * z).cos()
}

fn measure(file: &Path, sharing: Sharing) -> anyhow::Result<()> {
    let options = ImportOptions {
        sharing,
        max_triangles: 1 << 27,
        ..ImportOptions::default()
    };
    let started = Instant::now();
    let mut scene = raytree::import_with(file, &options)?;
    light_if_dark(&mut scene);
    let imported = started.elapsed();
    let bvh = build_bvh(&scene, Preset::default())?;
    let built = started.elapsed();
    let device = Device::open(&DeviceChoice::default())?;
    println!(
        "{} stored, {} seen",
        scene.geometry.triangles.len(),
        scene.placed_triangles()
    );
    println!("import {imported:.2?}, hierarchy {:.2?}", built - imported);
    for samples in [1, 16] {
        let mut settings = RenderSettings::new(512, 512, default_camera(&scene));
        settings.samples = samples;
        settings.counters = samples == 1;
        let features = raytree::assemble_for(&scene, &settings);
        let ahead = raytree::Ahead::begin(&device, features, &settings);
        let mut prepared = raytree::Prepared::new(&device, &scene, &bvh, &settings, features)?;
        prepared.compile(ahead)?;
        let renders = (0..3).map(|_| prepared.render(&mut unobserved));
        let renders = renders.collect::<Result<Vec<_>, _>>()?;
        let best = renders
            .iter()
            .map(|r| r.times.render)
            .min()
            .unwrap_or_default();
        let first = &renders[0];
        println!(
            "{samples} samples: layout {:.2?}, upload {:.2?}, compile {:.2?}, render {best:.3?}",
            first.times.layout, first.times.program, first.times.compile
        );
        if let Some(counters) = &first.counters {
            println!(
                "{} node visits, {} triangle tests",
                counters.node_visits, counters.triangle_tests
            );
        }
    }
    Ok(())
}
