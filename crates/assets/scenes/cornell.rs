//! The Cornell box (Goral et al. 1984), open towards the camera: two blocks, one red and one green wall, a panel in the
//! ceiling that shines, and a point light just under it that does the lighting.

use serde_json::json;

use super::v;
use crate::gltf::{Gltf, Material, Node};
use crate::shapes::{cuboid, quad};

/// The room's half width, height and depth, metres; it stands on y = 0 and fills a 4:3 picture.
const HALF: [f64; 3] = [1.32, 1.0, 1.0];

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("cornell");
    let white = gltf.material(Material::matte("white", [0.73, 0.73, 0.70]));
    let red = gltf.material(Material::matte("red", [0.63, 0.065, 0.05]));
    let green = gltf.material(Material::matte("green", [0.14, 0.45, 0.091]));
    // Without specular: the lamp is so near that even a faint lobe would outshine the panel.
    let shining = Material::matte("panel", [0.0; 3])
        .emissive([1.0, 0.94, 0.80])
        .extension("KHR_materials_specular", json!({ "specularFactor": 0.0 }));
    let shining = gltf.material(shining);

    // Centre, to the right and up seen from within, so that all walls face inwards.
    let [x, y, z] = HALF;
    let (right, up, back) = (v(x, 0.0, 0.0), v(0.0, y, 0.0), v(0.0, 0.0, -z));
    let walls = [
        ("floor", v(0.0, 0.0, 0.0), right, back, white),
        ("ceiling", v(0.0, 2.0 * y, 0.0), right, -back, white),
        ("back wall", v(0.0, y, -z), right, up, white),
        ("left wall", v(-x, y, 0.0), back, up, red),
        ("right wall", v(x, y, 0.0), -back, up, green),
    ];
    for (name, centre, u, v, material) in walls {
        let wall = gltf.mesh(name, &quad(u, v).plain(), material);
        gltf.place(name, wall, centre.x, centre.y, centre.z);
    }
    let panel = gltf.mesh(
        "panel",
        &quad(v(0.26, 0.0, 0.0), v(0.0, 0.0, 0.21)).plain(),
        shining,
    );
    gltf.place("panel", panel, 0.0, 1.995, -0.05);

    let block = gltf.mesh("block", &cuboid(v(1.0, 1.0, 1.0)).plain(), white);
    for (name, [x, z], [width, height], degrees) in [
        ("short block", [0.34, 0.36], [0.29, 0.29], -17.0),
        ("tall block", [-0.35, -0.30], [0.29, 0.6], 20.0),
    ] {
        let node = Node::new(name)
            .at(x, height + 0.001, z)
            .turned(v(0.0, 1.0, 0.0), degrees);
        gltf.node(node.scaled(width, height, width).mesh(block));
    }

    gltf.point_light("lamp", v(0.0, 1.975, -0.05), [1.0, 0.94, 0.80], 4.4, None);
    gltf.perspective("Camera", v(0.007, 1.013, 3.87), v(0.003, 0.997, 0.0), 38.6);
    gltf
}
