//! Writes hills of any number of triangles: `cargo run --release --example terrain -- 707 hills.glb` (999,698 of them), and with
//! a third argument `flat` without normals, so that each triangle has three vertices of its own.
#![allow(clippy::print_stdout, reason = "a program for people")]

use std::{env, fs, path::Path};

use anyhow::{Context, ensure};
use glam::{DVec2, DVec3};
use raytree_assets::{
    gltf::{Container, Gltf, Material, Node},
    shapes::relief,
};

fn main() -> anyhow::Result<()> {
    let usage = "usage: terrain SIDE FILE.glb [flat]; it has 2 SIDE^2 triangles";
    let arguments: Vec<String> = env::args().skip(1).collect();
    ensure!((2..=3).contains(&arguments.len()), usage);
    let side: u32 = arguments[0].parse().context(usage)?;
    let flat = arguments.get(2).is_some_and(|word| word == "flat");

    let mut shape = relief(DVec2::splat(10.0), side, side, height).plain();
    if flat {
        shape.normals.clear();
    }
    let mut gltf = Gltf::new("terrain");
    let material = gltf.material(Material::matte("grass", [0.3, 0.5, 0.2]));
    let mesh = gltf.mesh("hills", &shape, material);
    gltf.node(Node::new("hills").mesh(mesh));
    let (eye, target) = (DVec3::new(3.0, 7.0, 12.0), DVec3::ZERO);
    gltf.perspective("camera", eye, target, 0.8);
    for file in gltf.files(Container::Glb) {
        fs::write(Path::new(&arguments[1]), &file.bytes)?;
        println!("{} triangles, {} bytes", 2 * side * side, file.bytes.len());
    }
    Ok(())
}

/// Steep and flat, long and short triangles, the same every time.
fn height(x: f64, z: f64) -> f64 {
    (0.9 * x + 0.4 * z).sin() + 0.3 * (0.31 * x * z).cos() + 0.05 * (17.0 * (x - z)).sin()
}
