//! The oracle's word on rays that leave a surface.
//!
//! A ray is right if it hits what the oracle's ray hits that starts, past the triangle that it leaves, in the exact point in
//! which the first ray meets the plane of the triangle that the device says it hit. It is excused if a ray of the oracle does so that
//! starts within the bound of the device's error from there, on the facet or above it, and passes outlines by the bound of
//! theirs. A start on the wrong side, beyond the facet's edges or farther away than the bound is never excused.

use glam::{DVec3, Vec3};
use raytree_gpu::types::{LEAVING_ABOUT_NORMAL, LEAVING_MIRRORED, SecondaryHit, SecondaryRay};
use raytree_oracle::{Hit, Oracle, Shading};
use raytree_scene::model::Scene;

/// One rounding.
const EPSILON: f64 = f32::EPSILON as f64 / 2.0;

/// Roundings on the way to barycentric coordinates: two edges and the way to a corner (1 each), cross and scalar products (3
/// and 3), of which numerator and denominator have one each, and the quotient; as in `tests/hits.rs`.
const ROUNDINGS_OF_PLACE: f64 = 16.0;

/// .. and of a corner seen along the ray: relative to the origin (1), sheared by a rounded quotient (3); as there.
const ROUNDINGS_OF_OUTLINE: f64 = 8.0;

/// How much better a point along the ray has to be known before this judge holds the renderer to it. The renderer itself
/// takes it where it is 8 times better (`shaders/surface.wgsl`).
const CLEARLY_BETTER: f64 = 32.0;

/// .. close to an edge, where the renderer takes it where it is 1024 times better: beyond the edge there may be nothing.
const BETTER_AT_AN_EDGE: f64 = 4096.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// What the oracle says.
    Same,
    /// What it says of a ray that starts, or an outline that lies, where f32 can't tell them apart.
    Beside,
    /// Something is hit that is not there, or not there yet.
    FalseHit,
    /// What is there is passed by.
    Missed,
}

/// What was found of all rays.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub rays: u64,
    /// First rays that hit, and so second ones.
    pub pairs: usize,
    pub beside: usize,
    pub false_hits: usize,
    pub first_false: Option<String>,
    pub missed: usize,
    pub first_missed: Option<String>,
    pub wrong_side: usize,
    pub first_wrong_side: Option<String>,
    /// The farthest start of a second ray from the exact point, in bounds of its error.
    pub start: f64,
    pub farthest_start: Option<String>,
}

impl Tally {
    /// A count as a figure: none where no ray left anything.
    pub(super) fn of_pairs(&self, count: usize) -> f64 {
        if self.pairs == 0 {
            f64::NAN
        } else {
            count as f64
        }
    }

    fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.pairs += other.pairs;
        self.beside += other.beside;
        self.false_hits += other.false_hits;
        self.missed += other.missed;
        self.wrong_side += other.wrong_side;
        self.first_false = self.first_false.take().or(other.first_false);
        self.first_missed = self.first_missed.take().or(other.first_missed);
        self.first_wrong_side = self.first_wrong_side.take().or(other.first_wrong_side);
        if is_farther(other.start, self.start) {
            self.start = other.start;
            self.farthest_start = other.farthest_start;
        }
    }
}

/// NaN is farther than everything, and stays.
fn is_farther(start: f64, other: f64) -> bool {
    !other.is_nan() && (start.is_nan() || start > other)
}

pub(super) struct Judge<'s> {
    scene: &'s Scene,
    oracle: Oracle<'s>,
}

/// The triangle that a ray leaves, and where.
struct Departure {
    triangle: usize,
    /// Where the first ray meets the triangle's plane, exactly.
    point: DVec3,
    /// Of the plane, unit, on the side to which the second ray leaves.
    normal: DVec3,
    /// How far from there the second ray may start.
    bound: f64,
    /// How far off the plane a ray of the oracle starts: some roundings of f64 of what the plane's equation sums up.
    lift: f64,
}

impl<'s> Judge<'s> {
    pub(super) fn new(scene: &'s Scene) -> Self {
        Self {
            scene,
            oracle: Oracle::new(scene),
        }
    }

    pub(super) fn judge_all(&self, rays: &[SecondaryRay], hits: &[SecondaryHit]) -> Tally {
        let half = rays.len().div_ceil(2).max(1);
        let parts = rays.chunks(half).zip(hits.chunks(half));
        std::thread::scope(|scope| {
            let workers: Vec<_> = parts
                .map(|(rays, hits)| {
                    scope.spawn(move || {
                        let mut tally = Tally::default();
                        for (ray, hit) in rays.iter().zip(hits) {
                            self.judge(ray, hit, &mut tally);
                        }
                        tally
                    })
                })
                .collect();
            let mut tally = Tally::default();
            for worker in workers {
                match worker.join() {
                    Ok(part) => tally.add(part),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            tally
        })
    }

    fn judge(&self, ray: &SecondaryRay, hit: &SecondaryHit, tally: &mut Tally) {
        tally.rays += 1;
        if hit.triangle == u32::MAX {
            return;
        }
        tally.rays += 1;
        tally.pairs += 1;
        let departure = self.departure(ray, hit);
        let start = vec(hit.origin).distance(departure.point) / departure.bound;
        if is_farther(start, tally.start) {
            tally.start = start;
            tally.farthest_start = Some(format!("{ray:?} gave {hit:?}"));
        }
        if is_on_the_wrong_side(ray, &departure) {
            tally.wrong_side += 1;
            tally
                .first_wrong_side
                .get_or_insert_with(|| format!("{ray:?} gave {hit:?}"));
        }
        let point = closest_of_triangle(self.corners(departure.triangle), departure.point);
        let theirs = self.oracle_hit(&departure, Self::start(&departure, point), hit);
        let describe = || {
            let theirs = theirs.map(|hit| (hit.triangle, hit.t));
            format!(
                "{ray:?} gave {hit:?}, oracle {theirs:?}, from {}",
                departure.point
            )
        };
        match self.verdict(&departure, hit, theirs) {
            Verdict::Same => {}
            Verdict::Beside => tally.beside += 1,
            Verdict::FalseHit => {
                tally.false_hits += 1;
                tally.first_false.get_or_insert_with(describe);
            }
            Verdict::Missed => {
                tally.missed += 1;
                tally.first_missed.get_or_insert_with(describe);
            }
        }
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        let geometry = &self.scene.geometry;
        geometry.triangles[triangle]
            .vertices
            .map(|vertex| geometry.positions[vertex as usize].as_dvec3())
    }

    fn departure(&self, ray: &SecondaryRay, hit: &SecondaryHit) -> Departure {
        let triangle = hit.triangle as usize;
        let corners = self.corners(triangle);
        let [a, b, c] = corners;
        let front = (b - a).cross(c - a).normalize();
        let (origin, direction) = (vec(ray.origin), vec(ray.direction));
        let point = origin + front.dot(a - origin) / front.dot(direction) * direction;
        let towards = front.dot(vec(hit.direction)) >= 0.0;
        Departure {
            triangle,
            point,
            normal: if towards { front } else { -front },
            bound: start_bound(corners, front, origin, direction, point),
            lift: 1e-14
                * front
                    .abs()
                    .dot(point.abs() + (a - origin).abs() + (a - point).abs()),
        }
    }

    /// Where the oracle's ray starts that leaves at `place`: off the plane by some roundings of f64.
    fn start(departure: &Departure, place: DVec3) -> DVec3 {
        place + departure.lift * departure.normal
    }

    fn oracle_hit(&self, departure: &Departure, start: DVec3, hit: &SecondaryHit) -> Option<Hit> {
        let direction = vec(hit.direction).to_array();
        self.oracle.closest_hit_leaving(
            departure.triangle,
            start.to_array(),
            direction,
            Shading::Pbr,
        )
    }

    fn verdict(&self, departure: &Departure, hit: &SecondaryHit, theirs: Option<Hit>) -> Verdict {
        let ours = (hit.next_triangle != u32::MAX).then_some(hit.next_triangle as usize);
        let theirs_triangle = theirs.map(|hit| hit.triangle);
        if ours == theirs_triangle {
            return Verdict::Same;
        }
        let like_ours = |start| match (ours, self.oracle_hit(departure, start, hit)) {
            // Where several triangles meet, and at outlines, one as near as the other is as good.
            (Some(ours), Some(theirs)) => {
                let slack =
                    departure.bound + self.slack(ours, hit) + self.slack(theirs.triangle, hit);
                ours == theirs.triangle || (f64::from(hit.t) - theirs.t).abs() <= slack
            }
            (ours, theirs) => ours.is_none() && theirs.is_none(),
        };
        let blur = [ours, theirs_triangle]
            .into_iter()
            .flatten()
            .map(|triangle| self.blur(triangle, vec(hit.origin)))
            .fold(0.0, f64::max);
        let starts = self.starts(departure, hit);
        let passes_outlines = |&start: &DVec3| {
            self.shifts(departure, hit, start, blur)
                .any(|shift| self.is_free(start, shift) && like_ours(start + shift))
        };
        // Outlines as seen from the likeliest places alone: what is not excused has to be tried in full.
        let excused = starts.iter().any(|&start| like_ours(start))
            || starts.iter().take(3).any(passes_outlines);
        if excused {
            Verdict::Beside
        } else if ours.is_some() && theirs.is_none_or(|theirs| f64::from(hit.t) < theirs.t) {
            Verdict::FalseHit
        } else {
            Verdict::Missed
        }
    }

    /// How far off the second ray's hit of this triangle may be along the ray.
    fn slack(&self, triangle: usize, hit: &SecondaryHit) -> f64 {
        let corners = self.corners(triangle);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let cosine = normal.dot(vec(hit.direction)).abs();
        let origin = vec(hit.origin);
        let farthest = corners
            .map(|corner| corner.distance(origin))
            .into_iter()
            .fold(0.0, f64::max);
        ROUNDINGS_OF_PLACE * EPSILON * farthest * conditioning(corners) / cosine
    }

    /// Whether nothing lies between the start and where it is moved to: an outline may seem to lie elsewhere, but a ray that
    /// stands before a wall does not get behind it.
    fn is_free(&self, start: DVec3, shift: DVec3) -> bool {
        !self
            .oracle
            .occluded(start.to_array(), shift.to_array(), 1.0)
    }

    /// How far beside where it is an outline of this triangle may seem to lie.
    fn blur(&self, triangle: usize, origin: DVec3) -> f64 {
        let distances = self.corners(triangle).map(|corner| corner.distance(origin));
        ROUNDINGS_OF_OUTLINE * EPSILON * distances.into_iter().fold(0.0, f64::max)
    }

    /// Where else the ray may start: on the facet within the bound, below the device's own start too, and at the device's own
    /// height above it; the likeliest first. Never beyond the facet's edges: a neighbour there would be behind the ray.
    fn starts(&self, departure: &Departure, hit: &SecondaryHit) -> Vec<DVec3> {
        let &Departure {
            point,
            normal,
            bound,
            ..
        } = departure;
        let corners = self.corners(departure.triangle);
        let device = vec(hit.origin);
        let height = (device - point).dot(normal);
        let below = closest_of_triangle(corners, device - height * normal);
        let (right, up) = normal.any_orthonormal_pair();
        let ring = [0.1, 0.4, 1.0].into_iter().flat_map(|radius| {
            (0..8).map(move |k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 8.0).sin_cos();
                closest_of_triangle(corners, point + bound * radius * (cos * right + sin * up))
            })
        });
        let lifted = (height >= 0.0).then_some(below + height * normal);
        let in_plane = [below, closest_of_triangle(corners, point)]
            .into_iter()
            .chain(ring)
            .map(|place| Self::start(departure, place));
        let mut starts: Vec<DVec3> = lifted.into_iter().chain(in_plane).collect();
        starts.retain(|start| start.distance(point) <= 1.001 * bound);
        starts
    }

    /// How to move a ray past an outline, never down into its facet: around it, and to the place where it is closest to the
    /// triangle that the device hit.
    fn shifts(
        &self,
        departure: &Departure,
        hit: &SecondaryHit,
        start: DVec3,
        blur: f64,
    ) -> impl Iterator<Item = DVec3> {
        let direction = vec(hit.direction).normalize();
        let normal = departure.normal;
        let (right, up) = direction.any_orthonormal_pair();
        let ring = [0.1, 0.5, 1.0].into_iter().flat_map(move |radius| {
            (0..8).map(move |k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 8.0).sin_cos();
                blur * radius * (cos * right + sin * up)
            })
        });
        let towards: Vec<DVec3> = if hit.next_triangle == u32::MAX {
            Vec::new()
        } else {
            shifts_into(self.corners(hit.next_triangle as usize), start, direction)
                .into_iter()
                .filter(|shift| shift.length() <= blur)
                .collect()
        };
        towards
            .into_iter()
            .chain(ring)
            .map(move |shift| shift - shift.dot(normal).min(0.0) * normal)
    }
}

fn vec(xyz: [f32; 3]) -> DVec3 {
    Vec3::from(xyz).as_dvec3()
}

fn is_on_the_wrong_side(ray: &SecondaryRay, departure: &Departure) -> bool {
    // Towards the side that the first ray comes from, by the exact plane.
    let towards = -departure.normal.dot(vec(ray.direction)).signum();
    let wanted = match ray.leaving {
        LEAVING_MIRRORED => 1.0,
        LEAVING_ABOUT_NORMAL => f64::from(ray.next[2].signum()),
        _ => return false,
    };
    // departure.normal is on the side that the second ray leaves to.
    towards * wanted < 0.0
}

/// How far from the exact point a ray may start: the error of the hit point, and twice the bound of its distance from the plane,
/// by which it is moved.
///
/// The point is made of barycentric coordinates, whose error is that of a quotient of triple products, worse the more alike the
/// directions of the two edges that they count along: those that meet opposite to the longest. Close to
/// an edge it is moved inwards by some of what rounding may do. Or it is taken along the ray,
/// where that is clearly better: its error is that of the two sums that the distance is a quotient of, and of the way there.
fn start_bound(
    corners: [DVec3; 3],
    front: DVec3,
    origin: DVec3,
    direction: DVec3,
    point: DVec3,
) -> f64 {
    let sum = |v: DVec3| v.abs().element_sum();
    let anchor = opposite_to_longest(corners);
    let [e1, e2] = [1, 2].map(|k| corners[(anchor + k) % 3] - corners[anchor]);
    let cosine = front.dot(direction.normalize()).abs();
    let farthest = corners
        .map(|corner| corner.distance(origin))
        .into_iter()
        .fold(0.0, f64::max);

    let rounding = EPSILON * (2.0 * sum(point) + 4.0 * (sum(e1) + sum(e2)));
    // Twice: along the normal it is moved by as much as it may be off, and by what outlines may be off.
    let outline = ROUNDINGS_OF_OUTLINE * EPSILON * e1.distance(e2);
    let mut by_coordinates = ROUNDINGS_OF_PLACE * EPSILON * farthest * conditioning(corners)
        / cosine
        + 3.0 * rounding
        + 1.5 * outline;
    let reach = EPSILON * (6.0 * corners[anchor].abs() + 12.0 * (e1.abs() + e2.abs())).length();
    let close_to_edge = distance_to_edges(corners, point) < 1.1 * reach + by_coordinates;
    if close_to_edge {
        by_coordinates += 11.0 * reach;
    }
    let terms = |from: DVec3| (front.abs() * (corners[anchor] - from).abs()).element_sum();
    let along_ray = EPSILON
        * (8.0 * (sum(point - origin) + sum(point))
            + ROUNDINGS_OF_PLACE * (terms(origin) + terms(point)) / cosine);
    let clearly_better = if close_to_edge {
        BETTER_AT_AN_EDGE
    } else {
        CLEARLY_BETTER
    };
    if clearly_better * along_ray < rounding {
        let risen = 1e-4 * distance_to_edges(corners, point);
        along_ray + (outline - risen).max(0.0)
    } else {
        by_coordinates
    }
}

/// The point of a triangle that is closest to a point of its plane.
fn closest_of_triangle(corners: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)]
        .into_iter()
        .all(|(p, q)| (q - p).cross(point - p).dot(normal) >= 0.0);
    if inside {
        return point;
    }
    let closest_of_edge = |(p, q): (DVec3, DVec3)| {
        let share = (point - p).dot(q - p) / (q - p).length_squared().max(f64::MIN_POSITIVE);
        p.lerp(q, share.clamp(0.0, 1.0))
    };
    let [first, second, third] = [(a, b), (b, c), (c, a)].map(closest_of_edge);
    let closer = |p: DVec3, q: DVec3| {
        if q.distance_squared(point) < p.distance_squared(point) {
            q
        } else {
            p
        }
    };
    closer(closer(first, second), third)
}

/// How far inside of a triangle a point of its plane is; below 0 outside.
fn distance_to_edges(corners: [DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).normalize();
    [(a, b), (b, c), (c, a)]
        .map(|(p, q)| normal.cross((q - p).normalize()).dot(point - p))
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// How much of the digits of the cross product of the two shorter edges is lost: 1 where they are at right angles.
fn conditioning(corners: [DVec3; 3]) -> f64 {
    let anchor = opposite_to_longest(corners);
    let [e1, e2] = [1, 2].map(|k| corners[(anchor + k) % 3] - corners[anchor]);
    e1.length() * e2.length() / e1.cross(e2).length()
}

fn opposite_to_longest(corners: [DVec3; 3]) -> usize {
    let opposite = |k: usize| corners[(k + 1) % 3].distance_squared(corners[(k + 2) % 3]);
    (0..3).fold(0, |best, k| {
        if opposite(k) > opposite(best) {
            k
        } else {
            best
        }
    })
}

/// From the ray to where it is closest to a triangle, seen along it, and a little further in.
fn shifts_into(corners: [DVec3; 3], origin: DVec3, direction: DVec3) -> [DVec3; 5] {
    let across = |point: DVec3| (point - origin) - (point - origin).dot(direction) * direction;
    let [a, b, c] = corners.map(across);
    let nearest = [(a, b), (b, c), (c, a)].map(|(a, b)| {
        let share = -a.dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE);
        a.lerp(b, share.clamp(0.0, 1.0))
    });
    let edge = nearest.into_iter().fold(a, |best, at| {
        if at.length() < best.length() {
            at
        } else {
            best
        }
    });
    [1e-6, 1e-4, 1e-2, 0.1, 0.5].map(|share| edge.lerp((a + b + c) / 3.0, share))
}

#[cfg(test)]
#[path = "judge_tests.rs"]
mod tests;
