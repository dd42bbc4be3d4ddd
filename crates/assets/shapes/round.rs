//! Spheres and solids of revolution.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{Orientation, Shape};

/// A unit sphere of `20 n^2` triangles: an icosahedron with each side in `n` parts. Nearly even, without uv.
#[must_use]
pub fn icosphere(n: u32) -> Shape {
    let corners = icosahedron();
    let mut shape = Shape {
        closed: Some(Orientation::Outward),
        ..Shape::default()
    };
    let mut known: BTreeMap<[u32; 12], u32> = BTreeMap::new();
    for face in ICOSAHEDRON_FACES {
        // A vertex is a sum of whole multiples of corners: faces that meet name it alike, so they share it.
        let mut vertex = |i: u32, j: u32| {
            let mut weights = [0; 12];
            for (corner, weight) in face.into_iter().zip([n - i - j, i, j]) {
                weights[corner] = weight;
            }
            *known.entry(weights).or_insert_with(|| {
                let sum: DVec3 = weights
                    .iter()
                    .zip(corners)
                    .map(|(&weight, corner)| corner * f64::from(weight))
                    .sum();
                shape.positions.push(sum.normalize());
                shape.positions.len() as u32 - 1
            })
        };
        let mut triangles = Vec::new();
        for j in 0..n {
            for i in 0..n - j {
                triangles.push([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                if i + j + 1 < n {
                    triangles.push([vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
                }
            }
        }
        shape.triangles.extend(triangles);
    }
    shape.normals.clone_from(&shape.positions);
    shape
}

/// Three golden rectangles, turned so that no corner lies on an axis and no edge along one.
fn icosahedron() -> [DVec3; 12] {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let turn = glam::DQuat::from_xyzw(0.18, 0.31, -0.22, 0.9).normalize();
    let mut corners = [DVec3::ZERO; 12];
    for (i, corner) in corners.iter_mut().enumerate() {
        let [a, b] = [i & 1, i >> 1 & 1].map(|bit| 1.0 - 2.0 * bit as f64);
        let (long, short) = (b * golden, a);
        *corner = turn
            * match i / 4 {
                0 => DVec3::new(short, long, 0.0),
                1 => DVec3::new(0.0, short, long),
                _ => DVec3::new(long, 0.0, short),
            }
            .normalize();
    }
    corners
}

/// Counter-clockwise seen from outside.
#[rustfmt::skip]
const ICOSAHEDRON_FACES: [[usize; 3]; 20] = [
    [0, 1, 4], [0, 6, 1], [0, 4, 8], [0, 9, 6], [0, 8, 9],
    [1, 10, 4], [1, 6, 11], [1, 11, 10], [2, 5, 3], [2, 3, 7],
    [2, 8, 5], [2, 7, 9], [2, 9, 8], [3, 5, 10], [3, 11, 7],
    [3, 10, 11], [4, 5, 8], [4, 10, 5], [6, 9, 7], [6, 7, 11],
];

/// A unit sphere of meridians and parallels, with uv: u goes round eastwards from the seam at -Z, v from north to south.
#[must_use]
pub fn uv_sphere(columns: u32, rows: u32) -> Shape {
    let mut shape = Shape {
        closed: Some(Orientation::Outward),
        ..Shape::default()
    };
    for j in 0..=rows {
        // Both poles exactly on the axis.
        let (radius, y) = match j {
            0 => (0.0, 1.0),
            _ if j == rows => (0.0, -1.0),
            _ => (PI * f64::from(j) / f64::from(rows)).sin_cos(),
        };
        for i in 0..=columns {
            let p = around(i, columns) * radius + DVec3::Y * y;
            shape.vertex(
                p,
                p,
                DVec2::new(
                    f64::from(i) / f64::from(columns),
                    f64::from(j) / f64::from(rows),
                ),
            );
        }
    }
    grid(&mut shape, 0, columns, rows);
    shape
}

/// What a profile (radius, height) sweeps in a turn about +Y. The profile runs counter-clockwise in the half plane of
/// positive radius: from the axis to the axis, or round into itself. Bends of less than 40 degrees are smooth, others creases.
#[must_use]
pub fn lathe(profile: &[DVec2], columns: u32) -> Shape {
    let mut shape = Shape {
        closed: Some(Orientation::Outward),
        ..Shape::default()
    };
    let sides: Vec<DVec2> = profile
        .windows(2)
        .map(|side| -(side[1] - side[0]).perp().normalize())
        .collect();
    let round = profile.first() == profile.last();
    let length: f64 = profile
        .windows(2)
        .map(|side| side[0].distance(side[1]))
        .sum();
    let mut run = 0.0;
    for (k, side) in profile.windows(2).enumerate() {
        let neighbour = |step: isize| {
            let at = k as isize + step;
            let at = if round {
                at.rem_euclid(sides.len() as isize)
            } else {
                at
            };
            usize::try_from(at)
                .ok()
                .and_then(|at| sides.get(at))
                .copied()
        };
        let normal = |neighbour: Option<DVec2>| match neighbour {
            Some(other) if other.dot(sides[k]) > 40_f64.to_radians().cos() => {
                (other + sides[k]).normalize()
            }
            _ => sides[k],
        };
        let first = shape.positions.len() as u32;
        // The lower ring last, so that rows go downwards in v as on a sphere.
        let ends = [
            (
                side[1],
                normal(neighbour(1)),
                run + side[0].distance(side[1]),
            ),
            (side[0], normal(neighbour(-1)), run),
        ];
        for (point, normal, at) in ends {
            for i in 0..=columns {
                let out = around(i, columns);
                let uv = DVec2::new(f64::from(i) / f64::from(columns), 1.0 - at / length);
                shape.vertex(
                    out * point.x + DVec3::Y * point.y,
                    out * normal.x + DVec3::Y * normal.y,
                    uv,
                );
            }
        }
        grid(&mut shape, first, columns, 1);
        run += side[0].distance(side[1]);
    }
    shape
}

/// The horizontal direction of column `i` of `columns`; the last is the first again, to the last bit.
fn around(i: u32, columns: u32) -> DVec3 {
    let (sin, cos) = (TAU * f64::from(i % columns) / f64::from(columns)).sin_cos();
    DVec3::new(-sin, 0.0, -cos)
}

/// Cells between `rows + 1` rings of `columns + 1` vertices, from the top down.
fn grid(shape: &mut Shape, first: u32, columns: u32, rows: u32) {
    for j in 0..rows {
        for i in 0..columns {
            let a = first + j * (columns + 1) + i;
            let below = a + columns + 1;
            shape.quadrilateral([a, below, below + 1, a + 1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn icosphere_has_as_many_vertices_as_euler_says() {
        let sphere = icosphere(7);
        assert_eq!(sphere.triangles.len(), 20 * 49);
        assert_eq!(sphere.positions.len(), 2 + sphere.triangles.len() / 2);
    }
}
