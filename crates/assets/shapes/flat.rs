//! Shapes with flat faces, and a relief over a rectangle.

use glam::{DVec2, DVec3};

use super::{Orientation, Shape};

/// A parallelogram around the origin with half sides `u`, to the right, and `v`, up, seen from its front. A picture on
/// it stands upright.
#[must_use]
pub fn quad(u: DVec3, v: DVec3) -> Shape {
    let mut shape = Shape::default();
    face(
        &mut shape,
        &[-u - v, u - v, u + v, -u + v],
        u.cross(v).normalize(),
    );
    shape
}

/// A box around the origin; a picture on each side.
#[must_use]
pub fn cuboid(half: DVec3) -> Shape {
    let mut shape = Shape {
        closed: Some(Orientation::Outward),
        ..Shape::default()
    };
    let [x, y, z] = [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z];
    // Out of the side, to the right, up, seen from outside.
    for (out, u, v) in [
        (x, -z, y),
        (-x, z, y),
        (y, x, -z),
        (-y, x, z),
        (z, x, y),
        (-z, -x, y),
    ] {
        face(
            &mut shape,
            &[out - u - v, out + u - v, out + u + v, out - u + v],
            out.normalize(),
        );
    }
    shape
}

/// A convex polygon in x and y, counter-clockwise, stretched from `-depth / 2` to `depth / 2` in z.
#[must_use]
pub fn prism(polygon: &[DVec2], depth: f64) -> Shape {
    let mut shape = Shape {
        closed: Some(Orientation::Outward),
        ..Shape::default()
    };
    let front: Vec<DVec3> = polygon.iter().map(|p| p.extend(depth / 2.0)).collect();
    let back: Vec<DVec3> = polygon
        .iter()
        .rev()
        .map(|p| p.extend(-depth / 2.0))
        .collect();
    face(&mut shape, &front, DVec3::Z);
    face(&mut shape, &back, -DVec3::Z);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (near, far) = (depth / 2.0, -depth / 2.0);
        let normal = (b - a).perp().normalize() * -1.0;
        face(
            &mut shape,
            &[a.extend(near), a.extend(far), b.extend(far), b.extend(near)],
            normal.extend(0.0),
        );
    }
    shape
}

/// A height over each point of a rectangle around the origin, `columns` by `rows` cells, facing up.
#[must_use]
pub fn relief(size: DVec2, columns: u32, rows: u32, height: impl Fn(f64, f64) -> f64) -> Shape {
    let mut shape = Shape::default();
    let cells = DVec2::new(f64::from(columns), f64::from(rows));
    let step = size.min_element() * 1e-4;
    for j in 0..=rows {
        for i in 0..=columns {
            let uv = DVec2::new(f64::from(i), f64::from(j)) / cells;
            let p = (uv - 0.5) * size;
            let slope_x = (height(p.x + step, p.y) - height(p.x - step, p.y)) / (2.0 * step);
            let slope_z = (height(p.x, p.y + step) - height(p.x, p.y - step)) / (2.0 * step);
            let normal = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
            shape.vertex(DVec3::new(p.x, height(p.x, p.y), p.y), normal, uv);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let below = a + columns + 1;
            shape.quadrilateral([a, below, below + 1, a + 1]);
        }
    }
    shape
}

/// A convex flat face, as a fan; uv over its first side and the next (all of a picture, where it has four corners).
fn face(shape: &mut Shape, corners: &[DVec3], normal: DVec3) {
    let (along, origin) = ((corners[1] - corners[0]).normalize(), corners[0]);
    let up = normal.cross(along);
    let plane: Vec<DVec2> = corners
        .iter()
        .map(|&p| DVec2::new((p - origin).dot(along), (p - origin).dot(up)))
        .collect();
    let (min, max) = plane.iter().fold((plane[0], plane[0]), |(min, max), &p| {
        (min.min(p), max.max(p))
    });
    let indices: Vec<u32> = corners
        .iter()
        .zip(&plane)
        .map(|(&p, &q)| {
            let uv = (q - min) / (max - min);
            shape.vertex(p, normal, DVec2::new(uv.x, 1.0 - uv.y))
        })
        .collect();
    shape.triangles.extend(
        indices
            .windows(2)
            .skip(1)
            .map(|pair| [indices[0], pair[0], pair[1]]),
    );
}
