//! Triangles, boxes, and the start of rays that leave a surface.

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use raytree::{Bvh, Preset, Scene, build_bvh};
use raytree_gpu::Piece;
use raytree_stress::{
    random::Random,
    scenes::{Build, matte},
};

use super::trial::{Answer, Arguments, EPSILON, Trial, decades, direction, ensure, near, point};

/// A ray and a triangle that it is aimed at, or beside.
#[derive(Clone, Debug)]
struct Aimed {
    origin: Vec3,
    direction: Vec3,
    corners: [Vec3; 3],
}

fn aimed() -> impl Strategy<Value = Aimed> {
    let corners = (point(), decades(-4.0, 0.0), [point(), point(), point()]);
    let place = (-0.5_f64..1.5, -0.5_f64..1.5);
    (corners, point(), place).prop_map(|((middle, size, around), origin, (u, v))| {
        let corners = around.map(|corner| middle + size as f32 * corner);
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let target = a + u * (b - a) + v * (c - a);
        let direction = (target - origin.as_dvec3()).normalize_or(DVec3::X);
        Aimed {
            origin: origin * 1.5,
            direction: direction.as_vec3(),
            corners,
        }
    })
}

/// Where the ray meets the triangle's plane, and how well f32 can know: by Cramer's rule (Moeller and Trumbore 1997).
struct Meeting {
    t: f64,
    u: f64,
    v: f64,
    /// Of u and v.
    error: f64,
    /// Of t.
    t_error: f64,
    back: bool,
}

fn meeting(aimed: &Aimed) -> Option<Meeting> {
    let (origin, direction) = (aimed.origin.as_dvec3(), aimed.direction.as_dvec3());
    let [a, b, c] = aimed.corners.map(|corner| corner.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let slope = normal.dot(direction);
    let longest = e1.length().max(e2.length()).max((c - b).length());
    // Seen along the ray: twice the area, and the least height.
    let height = slope.abs() / longest;
    let farthest = [a, b, c].map(|corner| (corner - origin).length());
    let distance = farthest.into_iter().fold(0.0, f64::max);
    let cosine = slope.abs() / normal.length();
    // Slivers, and triangles seen from the side, have no digits left.
    (height > 64.0 * EPSILON * distance
        && normal.length() > 1e-3 * longest * longest
        && cosine > 1e-3)
        .then(|| {
            let from_a = origin - a;
            Meeting {
                t: (a - origin).dot(normal) / slope,
                u: from_a.dot(direction.cross(e2)) / e1.dot(direction.cross(e2)),
                v: direction.dot(from_a.cross(e1)) / e1.dot(direction.cross(e2)),
                error: 16.0 * EPSILON * distance / height,
                t_error: 16.0 * EPSILON * distance * longest * longest / (normal.length() * cosine),
                back: slope > 0.0,
            }
        })
}

#[test]
fn triangles_are_hit_where_they_are() {
    let call = |aimed: &Aimed| {
        let [a, b, c] = aimed.corners;
        let ray = Arguments::default()
            .vector(aimed.origin)
            .vector(aimed.direction);
        let edges = [b - a, c - a].map(|edge| edge.as_dvec3());
        let normal = edges[0].cross(edges[1]).normalize_or_zero().as_vec3();
        ray.vector(a).vector(b).vector(c).vector(normal).done()
    };
    let judge = |aimed: &Aimed, answer: Answer<'_>| {
        let Some(right) = meeting(aimed) else {
            return Ok(());
        };
        let inside = right.u.min(right.v).min(1.0 - right.u - right.v);
        let valid = answer.word(2) != 0;
        ensure(valid || inside < right.error, || {
            format!("missed, {inside:e} inside")
        })?;
        ensure(!valid || inside > -right.error, || {
            format!("hit, {:e} outside", -inside)
        })?;
        if !valid {
            return Ok(());
        }
        near("t", answer.number(0), right.t, right.t_error)?;
        near("u", answer.number(3), right.u, right.error)?;
        near("v", answer.number(4), right.v, right.error)?;
        ensure((answer.word(1) != 0) == right.back, || {
            "the wrong side".to_owned()
        })
    };
    Trial::alone(Piece::Triangle).holds(aimed(), call, judge);
}

fn soup(count: usize) -> (Scene, Bvh) {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(matte([0.5; 3]));
    build.soup(count, &mut Random::new(3), material);
    let bvh = build_bvh(&build.0, Preset::default()).unwrap_or_else(|error| panic!("{error}"));
    (build.0, bvh)
}

/// A child of a CWBVH node (Ylitie, Karras and Laine 2017, figure 2).
struct Child {
    min: DVec3,
    max: DVec3,
    meta: u32,
}

fn children(node: &[u32; 20]) -> Vec<Child> {
    let corner = DVec3::from_array([0, 1, 2].map(|k| f64::from(f32::from_bits(node[k]))));
    let step = DVec3::from_array([0, 1, 2].map(|k| {
        let exponent = (node[3] >> (8 * k)) & 0xff;
        f64::from(f32::from_bits(exponent << 23))
    }));
    let byte = |word: usize, child: usize| (node[word + child / 4] >> (8 * (child % 4))) & 0xff;
    let place = |words: [usize; 3], child: usize| {
        corner + step * DVec3::from_array(words.map(|word| f64::from(byte(word, child))))
    };
    (0..8)
        .map(|child| Child {
            min: place([8, 12, 16], child),
            max: place([10, 14, 18], child),
            meta: byte(6, child),
        })
        .filter(|child| child.meta != 0)
        .collect()
}

impl Child {
    /// Its bits in the answer: inner nodes by the order of their slots along the ray, leaves by their triangles.
    fn bits(&self, octant: u32) -> u32 {
        let low = self.meta & 0x1f;
        if low >= 24 {
            1 << (24 + ((low - 24) ^ octant))
        } else {
            (self.meta >> 5) << low
        }
    }

    /// Whether the ray meets the box grown by `margin` at 0 <= t <= t_max.
    fn meets(&self, origin: DVec3, direction: DVec3, t_max: f64, margin: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, t_max);
        for axis in 0..3 {
            let (low, high) = (self.min[axis] - margin, self.max[axis] + margin);
            if direction[axis] == 0.0 {
                if origin[axis] < low || origin[axis] > high {
                    return false;
                }
                continue;
            }
            let a = (low - origin[axis]) / direction[axis];
            let b = (high - origin[axis]) / direction[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// No child that the ray meets in exact arithmetic is missed, and none that it passes by at some distance is entered.
#[test]
fn boxes_are_met_and_not_much_more() {
    let (scene, bvh) = soup(4_000);
    let nodes: Vec<[u32; 20]> = bvh.nodes.iter().map(|node| bytemuck::cast(*node)).collect();
    let count = nodes.len() as u32;
    let arguments = (point(), direction(), decades(-1.0, 1.0), 0..count);
    type Visit = (Vec3, Vec3, f64, u32);
    let call = |(origin, direction, t_max, node): &Visit| {
        let ray = Arguments::default().vector(*origin).vector(*direction);
        ray.number(*t_max as f32).word(*node).done()
    };
    let judge = |(origin, direction, t_max, node): &Visit, answer: Answer<'_>| {
        let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
        let t_max = f64::from(*t_max as f32);
        for child in children(&nodes[*node as usize]) {
            let bits = child.bits(answer.word(1));
            let entered = answer.word(0) & bits;
            let met = child.meets(origin, direction, t_max, 0.0);
            ensure(!met || entered == bits, || "a box is missed".to_owned())?;
            let near = child.meets(origin, direction, t_max * 1.000_01 + 1e-6, 1e-5);
            ensure(near || entered == 0, || {
                "a box far off is entered".to_owned()
            })?;
        }
        Ok(())
    };
    Trial::within(Piece::Boxes, scene).holds(arguments, call, judge);
}

/// A ray that leaves starts on its own side of the plane, and no further from it than the hit point's error.
#[test]
fn rays_leave_to_their_side_and_stay_close() {
    let (scene, bvh) = soup(4_000);
    let count = bvh.leaf_triangles.len() as u32;
    let place = (0.0_f64..1.0, 0.0_f64..1.0);
    let arguments = (point(), 0..count, place, direction());
    type Leaving = (Vec3, u32, (f64, f64), Vec3);
    let corners = |leaf: u32| {
        let triangle = scene.geometry.triangles[bvh.leaf_triangles[leaf as usize] as usize];
        triangle
            .vertices
            .map(|vertex| scene.geometry.positions[vertex as usize].as_dvec3())
    };
    let ray = |(origin, leaf, (u, v), _): &Leaving| {
        let [a, b, c] = corners(*leaf);
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (*u, *v)
        };
        let target = a + u * (b - a) + v * (c - a);
        let direction = (target - origin.as_dvec3()).normalize().as_vec3();
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (direction, target, normal, normal.dot(direction.as_dvec3()))
    };
    let call = |leaving: &Leaving| {
        let (direction, _, _, slope) = ray(leaving);
        let (origin, leaf, _, out) = leaving;
        let call = Arguments::default().vector(*origin).vector(direction);
        call.word(*leaf)
            .word(u32::from(slope > 0.0))
            .vector(*out)
            .done()
    };
    let judge = |leaving: &Leaving, answer: Answer<'_>| {
        let (_, target, normal, slope) = ray(leaving);
        let out = leaving.3.as_dvec3();
        let [a, b, c] = corners(leaving.1);
        let flat = (b - a).cross(c - a).length() < 1e-3 * (b - a).length() * (c - a).length();
        if flat || slope.abs() < 1e-2 || normal.dot(out).abs() < 1e-6 {
            return Ok(());
        }
        let side = normal.dot(out).signum();
        let above = side * normal.dot(answer.vector(3) - a);
        let size = target.abs().max_element() + (b - a).length() + (c - a).length();
        ensure(above >= 0.0, || {
            format!("it starts {above:e} behind the plane")
        })?;
        ensure(above <= 32.0 * EPSILON * size, || {
            format!("it starts {above:e} off, of size {size}")
        })?;
        let facing = answer.vector(6).dot(normal) * slope;
        ensure(facing < 0.0, || {
            "the normal faces away from the viewer".to_owned()
        })
    };
    Trial::within(Piece::Leaving, scene.clone()).holds(arguments, call, judge);
}
