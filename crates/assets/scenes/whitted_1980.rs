//! After the picture in Whitted, "An Improved Illumination Model for Shaded Display" (1980): a hollow glass sphere in
//! front of and above a mirror sphere, over a red and yellow checkerboard. Its blue sky comes from `--background`.

use super::{WHITE, v};
use crate::gltf::{Filter, Gltf, Material, Node, Wrap};
use crate::pixels::Pixels;
use crate::shapes::{icosphere, quad};

/// Triangles a sphere: 20 times the square.
const FINENESS: u32 = 28;
/// Of the glass: outer radius, and inner over outer.
const BUBBLE: (f64, f64) = (1.0, 0.93);
const SQUARES: [f64; 2] = [28.0, 44.0];

pub(super) fn scene() -> Gltf {
    let mut gltf = Gltf::new("whitted-1980");

    let glass = gltf.material(Material::glass("glass", 1.5));
    let mirror = gltf.material(Material::metal("mirror", [0.92, 0.92, 0.94], 0.0));
    let squares = Pixels::checker(2, [0.90, 0.10, 0.06], [0.98, 0.87, 0.14]);
    let squares = gltf.texture("squares", &squares, Filter::Nearest, Wrap::Repeat);
    let board = gltf.material(Material::matte("board", WHITE).textured(squares));

    let sphere = icosphere(FINENESS);
    let outside = gltf.mesh("glass, outside", &sphere, glass);
    let inside = gltf.mesh("glass, inside", &sphere.clone().inverted(), glass);
    let ball = gltf.mesh("mirror", &sphere, mirror);
    let [width, depth] = SQUARES;
    let floor =
        quad(v(width / 2.0, 0.0, 0.0), v(0.0, 0.0, -depth / 2.0)).tiled(width / 2.0, depth / 2.0);
    let floor = gltf.mesh("board", &floor, board);

    let (outer, inner) = (BUBBLE.0, BUBBLE.0 * BUBBLE.1);
    let inside = gltf.node(
        Node::new("glass, inside")
            .scaled(inner, inner, inner)
            .mesh(inside),
    );
    let outside = gltf.node(
        Node::new("glass, outside")
            .scaled(outer, outer, outer)
            .mesh(outside),
    );
    gltf.node(
        Node::new("glass sphere")
            .at(-0.28, 2.02, 0.4)
            .children(&[outside, inside]),
    );
    gltf.node(
        Node::new("mirror sphere")
            .at(1.02, 1.12, -1.35)
            .scaled(0.95, 0.95, 0.95)
            .mesh(ball),
    );
    gltf.place("board", floor, 1.37, 0.0, -11.3);

    // So far off that the inverse square leaves the far squares their light.
    gltf.point_light("lamp", v(-19.0, 36.0, 24.0), WHITE, 7800.0, None);
    gltf.perspective("Camera", v(0.113, 2.37, 6.53), v(0.293, 1.51, 0.0), 35.0);
    gltf
}
