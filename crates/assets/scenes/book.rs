//! For `--shading whitted`: every material carries the coefficients of Foley et al., eq. 14.32, in `extras.whitted`. Three balls of the
//! book's kinds (a mirror, a piece of plastic, a lump of glass), a copper ring and a checkerboard, in a room, so that the mirror has something to show.

use glam::DVec2;
use serde_json::json;

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Material, Node, Wrap};
use crate::pixels::Pixels;
use crate::shapes::{Shape, cuboid, icosphere, lathe, quad};

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("book");
    let squares = Pixels::checker(2, [0.93, 0.91, 0.86], [0.18, 0.30, 0.38]);
    let squares = gltf.texture("squares", &squares, Filter::Nearest, Wrap::Repeat);
    let board = Material::matte("board", WHITE)
        .textured(squares)
        .whitted(json!({ "ka": 0.25, "kd": 0.75, "ks": [0.0, 0.0, 0.0], "n": 1.0 }));
    let wall = Material::matte("wall", [0.42, 0.52, 0.66])
        .whitted(json!({ "ka": 0.3, "kd": 0.7, "ks": [0.0, 0.0, 0.0], "n": 1.0 }));
    // Not white light comes back from a metal, but its own colour: ks by channel.
    let mirror = Material::metal("mirror", [0.9; 3], 0.0)
        .whitted(json!({ "ka": 0.05, "kd": 0.08, "ks": [0.80, 0.80, 0.82], "n": 200.0 }));
    let plastic = Material::glossy("plastic", [0.85, 0.16, 0.10], 0.3)
        .whitted(json!({ "ka": 0.3, "kd": 0.65, "ks": [0.2, 0.2, 0.2], "n": 40.0 }));
    let copper = Material::metal("copper", [0.85, 0.45, 0.25], 0.3)
        .whitted(json!({ "ka": 0.2, "kd": 0.40, "ks": [0.42, 0.25, 0.15], "n": 20.0 }));
    let glass = Material::glass("glass", 1.5)
        .whitted(json!({ "ka": 0.0, "kd": 0.0, "ks": [0.1, 0.1, 0.1], "n": 200.0, "kt": [0.85, 0.88, 0.86], "ior": 1.5 }));
    let [board, wall, mirror, plastic, copper, glass] =
        [board, wall, mirror, plastic, copper, glass].map(|material| gltf.material(material));

    let floor = quad(v(10.0, 0.0, 0.0), v(0.0, 0.0, -10.0)).tiled(12.5, 12.5);
    let floor = gltf.mesh("board", &floor, board);
    gltf.node(
        Node::new("board")
            .at(0.0, 0.0, -2.0)
            .turned(v(0.0, 1.0, 0.0), 19.0)
            .mesh(floor),
    );
    let room = gltf.mesh("room", &cuboid(v(6.5, 3.6, 6.2)).inverted().plain(), wall);
    gltf.place("room", room, 0.0, 3.58, 1.5);

    let ball = icosphere(20);
    for (name, material, [x, z], radius) in [
        ("mirror", mirror, [1.05, -1.0], 1.0),
        ("plastic", plastic, [-1.15, -0.95], 0.72),
        ("glass", glass, [-0.22, 0.72], 0.55),
    ] {
        let mesh = gltf.mesh(name, &ball, material);
        gltf.node(
            Node::new(name)
                .at(x, radius + 0.004, z)
                .scaled(radius, radius, radius)
                .mesh(mesh),
        );
    }
    let ring = gltf.mesh("copper ring", &ring(0.34, 0.12), copper);
    gltf.place("copper ring", ring, 1.12, 0.123, 0.95);

    // No 1/pi in this model: less light than the other scenes have.
    gltf.point_light("lamp", v(-2.7, 4.9, 3.8), [1.0, 0.98, 0.95], 32.0, None);
    gltf.point_light("second lamp", v(3.9, 3.6, 3.1), [0.9, 0.95, 1.0], 9.0, None);
    gltf.perspective("Camera", v(0.23, 2.03, 5.47), v(0.04, 0.78, -0.3), 38.0);
    gltf
}

/// A torus.
fn ring(radius: f64, thickness: f64) -> Shape {
    const SIDES: u32 = 20;
    let profile: Vec<DVec2> = (0..=SIDES)
        .map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i % SIDES) / f64::from(SIDES);
            DVec2::new(radius + thickness * angle.cos(), thickness * angle.sin())
        })
        .collect();
    lathe(&profile, 48).plain()
}
