//! Traversal alone, judged by the f64 oracle: the probe kernel's hits of 200,000 rays a scene, the kinds that renderers get
//! wrong among them: at vertices and edges, along axes, from among the triangles, from afar.
//!
//! A hit is right if it is the oracle's, or as near as the oracle's (a neighbour's). It is excused if the oracle finds that
//! triangle for a ray that lies beside ours by no more than f32 can tell apart: outlines may differ by that. Distance and place in the
//! triangle are never excused.

mod support;

use glam::{DVec3, Vec3};
use raytree::{Bvh, Device, Feature, Preset, ProgramFeatures, Scene, model::AlphaMode};
use raytree_gpu::{
    probe,
    types::{ProbeHit, ProbeRay},
};
use raytree_oracle::{Oracle, Shading};
use support::{random::Random, scenes::Build};

/// Rays of each of the six kinds.
const RAYS: usize = 35_000;

/// One rounding.
const EPSILON: f64 = f32::EPSILON as f64 / 2.0;

/// Roundings that a hit may be off by. The corners relative to the ray's origin, at distance D, are rounded (1 each), then the
/// edges and their cross product (4), which tilts a triangle of size s by eps D/s and so moves it by eps D where it is hit; then
/// two scalar products and a quotient (3 each, 1). The place in the triangle takes as many.
const ROUNDINGS: f64 = 16.0;

/// .. and the outline of a triangle: edge functions are differences of products of distances, so an edge of length s
/// seems to lie eps D^2/s beside where it is. (For both triangles that share it, so nothing slips through.)
const ROUNDINGS_OF_OUTLINE: f64 = 16.0;

/// The corners of a triangle.
#[derive(Clone, Copy)]
struct Corners([DVec3; 3]);

/// Where a ray meets a triangle's plane.
#[derive(Clone, Copy, Debug)]
struct Place {
    t: f64,
    u: f64,
    v: f64,
}

impl Corners {
    fn edges(&self) -> [DVec3; 2] {
        let [a, b, c] = self.0;
        [b - a, c - a]
    }

    fn lengths(&self) -> [f64; 3] {
        let [a, b, c] = self.0;
        [a.distance(b), b.distance(c), c.distance(a)]
    }

    /// The longest edge over the height above it: at least 1.15.
    fn slenderness(&self) -> f64 {
        let [e1, e2] = self.edges();
        self.lengths().into_iter().fold(0.0, f64::max).powi(2) / e1.cross(e2).length()
    }

    fn farthest(&self, origin: DVec3) -> f64 {
        self.0.into_iter().map(|corner| corner.distance(origin)).fold(0.0, f64::max)
    }

    fn at(&self, u: f64, v: f64) -> DVec3 {
        let [e1, e2] = self.edges();
        self.0[0] + u * e1 + v * e2
    }

    /// By Cramer's rule, in f64 and whether inside or not.
    fn meet(&self, origin: DVec3, direction: DVec3) -> Place {
        let [e1, e2] = self.edges();
        let p = direction.cross(e2);
        let s = origin - self.0[0];
        let q = s.cross(e1);
        let determinant = e1.dot(p);
        Place { t: e2.dot(q) / determinant, u: s.dot(p) / determinant, v: direction.dot(q) / determinant }
    }
}

fn start(ray: &ProbeRay) -> (DVec3, DVec3) {
    (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3())
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    /// The oracle's hit, or another triangle's at the same distance.
    Same,
    /// The hit of a ray beside this one.
    Beside,
    /// Anything else.
    Wrong,
}

/// A scene with what judges it.
struct Judge<'s> {
    scene: &'s Scene,
    oracle: Oracle<'s>,
}

impl<'s> Judge<'s> {
    fn new(scene: &'s Scene) -> Self {
        Self { scene, oracle: Oracle::new(scene) }
    }

    fn corners(&self, triangle: usize) -> Corners {
        let geometry = &self.scene.geometry;
        Corners(geometry.triangles[triangle].vertices.map(|vertex| geometry.positions[vertex as usize].as_dvec3()))
    }

    /// Triangle and distance of the oracle's hit of the ray moved by `shift`.
    fn oracle_hit(&self, ray: &ProbeRay, shift: DVec3) -> Option<(usize, f64)> {
        let (origin, direction) = start(ray);
        let hit = self.oracle.closest_hit((origin + shift).to_array(), direction.to_array(), Shading::Pbr)?;
        Some((hit.triangle, hit.t))
    }

    /// What the least rounding may do to a hit of this triangle, a length.
    fn unit(&self, ray: &ProbeRay, triangle: usize) -> f64 {
        let (origin, direction) = start(ray);
        let corners = self.corners(triangle);
        let [e1, e2] = corners.edges();
        let cosine = e1.cross(e2).normalize().dot(direction.normalize()).abs();
        EPSILON * corners.farthest(origin) * corners.slenderness() / cosine
    }

    /// How far the device's hit is off where the ray meets that triangle, in roundings: distance, and place in the triangle.
    fn off(&self, ray: &ProbeRay, hit: &ProbeHit) -> (f64, f64) {
        let (origin, direction) = start(ray);
        let corners = self.corners(hit.triangle as usize);
        let exact = corners.meet(origin, direction);
        let unit = self.unit(ray, hit.triangle as usize);
        // The device's place is clamped to the triangle.
        let u = exact.u.clamp(0.0, 1.0);
        let v = exact.v.clamp(0.0, 1.0 - u);
        let apart = corners.at(u, v).distance(corners.at(f64::from(hit.u), f64::from(hit.v)));
        ((f64::from(hit.t) - exact.t).abs() * direction.length() / unit, apart / unit)
    }

    /// How far beside where it is a triangle's outline may seem to lie. At a sharp corner two outlines meet under a small angle.
    fn blur(&self, ray: &ProbeRay, triangle: usize) -> f64 {
        let corners = self.corners(triangle);
        let distance = corners.farthest(start(ray).0);
        let shortest = corners.lengths().into_iter().fold(f64::INFINITY, f64::min);
        ROUNDINGS_OF_OUTLINE * EPSILON * distance * (1.0 + distance / shortest) * corners.slenderness()
    }

    fn judge(&self, ray: &ProbeRay, hit: &ProbeHit) -> Verdict {
        let theirs = self.oracle_hit(ray, DVec3::ZERO);
        let ours = (hit.triangle != u32::MAX).then_some(hit.triangle as usize);
        if ours == theirs.map(|(triangle, _)| triangle) {
            return if ours.is_none() || self.has_right_values(ray, hit) { Verdict::Same } else { Verdict::Wrong };
        }
        if ours.is_some() && !self.has_right_values(ray, hit) {
            return Verdict::Wrong;
        }
        // A triangle as near as the nearest is as good: at edges, and where surfaces coincide.
        let as_near = |(triangle, t): (usize, f64)| {
            ours.is_some_and(|ours| {
                let unit = self.unit(ray, ours) + self.unit(ray, triangle);
                (f64::from(hit.t) - t).abs() * start(ray).1.length() <= ROUNDINGS * unit
            })
        };
        let meets_ours = |shift| match (ours, self.oracle_hit(ray, shift)) {
            (Some(ours), Some(theirs)) => ours == theirs.0 || as_near(theirs),
            (ours, theirs) => ours.is_none() && theirs.is_none(),
        };
        if meets_ours(DVec3::ZERO) {
            return Verdict::Same;
        }
        let triangles = ours.into_iter().chain(theirs.map(|(triangle, _)| triangle));
        let blur = triangles.map(|triangle| self.blur(ray, triangle)).fold(0.0, f64::max);
        let towards_ours = self.shifts_into(ray, hit).filter(|shift| shift.length() <= blur);
        let around = |centre| ring(ray, blur).map(move |shift| centre + shift);
        let beside = towards_ours.chain([DVec3::ZERO]).any(|centre| meets_ours(centre) || around(centre).any(meets_ours));
        if beside { Verdict::Beside } else { Verdict::Wrong }
    }

    fn has_right_values(&self, ray: &ProbeRay, hit: &ProbeHit) -> bool {
        let (t, place) = self.off(ray, hit);
        let inside = hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 2.0 * f32::EPSILON;
        inside && t <= ROUNDINGS && place <= ROUNDINGS
    }

    /// How to move the ray so that it meets the device's triangle not far from where the device says.
    fn shifts_into(&self, ray: &ProbeRay, hit: &ProbeHit) -> impl Iterator<Item = DVec3> {
        let (origin, direction) = start(ray);
        let direction = direction.normalize();
        let inwards = (hit.triangle != u32::MAX).then(|| {
            let corners = self.corners(hit.triangle as usize);
            let (claimed, middle) = (corners.at(f64::from(hit.u), f64::from(hit.v)), corners.at(1.0 / 3.0, 1.0 / 3.0));
            [1e-6, 1e-4, 1e-3, 1e-2, 0.1, 0.5].map(|share| {
                let beside = claimed.lerp(middle, share) - origin;
                beside - beside.dot(direction) * direction
            })
        });
        inwards.into_iter().flatten()
    }

    /// The same for a shadow ray: whether there is anything up to its end.
    fn judge_shadow(&self, ray: &ProbeRay, hit: &ProbeHit) -> Verdict {
        let is_hit = hit.triangle != u32::MAX;
        let end = f64::from(ray.t_max);
        let (origin, direction) = start(ray);
        let occluded = |shift, end| self.oracle.occluded(DVec3::to_array(&(origin + shift)), direction.to_array(), end);
        if occluded(DVec3::ZERO, end) == is_hit {
            return Verdict::Same;
        }
        let theirs = self.oracle_hit(ray, DVec3::ZERO).map(|(triangle, _)| triangle);
        let triangles = theirs.into_iter().chain(is_hit.then_some(hit.triangle as usize));
        let blur = triangles.map(|triangle| self.blur(ray, triangle)).fold(0.0, f64::max);
        let ends = [end - blur, end, end + blur];
        let shifts = ring(ray, blur).chain(self.shifts_into(ray, hit).filter(|shift| shift.length() <= blur));
        let beside = shifts.chain([DVec3::ZERO]).any(|shift| ends.into_iter().any(|end| occluded(shift, end) == is_hit));
        if beside { Verdict::Beside } else { Verdict::Wrong }
    }
}

/// Rays around a ray: how to move it.
fn ring(ray: &ProbeRay, blur: f64) -> impl Iterator<Item = DVec3> {
    let (right, up) = start(ray).1.normalize().any_orthonormal_pair();
    [0.01, 0.1, 0.3, 1.0].into_iter().flat_map(move |radius| {
        (0..12).map(move |k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 12.0).sin_cos();
            blur * radius * (cos * right + sin * up)
        })
    })
}

fn ray(origin: Vec3, direction: Vec3) -> ProbeRay {
    ProbeRay { origin: origin.to_array(), t_max: 1e30, direction: direction.to_array(), shadow: 0 }
}

fn bounds(scene: &Scene) -> (Vec3, Vec3) {
    let (min, max) = scene.geometry.bounds().expect("there are triangles");
    (min.as_vec3(), max.as_vec3())
}

/// An origin outside, or among the triangles.
fn origin(scene: &Scene, random: &mut Random) -> Vec3 {
    let (min, max) = bounds(scene);
    if random.below(2) == 0 { (min + max) / 2.0 + 2.0 * random.direction() } else { random.within(min, max) }
}

/// Rays from anywhere to anywhere; with a `distance`, from that far away.
fn random_rays(scene: &Scene, random: &mut Random, distance: Option<f32>) -> Vec<ProbeRay> {
    let (min, max) = bounds(scene);
    let mut one = || {
        let from = distance.map(|distance| (min + max) / 2.0 + distance * random.direction());
        let origin = from.unwrap_or_else(|| origin(scene, random));
        ray(origin, (random.within(min, max) - origin).normalize_or(Vec3::X))
    };
    (0..RAYS).map(|_| one()).collect()
}

/// A corner of a triangle, or the middle of one of its edges.
fn target(scene: &Scene, random: &mut Random, edge: bool) -> Vec3 {
    let geometry = &scene.geometry;
    let triangle = geometry.triangles[random.below(geometry.triangles.len())];
    let corner = random.below(3);
    let [a, b] = [corner, (corner + 1) % 3].map(|k| geometry.positions[triangle.vertices[k] as usize]);
    if edge { (a + b) / 2.0 } else { a }
}

/// Rays at corners, or at the middles of edges. Their directions are not normalised, which would lead them past.
fn aimed_rays(scene: &Scene, random: &mut Random, edge: bool) -> Vec<ProbeRay> {
    let mut one = || {
        let target = target(scene, random, edge);
        let origin = origin(scene, random);
        ray(origin, if origin == target { Vec3::X } else { target - origin })
    };
    (0..RAYS).map(|_| one()).collect()
}

/// Rays along an axis, half of them exactly through a corner: two components are zero, and boxes are grazed.
fn axis_rays(scene: &Scene, random: &mut Random) -> Vec<ProbeRay> {
    let (min, max) = bounds(scene);
    let mut one = |index: usize| {
        let axis = random.below(3);
        let sign = if random.below(2) == 0 { -1.0 } else { 1.0 };
        let mut origin = if index.is_multiple_of(2) { target(scene, random, false) } else { random.within(min, max) };
        origin[axis] = if random.below(2) == 0 { -3.0 * sign } else { random.within(min, max)[axis] };
        // Both zeros: their reciprocals differ in sign.
        let mut direction = if random.below(2) == 0 { Vec3::ZERO } else { -Vec3::ZERO };
        direction[axis] = sign;
        ray(origin, direction)
    };
    (0..RAYS).map(&mut one).collect()
}

/// Shadow rays that end anywhere before or behind the first thing on their way.
fn shadow_rays(judge: &Judge<'_>, random: &mut Random) -> Vec<ProbeRay> {
    let mut rays = random_rays(judge.scene, random, None);
    for ray in &mut rays {
        let first = judge.oracle_hit(ray, DVec3::ZERO).map_or(1.0, |(_, t)| t);
        ray.t_max = (2.0 * random.unit() * first) as f32;
        ray.shadow = 1;
    }
    rays
}

fn trace(device: &Device, scene: &Scene, bvh: &Bvh, rays: &[ProbeRay]) -> Vec<ProbeHit> {
    let features = ProgramFeatures::default().with(Feature::Culling, true);
    probe(device, scene, bvh, features, rays).unwrap_or_else(|error| panic!("{error}"))
}

/// How many hits are beside an outline, and descriptions of those that are wrong.
fn judge_all(kind: &str, judge: &Judge<'_>, rays: &[ProbeRay], hits: &[ProbeHit]) -> (usize, Vec<String>) {
    let started = std::time::Instant::now();
    let verdict = |(ray, hit): (&ProbeRay, &ProbeHit)| {
        if ray.shadow == 0 { judge.judge(ray, hit) } else { judge.judge_shadow(ray, hit) }
    };
    let pairs: Vec<_> = rays.iter().zip(hits).collect();
    let verdicts: Vec<Verdict> = std::thread::scope(|scope| {
        let halves = pairs.chunks(pairs.len().div_ceil(2));
        let workers: Vec<_> =
            halves.map(|half| scope.spawn(move || half.iter().map(|&pair| verdict(pair)).collect::<Vec<_>>())).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a judge does not panic")).collect()
    });
    let beside = verdicts.iter().filter(|verdict| **verdict == Verdict::Beside).count();
    let wrong: Vec<String> = (pairs.iter().zip(&verdicts))
        .filter(|(_, verdict)| **verdict == Verdict::Wrong)
        .map(|((ray, hit), _)| format!("{kind}: {ray:?} gave {hit:?}, oracle {:?}", judge.oracle_hit(ray, DVec3::ZERO)))
        .collect();
    println!("{:?}", started.elapsed());
    println!("  {kind:8}: {} rays, {beside} beside an outline, {} wrong", rays.len(), wrong.len());
    (beside, wrong)
}

/// `beside_share`: of the random rays, how many may hit beside an outline.
fn judge_scene(name: &str, mut scene: Scene, beside_share: f64) {
    let Some(device) = support::device() else { return };
    // Masks are for who shades a hit.
    scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Opaque);
    let bvh = raytree::build_bvh(&scene, Preset::Balanced).unwrap_or_else(|error| panic!("{error}"));
    let judge = Judge::new(&scene);
    let mut random = Random::new(7);
    println!("{name}, {} triangles", scene.geometry.triangles.len());

    let kinds = [
        ("random", random_rays(&scene, &mut random, None)),
        ("far", random_rays(&scene, &mut random, Some(10.0))),
        ("vertices", aimed_rays(&scene, &mut random, false)),
        ("edges", aimed_rays(&scene, &mut random, true)),
        ("axes", axis_rays(&scene, &mut random)),
        ("shadow", shadow_rays(&judge, &mut random)),
    ];
    let mut wrong = Vec::new();
    let mut worst = (0.0_f64, 0.0_f64);
    for (kind, rays) in kinds {
        let hits = trace(device, &scene, &bvh, &rays);
        let (beside, faults) = judge_all(kind, &judge, &rays, &hits);
        wrong.extend(faults);
        let met: Vec<_> = rays.iter().zip(&hits).filter(|(_, hit)| hit.triangle != u32::MAX).collect();
        assert!(met.len() > RAYS / 20, "{name}, {kind}: only {} rays hit anything", met.len());
        if matches!(kind, "random" | "shadow") {
            assert!(beside as f64 <= beside_share * RAYS as f64, "{name}, {kind}: {beside} of {RAYS} beside an outline");
        }
        for (ray, hit) in met.into_iter().filter(|(ray, _)| ray.shadow == 0) {
            let off = judge.off(ray, hit);
            worst = (worst.0.max(off.0), worst.1.max(off.1));
        }
    }
    println!("  distance off by up to {:.2} roundings, place in the triangle by {:.2}", worst.0, worst.1);
    assert!(wrong.is_empty(), "{name}: {} wrong:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

fn own(name: &str) -> Scene {
    support::import(&support::root().join("assets").join(name))
}

#[test]
fn hits_of_everything() {
    judge_scene("everything", own("everything.glb"), 1e-3);
}

#[test]
fn hits_of_a_book() {
    judge_scene("book", own("book.glb"), 1e-3);
}

#[test]
fn hits_of_mirrors() {
    judge_scene("facing-mirrors", own("facing-mirrors.glb"), 1e-3);
}

/// Nothing but outlines, many of them needles.
#[test]
fn hits_of_a_soup() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(raytree::model::Material::default());
    build.soup(20_000, &mut Random::new(3), material);
    judge_scene("soup", build.0, 1e-2);
}

/// From inside a closed ball every ray hits, also one that leaves by a corner or by the middle of an edge.
#[test]
fn nothing_leaks_out_of_a_ball() {
    let Some(device) = support::device() else { return };
    let mut random = Random::new(11);
    let mut leaks = Vec::new();
    for (radius, levels) in [(1.0, 6), (1.0, 3), (0.01, 5)] {
        let mut build = Build::before([0.0; 3]);
        let material = build.material(raytree::model::Material { double_sided: true, ..Default::default() });
        build.ball(Vec3::new(0.3, -0.2, 0.1), radius, levels, material);
        let scene = build.0;
        let bvh = raytree::build_bvh(&scene, Preset::Balanced).unwrap_or_else(|error| panic!("{error}"));
        let mut one = |index: usize| {
            let origin = Vec3::new(0.3, -0.2, 0.1) + 0.9 * radius * random.unit() as f32 * random.direction();
            let target = target(&scene, &mut random, index.is_multiple_of(2));
            ray(origin, if index.is_multiple_of(3) { target - origin } else { (target - origin).normalize() })
        };
        let rays: Vec<ProbeRay> = (0..4 * RAYS).map(&mut one).collect();
        let hits = trace(device, &scene, &bvh, &rays);
        let leaking = rays.iter().zip(&hits).filter(|(_, hit)| hit.triangle == u32::MAX);
        leaks.extend(leaking.map(|(ray, _)| format!("radius {radius}, level {levels}: {ray:?}")));
    }
    assert!(leaks.is_empty(), "{} leaks:\n{}", leaks.len(), leaks[..leaks.len().min(20)].join("\n"));
}
