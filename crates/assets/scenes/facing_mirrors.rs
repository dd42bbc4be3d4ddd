//! Two parallel mirrors with some things and a light between them: reflections of reflections, until the depth ends.

use super::v;
use crate::gltf::{Filter, Gltf, Material, Node, Wrap};
use crate::pixels::Pixels;
use crate::shapes::{cuboid, icosphere, quad};

/// Mirrors stand at z = -GAP and z = GAP.
const GAP: f64 = 1.9;
const MIRROR: [f64; 2] = [2.1, 1.25];

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("facing-mirrors");
    let silver = gltf.material(Material::metal("silver", [0.95; 3], 0.0));
    let gilt = gltf.material(Material::glossy("gilt", [0.75, 0.50, 0.16], 0.4));
    let orange = gltf.material(Material::glossy("orange", [0.85, 0.30, 0.06], 0.35));
    let blue = gltf.material(Material::matte("blue", [0.10, 0.24, 0.66]));
    let tiles = Pixels::checker(2, [0.82, 0.80, 0.76], [0.30, 0.33, 0.36]);
    let tiles = gltf.texture("tiles", &tiles, Filter::Nearest, Wrap::Repeat);
    let tiles = gltf.material(Material::matte("tiles", [1.0; 3]).textured(tiles));

    let [half, height] = MIRROR;
    let floor = quad(v(2.6, 0.0, 0.0), v(0.0, 0.0, -2.2)).tiled(2.6, 2.2);
    let floor = gltf.mesh("floor", &floor, tiles);
    gltf.place("floor", floor, 0.0, 0.0, 0.0);

    let glass = gltf.mesh(
        "mirror",
        &quad(v(half, 0.0, 0.0), v(0.0, height, 0.0)).plain(),
        silver,
    );
    let level = gltf.mesh(
        "frame, level",
        &cuboid(v(half + 0.1, 0.045, 0.04)).plain(),
        gilt,
    );
    let upright = gltf.mesh(
        "frame, upright",
        &cuboid(v(0.045, height - 0.005, 0.04)).plain(),
        gilt,
    );
    for (name, z, degrees) in [("far mirror", -GAP, 0.0), ("near mirror", GAP, 180.0)] {
        let parts = [
            gltf.place("glass", glass, 0.0, 0.0, 0.0),
            gltf.place("frame, top", level, 0.0, height + 0.047, 0.0),
            gltf.place("frame, bottom", level, 0.0, -height - 0.047, 0.0),
            gltf.place("frame, left", upright, -half - 0.047, 0.0, 0.0),
            gltf.place("frame, right", upright, half + 0.047, 0.0, 0.0),
        ];
        gltf.node(
            Node::new(name)
                .at(0.0, 0.13 + height, z)
                .turned(v(0.0, 1.0, 0.0), degrees)
                .children(&parts),
        );
    }

    let ball = gltf.mesh("ball", &icosphere(16), orange);
    gltf.node(
        Node::new("ball")
            .at(-0.62, 0.421, -0.55)
            .scaled(0.42, 0.42, 0.42)
            .mesh(ball),
    );
    let cube = gltf.mesh("cube", &cuboid(v(0.3, 0.3, 0.3)).plain(), blue);
    gltf.node(
        Node::new("cube")
            .at(0.63, 0.301, -0.93)
            .turned(v(0.0, 1.0, 0.0), 31.0)
            .mesh(cube),
    );

    gltf.point_light("lamp", v(-0.15, 2.45, 0.23), [1.0, 0.96, 0.9], 8.5, None);
    gltf.perspective("Camera", v(0.87, 1.57, 1.43), v(-0.24, 0.93, -1.9), 54.0);
    gltf
}
