//! Twelve cards in rows of four, each showing one use of textures, alpha, vertex colours or normal maps; their shadows
//! fall on the wall behind and the floor below.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use serde_json::json;

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Layout, Material, MaterialId, Node, Wrap};
use crate::pixels::{Pixels, mix, noise, opaque};
use crate::shapes::{Shape, quad};

/// Half the side of a card, metres.
const HALF: f64 = 0.45;

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("cards");
    room(&mut gltf);
    let cards = [wrapped(&mut gltf), cut_out(&mut gltf), shaded(&mut gltf)].concat();
    for (i, (name, shape, material)) in cards.into_iter().enumerate() {
        let (column, row) = ((i % 4) as f64, (i / 4) as f64);
        let mesh = gltf.mesh(name, &shape, material);
        let place = Node::new(name).at(1.14 * (column - 1.5), 2.83 - 1.12 * row, 0.13 * row);
        gltf.node(
            place
                .turned(v(0.1, 1.0, 0.0), 13.0 - 9.0 * column)
                .mesh(mesh),
        );
    }
    lying(&mut gltf);

    gltf.point_light("lamp", v(-2.3, 4.6, 4.9), [1.0, 0.97, 0.92], 82.0, None);
    gltf.directional_light("sky", v(0.45, -1.0, -0.8), [0.8, 0.9, 1.0], 0.45);
    gltf.perspective("Camera", v(0.137, 2.13, 6.57), v(0.02, 1.57, 0.0), 36.0);
    gltf
}

type Card = (&'static str, Shape, MaterialId);

fn card() -> Shape {
    quad(v(HALF, 0.0, 0.0), v(0.0, HALF, 0.0))
}

/// The first row: wrap modes, filters and KHR_texture_transform on one small picture.
fn wrapped(gltf: &mut Gltf) -> Vec<Card> {
    let arrow = Pixels::paint(16, 16, |u, v| opaque(arrow(u, v)));
    let mut material = |name, filter, wrap| {
        let texture = gltf.texture("arrow", &arrow, filter, wrap);
        gltf.material(Material::matte(name, WHITE).textured(texture))
    };
    let repeated = material("repeat, nearest", Filter::Nearest, Wrap::Repeat);
    let mirrored = material("mirror, linear", Filter::Linear, Wrap::Mirror);
    let clamped = material("clamp, linear", Filter::Linear, Wrap::Clamp);
    let texture = gltf.texture("arrow", &arrow, Filter::Linear, Wrap::Repeat);
    let turned = json!({ "offset": [0.3, 0.9], "rotation": 0.6, "scale": [1.7, 1.1] });
    let turned = gltf.material(Material::matte("turned", WHITE).textured_through(texture, turned));
    vec![
        ("repeat", card().tiled(2.5, 2.5), repeated),
        ("mirror", card().tiled(2.5, 2.5), mirrored),
        ("clamp", card().mapped(|uv| uv * 2.0 - 0.5), clamped),
        ("texture transform", card(), turned),
    ]
}

/// The second row: masks, a blend, vertex colours.
fn cut_out(gltf: &mut Gltf) -> Vec<Card> {
    let leaf = gltf.texture(
        "leaf",
        &Pixels::paint(96, 96, leaf),
        Filter::Linear,
        Wrap::Clamp,
    );
    let leaf = gltf.material(
        Material::matte("leaf", WHITE)
            .textured(leaf)
            .masked(0.5)
            .double_sided(),
    );
    let fence = gltf.texture(
        "fence",
        &Pixels::paint(32, 32, fence),
        Filter::Linear,
        Wrap::Repeat,
    );
    let fence = gltf.material(Material::matte("fence", WHITE).textured(fence).masked(0.4));
    let fade = Pixels::paint(64, 64, |u, v| {
        let [r, g, b] = mix([0.95, 0.25, 0.15], [0.15, 0.35, 0.95], v);
        [r, g, b, u]
    });
    let fade = gltf.texture("fade", &fade, Filter::Linear, Wrap::Clamp);
    let fade = gltf.material(
        Material::matte("fade", WHITE)
            .textured(fade)
            .blended(0.9)
            .double_sided(),
    );
    let plain = gltf.material(Material::matte("vertex colours", WHITE));
    let colors = card().plain().painted(|p| {
        let [x, y] = [p.x / HALF, p.y / HALF].map(|t| 0.5 + 0.5 * t);
        v(x, y, 1.0 - x).extend(1.0)
    });
    vec![
        ("leaf", card(), leaf),
        ("fence", card().tiled(3.0, 3.0), fence),
        ("fade", card(), fade),
        ("vertex colours", colors, plain),
    ]
}

/// The third row: normal, occlusion, emissive and metallic-roughness maps; a second uv set.
fn shaded(gltf: &mut Gltf) -> Vec<Card> {
    let studs = Pixels::bumps(64, |u, v| {
        0.03 * ((TAU * 4.0 * u).sin() * (TAU * 4.0 * v).sin()).max(0.0)
    });
    let studs = gltf.texture("studs", &studs, Filter::Linear, Wrap::Repeat);
    let normals =
        gltf.material(Material::glossy("studs", [0.62, 0.42, 0.25], 0.5).normal_map(studs, 1.0));

    let glow = Pixels::paint(64, 64, |u, v| {
        let ring = ((DVec2::new(u, v) - 0.5).length() - 0.3).abs();
        opaque(mix([1.0, 0.62, 0.12], [0.0; 3], (ring / 0.06).min(1.0)))
    });
    let glow = gltf.texture("glow", &glow, Filter::Linear, Wrap::Clamp);
    let grooves = Pixels::paint(64, 4, |u, _| opaque([0.5 + 0.5 * (TAU * 4.0 * u).cos(); 3]));
    let grooves = gltf.texture("grooves", &grooves, Filter::Linear, Wrap::Repeat);
    let teal = [0.10, 0.34, 0.36];
    let two_sets = Material::matte("glow", teal)
        .emissive(WHITE)
        .emissive_map(glow, 1)
        .occlusion_map(grooves, 0, 0.8);
    let two_sets = gltf.material(two_sets);

    // G: roughness, B: metallic.
    let plates = Pixels::paint(32, 32, |u, v| {
        let cell = (u * 4.0).floor() + (v * 4.0).floor();
        [
            0.0,
            0.3 + 0.7 * v,
            if cell % 2.0 == 0.0 { 1.0 } else { 0.0 },
            1.0,
        ]
    });
    let plates = gltf.texture("plates", &plates, Filter::Nearest, Wrap::Repeat);
    let plates =
        Material::new("plates", [0.90, 0.66, 0.32], 1.0, 1.0).metallic_roughness_map(plates);
    let plates = gltf.material(plates);
    vec![
        ("bumps, tangents by MikkTSpace", card(), normals),
        (
            "bumps, tangents in the file",
            card().with_tangent(DVec3::X),
            normals,
        ),
        (
            "glow by the second uv set",
            card().second_uvs(|uv| DVec2::new(uv.y, uv.x) * 1.2 - 0.1),
            two_sets,
        ),
        ("metallic and rough by map", card(), plates),
    ]
}

fn room(gltf: &mut Gltf) {
    let wood = gltf.texture(
        "planks",
        &Pixels::paint(96, 96, planks),
        Filter::Linear,
        Wrap::Repeat,
    );
    let wood = gltf.material(Material::matte("planks", WHITE).textured(wood));
    let plaster = gltf.material(Material::matte("plaster", [0.70, 0.70, 0.68]));
    let floor = gltf.mesh(
        "floor",
        &quad(v(5.0, 0.0, 0.0), v(0.0, 0.0, -2.5)).tiled(4.0, 2.0),
        wood,
    );
    gltf.place("floor", floor, 0.0, 0.0, 1.2);
    let wall = gltf.mesh(
        "wall",
        &quad(v(5.0, 0.0, 0.0), v(0.0, 3.0, 0.0)).plain(),
        plaster,
    );
    gltf.place("wall", wall, 0.0, 3.0, -1.1);
}

/// Two cards over the floor that show their backs: the single-sided one is not seen, but its shadow is.
fn lying(gltf: &mut Gltf) {
    let single = gltf.material(Material::matte("single-sided", [0.8, 0.3, 0.3]));
    let double = gltf.material(Material::matte("double-sided", [0.3, 0.6, 0.3]).double_sided());
    let face_down = quad(v(0.34, 0.0, 0.0), v(0.0, 0.0, 0.3)).plain();
    for (name, material, x) in [
        ("single-sided", single, -0.9),
        ("double-sided", double, 0.9),
    ] {
        let mesh = gltf.mesh_as(name, &[(&face_down, material)], Layout::Interleaved);
        gltf.node(
            Node::new(name)
                .at(x, 0.21, 1.25)
                .turned(v(1.0, 0.0, 0.3), 17.0)
                .mesh(mesh),
        );
    }
}

fn arrow(u: f64, v: f64) -> [f64; 3] {
    let shaft = (u - 0.5).abs() < 0.13 && v > 0.35 && v < 0.9;
    let head = v > 0.1 && v < 0.45 && (u - 0.5).abs() < (v - 0.1) * 1.05;
    let ground = mix([0.95, 0.78, 0.35], [0.45, 0.72, 0.85], u);
    if shaft || head {
        [0.55, 0.08, 0.12]
    } else {
        ground
    }
}

pub(super) fn leaf(u: f64, v: f64) -> [f64; 4] {
    let half_width = 0.36 * (PI * (v - 0.04).clamp(0.0, 0.86) / 0.86).sin() * (1.0 - 0.35 * v);
    let blade = half_width * (1.0 + 0.06 * (60.0 * v).sin()) - (u - 0.5).abs();
    let stalk = 0.018 - (u - 0.5).abs();
    let vein = ((v + 0.7 * (u - 0.5).abs()) * 9.0).fract() < 0.12 || stalk > 0.0;
    let green = if vein {
        [0.60, 0.75, 0.30]
    } else {
        [0.18, 0.50, 0.16]
    };
    let inside = if v > 0.85 {
        blade.max(if v < 0.97 { stalk } else { -1.0 })
    } else {
        blade
    };
    let [r, g, b] = green;
    [r, g, b, 0.5 + inside * 30.0]
}

fn fence(u: f64, v: f64) -> [f64; 4] {
    let wire = |t: f64| 0.13 - (t.rem_euclid(1.0) - 0.5).abs();
    let [r, g, b] = mix([0.35, 0.36, 0.40], [0.75, 0.76, 0.80], v);
    [r, g, b, 0.4 + 6.0 * wire(u + v).max(wire(u - v))]
}

fn planks(u: f64, v: f64) -> [f64; 4] {
    let board = (v * 6.0).floor();
    let seam = (v * 6.0).fract() < 0.07 || (u * 2.0 + board * 0.37).fract() < 0.012;
    let grain =
        noise(u * 6.0 + board * 3.0, v * 48.0, 48) * 0.6 + noise(u * 12.0, v * 96.0, 96) * 0.4;
    let tone = mix(
        [0.62, 0.44, 0.28],
        [0.80, 0.62, 0.42],
        grain * 0.7 + 0.1 * (board * 1.7).sin(),
    );
    opaque(if seam { [0.33, 0.22, 0.14] } else { tone })
}
