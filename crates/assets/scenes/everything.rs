//! A still life with a bit of everything: textures, masks, blending, mirrors, glass in a glass of water, coloured glass
//! with its coloured shadow, lights of all kinds, a second, orthographic camera, nested and mirrored nodes, and
//! vertices that are quantised, interleaved and sparse.

use glam::{DMat4, DVec2, DVec3};
use serde_json::json;

use super::{WHITE, cards, v};
use crate::gltf::{Filter, Gltf, Layout, Material, MeshId, Node, NodeId, Wrap};
use crate::pixels::{Pixels, mix, noise, opaque};
use crate::shapes::{Shape, cuboid, icosphere, lathe, prism, quad, uv_sphere};

const UP: DVec3 = DVec3::Y;

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("everything");
    table(&mut gltf);
    standing_mirror(&mut gltf);
    tumbler(&mut gltf);
    coloured_glass(&mut gltf);
    plant(&mut gltf);
    balls(&mut gltf);
    books(&mut gltf);
    mobile(&mut gltf);

    gltf.point_light("lamp", v(-2.3, 3.4, 2.9), [1.0, 0.95, 0.88], 42.0, None);
    gltf.spot_light(
        "spot",
        v(2.7, 2.9, 1.6),
        v(0.2, 0.2, 0.2),
        [1.0, 0.9, 0.75],
        17.0,
        [8.0, 17.0],
        Some(9.0),
    );
    gltf.directional_light("window", v(-0.25, -0.9, -0.8), [0.75, 0.87, 1.0], 0.55);
    gltf.perspective("Camera", v(0.43, 1.57, 3.93), v(0.05, 0.52, 0.0), 33.0);
    gltf.orthographic("Above", v(0.37, 5.0, 2.31), v(0.03, 0.3, 0.07), 2.7);
    gltf
}

fn table(gltf: &mut Gltf) {
    let wood = gltf.texture(
        "wood",
        &Pixels::paint(128, 128, wood),
        Filter::Linear,
        Wrap::Mirror,
    );
    let wood = gltf.material(Material::glossy("wood", WHITE, 0.45).textured(wood));
    let top = gltf.mesh("table", &cuboid(v(1.9, 0.05, 1.3)).tiled(2.0, 1.3), wood);
    gltf.place("table", top, 0.0, -0.05, 0.05);
    // Seen from within only: the mirrors show it, and a camera may stand outside.
    let plaster = gltf.material(Material::matte("plaster", [0.48, 0.56, 0.58]));
    let room = gltf.mesh(
        "room",
        &cuboid(v(4.6, 2.6, 4.1)).inverted().plain(),
        plaster,
    );
    gltf.place("room", room, 0.0, 1.4, 2.4);
}

fn standing_mirror(gltf: &mut Gltf) {
    let silver = gltf.material(Material::metal("silver", [0.93, 0.93, 0.92], 0.0));
    let lacquer = gltf.material(Material::glossy("lacquer", [0.10, 0.03, 0.03], 0.3));
    let glass = gltf.mesh(
        "mirror",
        &quad(v(0.44, 0.0, 0.0), v(0.0, 0.58, 0.0)).plain(),
        silver,
    );
    let frame = gltf.mesh("frame", &cuboid(v(0.48, 0.62, 0.02)).plain(), lacquer);
    let parts = [
        gltf.place("glass", glass, 0.0, 0.0, 0.023),
        gltf.place("frame", frame, 0.0, 0.0, 0.0),
    ];
    let lean = gltf.node(Node::new("lean").turned(DVec3::X, -7.0).children(&parts));
    gltf.node(
        Node::new("standing mirror")
            .at(-0.86, 0.645, -0.78)
            .turned(UP, 27.0)
            .children(&[lean]),
    );
}

/// The water reaches halfway into the wall of the glass, so that there is no gap, nor two surfaces in one place.
fn tumbler(gltf: &mut Gltf) {
    const COLUMNS: u32 = 72;
    let glass = gltf.material(Material::glass("glass", 1.5));
    let water = gltf.material(Material::glass("water", 1.33).absorbing([0.80, 0.93, 0.95], 1.0));
    let green =
        gltf.material(Material::glass("green glass", 1.52).absorbing([0.35, 0.85, 0.45], 0.15));
    let paper = gltf.material(Material::matte("straw", [0.85, 0.25, 0.20]));

    let wall = [
        [0.0, 0.0],
        [0.28, 0.0],
        [0.34, 0.85],
        [0.31, 0.85],
        [0.255, 0.07],
        [0.0, 0.07],
    ];
    let filling = [[0.0, 0.045], [0.266, 0.045], [0.307, 0.6], [0.0, 0.6]];
    let wall = gltf.mesh("tumbler", &lathe(&profile(&wall), COLUMNS).plain(), glass);
    let filling = gltf.mesh("water", &lathe(&profile(&filling), COLUMNS).plain(), water);
    let marble = gltf.mesh("marble", &icosphere(12), green);
    let straw = [[0.0, -0.5], [0.018, -0.5], [0.018, 0.5], [0.0, 0.5]];
    let straw = gltf.mesh("straw", &lathe(&profile(&straw), 20).plain(), paper);

    let marble = gltf.node(
        Node::new("marble")
            .at(-0.1, 0.191, 0.06)
            .scaled(0.12, 0.12, 0.12)
            .mesh(marble),
    );
    let straw = gltf.node(
        Node::new("straw")
            .at(0.08, 0.6, -0.05)
            .turned(DVec3::Z, -17.0)
            .mesh(straw),
    );
    let parts = [
        gltf.place("glass", wall, 0.0, 0.0, 0.0),
        gltf.place("water", filling, 0.0, 0.0, 0.0),
        marble,
        straw,
    ];
    gltf.node(
        Node::new("glass of water")
            .at(0.02, 0.003, 0.33)
            .children(&parts),
    );
}

fn coloured_glass(gltf: &mut Gltf) {
    let red = gltf.material(Material::glass("red glass", 1.5).absorbing([0.90, 0.12, 0.10], 0.25));
    let blue = gltf.material(Material::glass("blue glass", 1.6).absorbing([0.15, 0.35, 0.92], 0.3));
    let bottle = [
        [0.0, 0.0],
        [0.13, 0.0],
        [0.14, 0.02],
        [0.14, 0.34],
        [0.12, 0.40],
        [0.05, 0.46],
        [0.05, 0.58],
        [0.0, 0.58],
    ];
    let bottle = gltf.mesh("bottle", &lathe(&profile(&bottle), 56).plain(), red);
    gltf.place("bottle", bottle, 0.67, 0.003, 0.22);
    let corners = [[-0.2, 0.0], [0.2, 0.0], [0.0, 0.34]];
    let wedge = gltf.mesh("prism", &prism(&profile(&corners), 0.36).plain(), blue);
    gltf.node(
        Node::new("prism")
            .at(-0.55, 0.003, 0.72)
            .turned(UP, 32.0)
            .mesh(wedge),
    );
}

/// Leaves cut from cards, and a veil that lets half of what is behind it through.
fn plant(gltf: &mut Gltf) {
    let leaf = gltf.texture(
        "leaf",
        &Pixels::paint(64, 64, cards::leaf),
        Filter::Linear,
        Wrap::Clamp,
    );
    let leaf = gltf.material(
        Material::matte("leaf", WHITE)
            .textured(leaf)
            .masked(0.5)
            .double_sided(),
    );
    let clay = gltf.material(Material::matte("clay", [0.55, 0.25, 0.15]));
    let blade = gltf.mesh("leaf", &quad(v(0.2, 0.0, 0.0), v(0.0, 0.3, 0.0)), leaf);
    let pot = [
        [0.0, 0.0],
        [0.13, 0.0],
        [0.18, 0.26],
        [0.15, 0.26],
        [0.14, 0.22],
        [0.0, 0.22],
    ];
    let pot = gltf.mesh("pot", &lathe(&profile(&pot), 40).plain(), clay);

    let mut parts = vec![gltf.place("pot", pot, 0.0, 0.0, 0.0)];
    for i in 0..5 {
        // Turned about the stem, leaning out; the stalk is the picture's lower edge.
        let stalk = gltf.place("blade", blade, 0.0, 0.29, 0.0);
        let lean = 24.0 + 6.0 * f64::from(i % 3);
        let leaning = gltf.node(
            Node::new("leaning")
                .turned(DVec3::X, lean)
                .children(&[stalk]),
        );
        let turned = Node::new("leaf")
            .at(0.0, 0.24, 0.0)
            .turned(UP, 72.0 * f64::from(i) + 13.0);
        parts.push(gltf.node(turned.children(&[leaning])));
    }
    gltf.node(Node::new("plant").at(1.03, 0.002, -0.62).children(&parts));

    let fade = Pixels::paint(32, 32, |u, v| {
        let [r, g, b] = mix([0.95, 0.85, 0.45], [0.85, 0.35, 0.55], u);
        [r, g, b, 0.15 + 0.7 * v]
    });
    let fade = gltf.texture("veil", &fade, Filter::Linear, Wrap::Clamp);
    let fade = gltf.material(
        Material::matte("veil", WHITE)
            .textured(fade)
            .blended(1.0)
            .double_sided(),
    );
    let veil = gltf.mesh("veil", &quad(v(0.26, 0.0, 0.0), v(0.0, 0.3, 0.0)), fade);
    gltf.node(
        Node::new("veil")
            .at(0.47, 0.312, -0.47)
            .turned(UP, -14.0)
            .mesh(veil),
    );
}

/// One sphere in three storages: f32, quantised, and with a dent that a sparse accessor presses into it.
fn balls(gltf: &mut Gltf) {
    let chrome = gltf.material(Material::metal("chrome", [0.88, 0.88, 0.90], 0.0));
    let segments = Pixels::paint(24, 2, |u, v| opaque(beach_ball(u, v)));
    let segments = gltf.texture("segments", &segments, Filter::Nearest, Wrap::Repeat);
    let segments = gltf.material(Material::glossy("beach ball", WHITE, 0.35).textured(segments));
    let brass = gltf.material(Material::metal("brass", [0.87, 0.66, 0.30], 0.3));

    let ball = gltf.mesh("chrome", &icosphere(18), chrome);
    gltf.node(
        Node::new("chrome ball")
            .at(-0.28, 0.281, -0.48)
            .scaled(0.28, 0.28, 0.28)
            .mesh(ball),
    );

    let sphere = uv_sphere(48, 24);
    let thumb = v(0.55, 0.45, 0.7).normalize();
    let dented = sphere.clone().bent(|p| {
        let depth = (p.dot(thumb) - 0.8).max(0.0);
        p - thumb * (1.6 * depth)
    });
    let dented = gltf.sparse_mesh("dented ball", &sphere, &dented, segments);
    gltf.node(
        Node::new("dented ball")
            .at(-1.12, 0.262, 0.38)
            .turned(v(0.3, 1.0, 0.2), 20.0)
            .scaled(0.26, 0.26, 0.26)
            .mesh(dented),
    );

    let small = gltf.mesh_as("small ball", &[(&sphere, brass)], Layout::Quantized);
    gltf.node(
        Node::new("small ball")
            .at(0.93, 0.132, 0.77)
            .scaled(0.13, 0.13, 0.13)
            .mesh(small),
    );
}

fn books(gltf: &mut Gltf) {
    let cloth = Pixels::bumps(32, |u, v| 0.004 * noise(u * 16.0, v * 16.0, 16));
    let cloth = gltf.texture("cloth", &cloth, Filter::Linear, Wrap::Repeat);
    let block = cuboid(v(0.26, 0.045, 0.18)).tiled(2.0, 2.0);
    for (i, (name, color)) in [
        ("green book", [0.08, 0.24, 0.14]),
        ("yellow book", [0.72, 0.52, 0.12]),
    ]
    .into_iter()
    .enumerate()
    {
        let material = gltf.material(Material::glossy(name, color, 0.6).normal_map(cloth, 0.8));
        let mesh = gltf.mesh_as(name, &[(&block, material)], Layout::Interleaved);
        let level = i as f64;
        gltf.node(
            Node::new(name)
                .at(1.28 - 0.03 * level, 0.047 + 0.093 * level, 0.27)
                .turned(UP, -22.0 + 31.0 * level)
                .mesh(mesh),
        );
    }
}

/// A tree of nodes: arms that hang from arms; hooks that a negative scale mirrors, and one that a matrix shears.
fn mobile(gltf: &mut Gltf) {
    let steel = gltf.material(Material::metal("steel", [0.62, 0.62, 0.64], 0.4));
    let violet = gltf.material(Material::glossy("violet", [0.36, 0.14, 0.52], 0.4));
    let glowing = gltf.material(
        Material::matte("glowing", [0.1, 0.1, 0.1])
            .emissive([0.5, 0.30, 0.08])
            .extension(
                "KHR_materials_emissive_strength",
                json!({ "emissiveStrength": 1.6 }),
            ),
    );
    let rod = gltf.mesh("rod", &cuboid(v(0.3, 0.008, 0.008)).plain(), steel);
    let thread = gltf.mesh("thread", &cuboid(v(0.004, 0.07, 0.004)).plain(), steel);
    let hook = gltf.mesh("hook", &hook(), violet);
    let bead = gltf.mesh("bead", &icosphere(6), glowing);

    let left = arm(gltf, "left arm", [rod, thread], [hook, bead]);
    let right = arm(gltf, "right arm", [rod, thread], [hook, bead]);
    let left = gltf.node(
        Node::new("left")
            .at(-0.29, -0.16, 0.0)
            .turned(UP, 35.0)
            .scaled(0.7, 0.7, 0.7)
            .children(&[left]),
    );
    let right = gltf.node(
        Node::new("right")
            .at(0.29, -0.16, 0.0)
            .turned(UP, -20.0)
            .scaled(-0.7, 0.7, 0.7)
            .children(&[right]),
    );
    let bar = gltf.place("bar", rod, 0.0, 0.0, 0.0);
    let hung = gltf.node(
        Node::new("hung")
            .turned(DVec3::Z, 5.0)
            .children(&[bar, left, right]),
    );
    gltf.node(
        Node::new("mobile")
            .at(0.56, 1.39, -0.25)
            .turned(UP, 16.0)
            .children(&[hung]),
    );
}

fn arm(
    gltf: &mut Gltf,
    name: &str,
    [rod, thread]: [MeshId; 2],
    [hook, bead]: [MeshId; 2],
) -> NodeId {
    let sheared = DMat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.35, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.2, 0.0],
        [-0.26, -0.17, 0.0, 1.0],
    ]);
    let parts = [
        gltf.place("thread", thread, 0.0, 0.09, 0.0),
        gltf.place("rod", rod, 0.0, 0.0, 0.0),
        gltf.node(Node::new("sheared hook").matrix(sheared).mesh(hook)),
        gltf.node(
            Node::new("mirrored hook")
                .at(0.1, -0.17, 0.0)
                .scaled(-1.0, 1.0, 1.0)
                .mesh(hook),
        ),
        gltf.node(
            Node::new("bead")
                .at(0.27, -0.08, 0.0)
                .scaled(0.06, 0.06, 0.06)
                .mesh(bead),
        ),
    ];
    gltf.node(Node::new(name).children(&parts))
}

/// An L, so that one can tell it from its mirror image.
fn hook() -> Shape {
    let stem = cuboid(v(0.025, 0.13, 0.02)).plain();
    let foot = cuboid(v(0.04, 0.025, 0.02)).plain();
    stem.and(foot.moved(0.067, -0.105, 0.0))
}

fn profile<const N: usize>(points: &[[f64; 2]; N]) -> Vec<DVec2> {
    points.iter().map(|&[x, y]| DVec2::new(x, y)).collect()
}

fn beach_ball(u: f64, v: f64) -> [f64; 3] {
    let colors = [
        [0.90, 0.20, 0.15],
        [0.95, 0.95, 0.92],
        [0.15, 0.40, 0.80],
        [0.95, 0.80, 0.20],
    ];
    let segment = (u * 8.0) as usize + usize::from(v > 0.5) * 2;
    colors[segment % colors.len()]
}

fn wood(u: f64, v: f64) -> [f64; 4] {
    let bend = noise(u * 2.0, v * 4.0, 4) * 1.4 + noise(u * 4.0, v * 16.0, 16) * 0.25;
    let rings = ((v * 5.0 + bend) * 2.0).fract();
    let grain = noise(u * 8.0, v * 64.0, 64);
    opaque(mix(
        [0.46, 0.29, 0.16],
        [0.70, 0.50, 0.31],
        0.55 * rings + 0.45 * grain,
    ))
}
