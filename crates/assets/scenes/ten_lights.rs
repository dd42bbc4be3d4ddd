//! Ten lights, of all three kinds, over a relief and some glossy balls.

use glam::DVec2;

use super::v;
use crate::gltf::{Gltf, Material, Node};
use crate::shapes::{icosphere, relief, uv_sphere};

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("ten-lights");
    let matte = gltf.material(Material::matte("matte", [0.82, 0.80, 0.78]));
    let waves = relief(DVec2::new(10.0, 8.0), 80, 64, height).plain();
    let waves = gltf.mesh("relief", &waves, matte);
    gltf.place("relief", waves, 0.0, 0.0, 0.0);

    let round = icosphere(14);
    let balls = [
        (
            "rough plastic",
            Material::glossy("rough plastic", [0.55, 0.08, 0.07], 0.45),
            [-1.7, 0.7],
        ),
        (
            "smooth plastic",
            Material::glossy("smooth plastic", [0.08, 0.16, 0.50], 0.3),
            [0.15, 1.35],
        ),
        (
            "brass",
            Material::metal("brass", [0.86, 0.66, 0.30], 0.35),
            [1.75, 0.25],
        ),
        (
            "satin",
            Material::metal("satin", [0.75, 0.77, 0.80], 0.5),
            [-0.45, -1.05],
        ),
    ];
    for (name, material, [x, z]) in balls {
        let material = gltf.material(material);
        let mesh = gltf.mesh(name, &round, material);
        gltf.node(
            Node::new(name)
                .at(x, height(x, z) + 0.47, z)
                .scaled(0.45, 0.45, 0.45)
                .mesh(mesh),
        );
    }
    let clay = gltf.material(Material::glossy("clay", [0.62, 0.60, 0.56], 0.6));
    let dome = gltf.mesh("dome", &uv_sphere(40, 24).plain(), clay);
    gltf.node(
        Node::new("dome")
            .at(1.1, height(1.1, -1.9) + 0.25, -1.9)
            .scaled(0.7, 0.7, 0.7)
            .mesh(dome),
    );

    lights(&mut gltf);
    gltf.perspective("Camera", v(0.31, 5.03, 5.97), v(0.06, 0.0, 0.13), 36.0);
    gltf
}

fn lights(gltf: &mut Gltf) {
    gltf.directional_light("moon", v(0.5, -1.0, -0.6), [0.55, 0.65, 1.0], 0.25);
    let points = [
        (
            "point, red",
            v(-3.2, 1.0, 1.3),
            [1.0, 0.16, 0.10],
            3.4,
            Some(3.6),
        ),
        (
            "point, green",
            v(-2.4, 0.9, -1.6),
            [0.15, 1.0, 0.25],
            2.8,
            Some(3.0),
        ),
        (
            "point, blue",
            v(3.2, 1.0, 1.5),
            [0.2, 0.35, 1.0],
            4.0,
            Some(3.8),
        ),
        (
            "point, amber",
            v(2.9, 1.1, -1.3),
            [1.0, 0.6, 0.12],
            3.4,
            Some(3.4),
        ),
        (
            "point, white, no range",
            v(0.3, 4.8, 1.0),
            [1.0, 0.95, 0.88],
            6.0,
            None,
        ),
    ];
    for (name, at, color, intensity, range) in points {
        gltf.point_light(name, at, color, intensity, range);
    }
    let spots = [
        (
            "spot, hard edge",
            v(-1.2, 3.2, 3.0),
            v(-1.35, 0.0, 1.9),
            [1.0, 0.9, 0.7],
            11.0,
            [13.0, 13.5],
            None,
        ),
        (
            "spot, soft edge",
            v(1.5, 3.4, 2.6),
            v(1.1, 0.0, 1.9),
            [0.8, 0.95, 1.0],
            11.0,
            [2.0, 16.0],
            None,
        ),
        (
            "spot, grazing",
            v(-4.3, 0.9, 2.6),
            v(0.0, 0.2, 2.3),
            [1.0, 0.35, 0.8],
            17.0,
            [6.0, 11.0],
            Some(7.5),
        ),
        (
            "spot, from behind",
            v(-0.6, 2.5, -4.6),
            v(-0.3, 0.4, -0.9),
            [0.45, 1.0, 0.9],
            11.0,
            [10.0, 20.0],
            Some(8.0),
        ),
    ];
    for (name, at, target, color, intensity, cone, range) in spots {
        gltf.spot_light(name, at, target, color, intensity, cone, range);
    }
}

fn height(x: f64, z: f64) -> f64 {
    0.17 * (1.9 * x + 0.6 * (1.3 * z).sin()).sin() * (1.6 * z + 0.4).cos()
        + 0.05 * (4.3 * x + 2.9 * z).sin()
}
