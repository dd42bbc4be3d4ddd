//! Thirty spheres. Columns: roughness 0, 0.15, 0.3, 0.5, 0.75, 1. Rows, from the top: metal; half metal; dielectric; specular and
//! index of refraction; unlit, emissive and thin-walled ones.

use serde_json::json;

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Material, Node, Wrap};
use crate::pixels::Pixels;
use crate::shapes::{icosphere, quad};

const ROUGHNESS: [f64; 6] = [0.0, 0.15, 0.3, 0.5, 0.75, 1.0];

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("materials");
    let sphere = icosphere(9);
    for (row, materials) in rows().into_iter().enumerate() {
        for (column, material) in materials.into_iter().enumerate() {
            let name = format!("sphere {}-{}", row + 1, column + 1);
            let material = gltf.material(material);
            let mesh = gltf.mesh(&name, &sphere, material);
            let place = Node::new(&name).at(
                0.98 * (column as f64 - 2.5),
                0.56 + 0.96 * (4.0 - row as f64),
                0.0,
            );
            gltf.node(place.scaled(0.42, 0.42, 0.42).mesh(mesh));
        }
    }
    // Something to be mirrored: squares all around, the camera looks in through the open front.
    let squares = Pixels::checker(2, [0.62, 0.63, 0.66], [0.28, 0.29, 0.33]);
    let squares = gltf.texture("squares", &squares, Filter::Nearest, Wrap::Repeat);
    let squares = gltf.material(Material::matte("squares", WHITE).textured(squares));
    let wall = gltf.mesh(
        "wall",
        &quad(v(4.5, 0.0, 0.0), v(0.0, 3.5, 0.0)).tiled(6.0, 4.667),
        squares,
    );
    gltf.place("wall", wall, 0.013, 2.5, -1.2);
    let floor = gltf.mesh(
        "floor",
        &quad(v(4.5, 0.0, 0.0), v(0.0, 0.0, -3.5)).tiled(6.0, 4.667),
        squares,
    );
    gltf.place("floor", floor, 0.013, 0.0, 2.2);

    gltf.point_light("key", v(-4.3, 7.1, 6.2), [1.0, 0.96, 0.9], 150.0, None);
    gltf.point_light("fill", v(5.1, 3.0, 5.4), [0.8, 0.9, 1.0], 48.0, None);
    gltf.perspective("Camera", v(0.057, 2.63, 8.47), v(0.01, 2.45, 0.0), 35.5);
    gltf
}

fn rows() -> [[Material; 6]; 5] {
    let ramp = |color, metallic| {
        ROUGHNESS.map(|roughness| {
            Material::new(
                &format!("metallic {metallic}, rough {roughness}"),
                color,
                metallic,
                roughness,
            )
        })
    };
    [
        ramp([0.95, 0.72, 0.35], 1.0),
        ramp([0.62, 0.30, 0.42], 0.5),
        ramp([0.10, 0.32, 0.14], 0.0),
        speculars(),
        specials(),
    ]
}

/// Smooth but for the second: what the two extensions change is seen in the reflection.
fn speculars() -> [Material; 6] {
    let blue = [0.06, 0.12, 0.35];
    let specular = |name, roughness, value| {
        Material::glossy(name, blue, roughness).extension("KHR_materials_specular", value)
    };
    let index = |name, ior: f64| {
        Material::glossy(name, blue, 0.0).extension("KHR_materials_ior", json!({ "ior": ior }))
    };
    [
        specular("specular 0", 0.0, json!({ "specularFactor": 0.0 })),
        specular(
            "specular red",
            0.3,
            json!({ "specularFactor": 1.0, "specularColorFactor": [4.0, 0.4, 0.3] }),
        ),
        index("index 1.2", 1.2),
        index("index 1.8", 1.8),
        index("index 2.4", 2.4),
        index("index 0: reflects all", 0.0),
    ]
}

fn specials() -> [Material; 6] {
    let thin = |name, color, roughness| {
        Material::glossy(name, color, roughness).extension(
            "KHR_materials_transmission",
            json!({ "transmissionFactor": 1.0 }),
        )
    };
    [
        Material::matte("unlit", [0.75, 0.35, 0.10]).extension("KHR_materials_unlit", json!({})),
        Material::matte("emissive", [0.05; 3]).emissive([0.15, 0.55, 0.75]),
        Material::matte("emissive strength 3", [0.05; 3])
            .emissive([0.25, 0.12, 0.04])
            .extension(
                "KHR_materials_emissive_strength",
                json!({ "emissiveStrength": 3.0 }),
            ),
        thin("thin wall", [0.95, 0.98, 1.0], 0.0),
        thin("thin wall, red", [0.90, 0.25, 0.20], 0.0),
        thin("thin wall, rough", [0.55, 0.80, 0.95], 0.3),
    ]
}
