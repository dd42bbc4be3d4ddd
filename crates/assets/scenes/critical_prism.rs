//! Right-angled glass prisms standing on their triangles. In the first every ray meets the long face beyond the critical
//! angle: it is a mirror. The second is turned so that the critical angle lies in the middle of its picture: one half
//! reflects what stands beside it, the other lets through what stands behind.

use std::f64::consts::SQRT_2;

use glam::{DAffine3, DQuat, DVec2, DVec3};

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Material, MeshId, Node, Wrap};
use crate::pixels::{Pixels, opaque};
use crate::shapes::{Shape, prism, quad};

const EYE: DVec3 = v(0.037, 1.31, 6.13);
/// What differs between the two. The critical angle is 3.2 degrees less than the 45 of the long face; in air that is 4.8.
const STANDS: [Stand; 2] = [
    Stand {
        name: "reflecting prism",
        at: [-1.22, 0.1],
        turn: 2.6,
        behind: [-0.1, -1.9],
        facing: 0.0,
    },
    Stand {
        name: "critical prism",
        at: [0.95, 0.1],
        turn: -4.8,
        behind: [1.5, -1.75],
        facing: -45.0,
    },
];

struct Stand {
    name: &'static str,
    /// x and z, metres.
    at: [f64; 2],
    /// By how many degrees the prism is turned from where the ray to its middle meets the first face straight on.
    turn: f64,
    /// x and z of the card behind, as the camera sees the prism, and where it faces. What just passes the long face comes out
    /// along it: from 45 degrees to the right.
    behind: [f64; 2],
    facing: f64,
}

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("critical-prism");
    let glass = gltf.material(Material::glass("glass", 1.5));
    let ground = gltf.material(Material::matte("floor", [0.55, 0.55, 0.53]));
    let wall = gltf.material(Material::matte("wall", [0.42, 0.47, 0.55]));
    let rainbow = Pixels::paint(8, 1, |u, _| opaque(RAINBOW[(u * 8.0) as usize]));
    let rainbow = gltf.texture("rainbow", &rainbow, Filter::Nearest, Wrap::Clamp);
    let rainbow = gltf.material(
        Material::matte("rainbow", WHITE)
            .textured(rainbow)
            .double_sided(),
    );
    let squares = Pixels::checker(8, [0.95; 3], [0.12; 3]);
    let squares = gltf.texture("squares", &squares, Filter::Nearest, Wrap::Repeat);
    let squares = gltf.material(
        Material::matte("squares", WHITE)
            .textured(squares)
            .double_sided(),
    );

    let floor = gltf.mesh(
        "floor",
        &quad(v(6.0, 0.0, 0.0), v(0.0, 0.0, -5.0)).plain(),
        ground,
    );
    gltf.place("floor", floor, 0.0, 0.0, 0.5);
    let backdrop = gltf.mesh(
        "wall",
        &quad(v(6.0, 0.0, 0.0), v(0.0, 3.0, 0.0)).plain(),
        wall,
    );
    gltf.place("wall", backdrop, 0.0, 3.0, -4.4);

    let glass = gltf.mesh("prism", &right_angled(0.62, 1.5), glass);
    let beside = gltf.mesh(
        "rainbow card",
        &quad(v(0.75, 0.0, 0.0), v(0.0, 0.95, 0.0)),
        rainbow,
    );
    let behind = gltf.mesh(
        "square card",
        &quad(v(0.85, 0.0, 0.0), v(0.0, 0.85, 0.0)),
        squares,
    );
    for stand in &STANDS {
        set_up(&mut gltf, stand, [glass, beside, behind]);
    }

    gltf.point_light("lamp", v(-0.6, 5.2, 4.7), WHITE, 105.0, None);
    gltf.perspective("Camera", EYE, v(0.17, 0.88, 0.0), 33.0);
    gltf
}

/// A prism with a card to its right, where total reflection looks, and one behind it, seen where it does not reflect.
fn set_up(gltf: &mut Gltf, stand: &Stand, [glass, beside, behind]: [MeshId; 3]) {
    let up = v(0.0, 1.0, 0.0);
    let ([x, z], [behind_x, behind_z]) = (stand.at, stand.behind);
    let sight = (EYE.x - x).atan2(EYE.z - z).to_degrees();
    let prism = gltf.node(Node::new("prism").turned(up, stand.turn).mesh(glass));
    let beside = gltf.node(
        Node::new("beside")
            .at(0.98, 0.2, 0.0)
            .turned(up, -90.0)
            .mesh(beside),
    );
    let behind = Node::new("behind")
        .at(behind_x, 0.1, behind_z)
        .turned(up, stand.facing)
        .mesh(behind);
    let behind = gltf.node(behind);
    let stand = Node::new(stand.name).at(x, 0.77, z).turned(up, sight);
    gltf.node(stand.children(&[prism, beside, behind]));
}

/// Legs of length `2 a` facing +Z and +X, the long face the other two; `height` along y.
fn right_angled(a: f64, height: f64) -> Shape {
    // Lying along z, the right angle at the lower right; then set upright: y becomes -z, z becomes y.
    let corners = [DVec2::new(-a, -a), DVec2::new(a, -a), DVec2::new(a, a)];
    let upright = DAffine3::from_quat(DQuat::from_xyzw(-1.0 / SQRT_2, 0.0, 0.0, 1.0 / SQRT_2));
    prism(&corners, height).transformed(upright).plain()
}

/// sRGB.
const RAINBOW: [[f64; 3]; 8] = [
    [0.85, 0.15, 0.15],
    [0.95, 0.55, 0.10],
    [0.97, 0.90, 0.20],
    [0.25, 0.70, 0.25],
    [0.10, 0.65, 0.70],
    [0.15, 0.35, 0.85],
    [0.45, 0.20, 0.70],
    [0.95, 0.95, 0.95],
];
