//! A block of water with a glass sphere, an air bubble and a stone in it, over a striped floor: two media deep.

use glam::DVec3;

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Material, Node, Wrap};
use crate::pixels::{Pixels, mix, opaque};
use crate::shapes::{Shape, cuboid, icosphere, quad};

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("glass-in-water");
    let water = gltf.material(Material::glass("water", 1.33).absorbing([0.62, 0.87, 0.90], 2.0));
    let glass = gltf.material(Material::glass("glass", 1.5));
    // A solid of index 1 within the water.
    let air = gltf.material(Material::glass("air", 1.0));
    let stone = gltf.material(Material::matte("stone", [0.62, 0.36, 0.22]));
    let wall = gltf.material(Material::matte("wall", [0.62, 0.66, 0.72]));
    let stripes = Pixels::paint(32, 1, |u, _| opaque(stripe(u)));
    let stripes = gltf.texture("stripes", &stripes, Filter::Nearest, Wrap::Repeat);
    let floor = gltf.material(Material::matte("floor", WHITE).textured(stripes));

    let ground = gltf.mesh(
        "floor",
        &quad(v(6.0, 0.0, 0.0), v(0.0, 0.0, -5.0)).tiled(12.0, 1.0),
        floor,
    );
    gltf.node(
        Node::new("floor")
            .at(0.2, 0.0, -0.7)
            .turned(v(0.0, 1.0, 0.0), 24.0)
            .mesh(ground),
    );
    let backdrop = gltf.mesh(
        "wall",
        &quad(v(7.0, 0.0, 0.0), v(0.0, 3.0, 0.0)).plain(),
        wall,
    );
    gltf.place("wall", backdrop, 0.0, 2.99, -3.6);

    let block = gltf.mesh("water", &cuboid(v(1.55, 0.85, 1.05)).plain(), water);
    gltf.node(
        Node::new("water")
            .at(0.0, 0.88, 0.0)
            .turned(v(0.0, 1.0, 0.0), -7.0)
            .mesh(block),
    );
    let ball = gltf.mesh("glass sphere", &icosphere(20), glass);
    gltf.node(
        Node::new("glass sphere")
            .at(-0.62, 0.72, 0.17)
            .scaled(0.48, 0.48, 0.48)
            .mesh(ball),
    );
    let bubble = gltf.mesh("air bubble", &icosphere(16), air);
    gltf.node(
        Node::new("air bubble")
            .at(0.36, 1.12, 0.33)
            .scaled(0.27, 0.27, 0.27)
            .mesh(bubble),
    );
    let pebble = gltf.mesh("stone", &pebble(), stone);
    gltf.place("stone", pebble, 0.78, 0.38, -0.22);

    gltf.point_light("lamp", v(-3.1, 6.2, 3.4), [1.0, 0.97, 0.92], 125.0, None);
    gltf.point_light("fill", v(4.6, 3.3, 4.1), [0.85, 0.92, 1.0], 34.0, None);
    gltf.perspective("Camera", v(1.13, 3.07, 5.13), v(0.03, 0.67, 0.0), 33.0);
    gltf
}

fn stripe(u: f64) -> [f64; 3] {
    let (light, dark) = ([0.93, 0.91, 0.84], [0.13, 0.27, 0.55]);
    mix(light, dark, if u < 0.5 { 0.0 } else { 1.0 })
}

/// A sphere with waves on it.
fn pebble() -> Shape {
    icosphere(12).bent(|p| {
        let waves =
            (5.0 * p.x + 1.3).sin() * (4.0 * p.y - 0.4).sin() + (6.0 * p.z + p.x * 3.0).sin() * 0.6;
        p * DVec3::new(0.42, 0.30, 0.36) * (1.0 + 0.07 * waves)
    })
}
