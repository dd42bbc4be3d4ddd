//! A ray and a triangle.

use crate::vec::Vec3;

/// The half-line `origin + t direction`, `t > 0`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    /// The triangle that it starts from: being flat, that one is never met again.
    pub leaving: Option<usize>,
}

impl Ray {
    /// A ray that starts in the open.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            leaving: None,
        }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction, above 0.
    pub t: f64,
    /// Barycentric coordinate of the triangle's vertex 1, in [0, 1].
    pub u: f64,
    /// Barycentric coordinate of the triangle's vertex 2, in [0, 1 - u].
    pub v: f64,
    /// Index of the triangle in the scene.
    pub triangle: usize,
    /// The triangle is seen from its back.
    pub back: bool,
}

impl Hit {
    /// Whether this hit counts where both are on the ray: the nearer one, of equals the lower triangle index.
    pub(crate) fn precedes(&self, other: &Self) -> bool {
        (self.t, self.triangle) < (other.t, other.triangle)
    }
}

/// A ray made ready to be tested against many triangles.
pub(crate) struct Probe<'r> {
    ray: &'r Ray,
    /// The axis along which the direction is longest last.
    axes: [usize; 3],
    /// The direction's slopes in the plane of the other two.
    shear: [f64; 2],
}

impl<'r> Probe<'r> {
    pub fn new(ray: &'r Ray) -> Self {
        let d = ray.direction.to_array();
        let longest = (0..3).fold(
            0,
            |best, k| if d[k].abs() > d[best].abs() { k } else { best },
        );
        let axes = [(longest + 1) % 3, (longest + 2) % 3, longest];
        let shear = [d[axes[0]] / d[longest], d[axes[1]] / d[longest]];
        Self { ray, axes, shear }
    }

    /// Meets a triangle, edges and vertices included; its index is only noted in the hit.
    ///
    /// Whether it is hit is told in the plane across the ray, where each vertex lies in one place for all its triangles
    /// and the ray in the origin: neighbours get the same number with opposite sign for the edge that they share, and
    /// rounding never turns a sign, so no ray slips through an edge or a vertex (Woop, Benthin and Wald 2013). Where it
    /// is hit is found by Cramer's rule (Moeller and Trumbore 1997), which keeps more digits on small triangles far away.
    pub fn intersect(&self, corners: &[Vec3; 3], triangle: usize) -> Option<Hit> {
        let [a, b, c] = corners.map(|corner| self.across(corner));
        let edges = [
            c[0] * b[1] - c[1] * b[0],
            a[0] * c[1] - a[1] * c[0],
            b[0] * a[1] - b[1] * a[0],
        ];
        if edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0) {
            return None;
        }

        // It meets the ray at no distance; how far its plane seems to be is rounding.
        if corners.contains(&self.ray.origin) {
            return None;
        }
        let direction = self.ray.direction;
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let s = self.ray.origin - corners[0];
        let q = s.cross(e1);
        let t = e2.dot(q) / determinant;
        // The signs have decided already that it is inside; rounding may say otherwise by an ulp.
        let u = (s.dot(p) / determinant).clamp(0.0, 1.0);
        let v = (direction.dot(q) / determinant).clamp(0.0, 1.0 - u);
        (t > 0.0).then_some(Hit {
            t,
            u,
            v,
            triangle,
            back: determinant < 0.0,
        })
    }

    fn across(&self, point: Vec3) -> [f64; 2] {
        let p = (point - self.ray.origin).to_array();
        let [x, y, z] = self.axes.map(|axis| p[axis]);
        [x - self.shear[0] * z, y - self.shear[1] * z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [
        Vec3::ZERO,
        Vec3 {
            x: 1.0,
            y: 0.0,
            z: 0.0,
        },
        Vec3 {
            x: 0.0,
            y: 1.0,
            z: 0.0,
        },
    ];

    fn down(x: f64, y: f64) -> Ray {
        Ray::new(Vec3::new(x, y, 2.0), Vec3::new(0.0, 0.0, -1.0))
    }

    #[test]
    fn coordinates_belong_to_vertices_one_and_two() {
        let hit = Probe::new(&down(0.25, 0.5))
            .intersect(&TRIANGLE, 7)
            .unwrap();
        assert_eq!(
            hit,
            Hit {
                t: 2.0,
                u: 0.25,
                v: 0.5,
                triangle: 7,
                back: false
            }
        );
    }

    #[test]
    fn back_is_where_the_vertices_run_clockwise() {
        let up = Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::new(0.0, 0.0, 1.0));
        assert!(Probe::new(&up).intersect(&TRIANGLE, 0).unwrap().back);
    }

    #[test]
    fn edges_and_vertices_are_included_and_nothing_beyond() {
        for (x, y) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (0.5, 0.0),
            (0.0, 0.5),
            (0.5, 0.5),
        ] {
            assert!(
                Probe::new(&down(x, y)).intersect(&TRIANGLE, 0).is_some(),
                "{x} {y}"
            );
        }
        for (x, y) in [(-1e-9, 0.5), (0.5, -1e-9), (0.5 + 1e-9, 0.5)] {
            assert!(
                Probe::new(&down(x, y)).intersect(&TRIANGLE, 0).is_none(),
                "{x} {y}"
            );
        }
    }

    #[test]
    fn a_triangle_with_a_corner_at_the_origin_is_not_hit() {
        let eye = Vec3::new(0.123, 0.456, 0.789);
        let others = [Vec3::new(1.3, 0.2, -0.7), Vec3::new(0.31, -1.7, 0.9)];
        for first in 0..3 {
            let mut corners = [eye, others[0], others[1]];
            corners.rotate_right(first);
            let towards = |x: f64| Vec3::new(x.sin(), x.cos(), (3.0 * x).sin());
            for step in 0..100 {
                let ray = Ray::new(eye, towards(f64::from(step)));
                assert!(Probe::new(&ray).intersect(&corners, 0).is_none());
            }
        }
    }

    #[test]
    fn behind_parallel_and_degenerate_are_missed() {
        let away = Ray::new(Vec3::new(0.2, 0.2, 2.0), Vec3::new(0.0, 0.0, 1.0));
        assert!(Probe::new(&away).intersect(&TRIANGLE, 0).is_none());
        let along = Ray::new(Vec3::new(-1.0, 0.2, 0.0), Vec3::new(1.0, 0.0, 0.0));
        assert!(Probe::new(&along).intersect(&TRIANGLE, 0).is_none());
        assert!(
            Probe::new(&down(0.0, 0.0))
                .intersect(&[Vec3::ZERO; 3], 0)
                .is_none()
        );
    }
}
