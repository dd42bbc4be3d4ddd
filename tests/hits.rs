//! Traversal alone, judged by the f64 oracle: the probe kernel's hits of a few hundred thousand rays a scene, the kind that
//! renderers get wrong among them: at vertices and at edges, along axes, from inside of things.
//!
//! A hit is right if it is the oracle's; or if it is the oracle's for a ray that lies beside ours by no more than f32
//! can tell apart, which is how silhouettes may differ. Nothing else is excused.

mod support;

use glam::{DVec3, Vec3};
use raytree::{Bvh, Device, Feature, Preset, ProgramFeatures, Scene, model::AlphaMode};
use raytree_gpu::{
    probe,
    types::{ProbeHit, ProbeRay},
};
use raytree_oracle::{Hit, Oracle, Shading};
use support::{random::Random, scenes::Build};

/// Rays of each of the five kinds.
const RAYS: usize = 50_000;

/// One rounding.
const EPSILON: f64 = f32::EPSILON as f64 / 2.0;

/// Roundings that a distance may be off by. It is a quotient of a triangle's normal with the ray's origin and direction: the
/// corners relative to the origin, at distance D, are rounded (1 each), then the edges' cross product (3), which tilts
/// a triangle of size s by eps D/s and so moves it by eps D where it is hit; then two scalar products (3 each).
const ROUNDINGS_T: f64 = 16.0;

/// .. and a place in the triangle (shaders/intersect.wgsl, `barycentrics`), by the same count.
const ROUNDINGS_PLACE: f64 = 16.0;

/// .. and the outline of a triangle: the edge functions are differences of products of distances, so the edge of length s
/// seems to lie eps D^2/s beside where it is. (For both triangles that share it, so nothing slips through.)
const ROUNDINGS_OUTLINE: f64 = 16.0;

/// Share of the rays with random origins and directions that may hit beside an outline.
const BESIDE_SHARE: f64 = 1e-3;

/// A scene with what judges it.
struct Judge<'s> {
    scene: &'s Scene,
    oracle: Oracle<'s>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    /// The oracle's hit, or another triangle's at the same distance.
    Same,
    /// The hit of a ray beside this one.
    Beside,
    Wrong,
}

/// How far values are off, in units of the roundings that they may be off by.
#[derive(Clone, Copy, Debug, Default)]
struct Off {
    t: f64,
    place: f64,
}

impl<'s> Judge<'s> {
    fn new(scene: &'s Scene) -> Self {
        Self { scene, oracle: Oracle::new(scene) }
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        let geometry = &self.scene.geometry;
        geometry.triangles[triangle].vertices.map(|vertex| geometry.positions[vertex as usize].as_dvec3())
    }

    fn hit(&self, ray: &ProbeRay, shift: DVec3) -> Option<Hit> {
        let origin = Vec3::from(ray.origin).as_dvec3() + shift;
        self.oracle.closest_hit(origin.to_array(), ray.direction.map(f64::from), Shading::Pbr)
    }

    /// How far the device's hit is off the oracle's of the same ray, given that they mean the same triangle.
    fn off(&self, ray: &ProbeRay, ours: &ProbeHit, theirs: &Hit) -> Off {
        let [a, b, c] = self.corners(theirs.triangle);
        let direction = Vec3::from(ray.direction).as_dvec3();
        let origin = Vec3::from(ray.origin).as_dvec3();
        let length = direction.length();
        let distance = [a, b, c].map(|corner| corner.distance(origin)).into_iter().fold(0.0, f64::max);
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        let slenderness = longest / cross.length();
        let cosine = (cross.normalize().dot(direction) / length).abs();
        let unit = EPSILON * distance * slenderness / cosine;
        let place = |u: f64, v: f64| u * (b - a) + v * (c - a);
        let apart = place(f64::from(ours.u), f64::from(ours.v)).distance(place(theirs.u, theirs.v));
        Off { t: (f64::from(ours.t) - theirs.t).abs() * length / unit, place: apart / unit }
    }

    /// Do they mean the same?
    fn agree(&self, ray: &ProbeRay, ours: &ProbeHit, theirs: Option<&Hit>) -> bool {
        let Some(theirs) = theirs else { return ours.triangle == u32::MAX };
        if ours.triangle == u32::MAX {
            return false;
        }
        let off = self.off(ray, ours, theirs);
        // At a corner or an edge any of the neighbours will do, each with coordinates of its own.
        off.t <= ROUNDINGS_T && (ours.triangle as usize != theirs.triangle || off.place <= ROUNDINGS_PLACE)
    }

    /// How far beside a ray outlines may seem to lie that the oracle or the device has met.
    fn blur(&self, ray: &ProbeRay, triangles: impl Iterator<Item = usize>) -> f64 {
        let origin = Vec3::from(ray.origin).as_dvec3();
        let blur_of = |triangle| {
            let [a, b, c] = self.corners(triangle);
            let distance = [a, b, c].map(|corner| corner.distance(origin)).into_iter().fold(0.0, f64::max);
            let shortest = a.distance(b).min(b.distance(c)).min(c.distance(a));
            ROUNDINGS_OUTLINE * EPSILON * distance * (1.0 + distance / shortest)
        };
        triangles.map(blur_of).fold(0.0, f64::max)
    }

    fn judge(&self, ray: &ProbeRay, ours: &ProbeHit) -> Verdict {
        let theirs = self.hit(ray, DVec3::ZERO);
        if self.agree(ray, ours, theirs.as_ref()) {
            return Verdict::Same;
        }
        let ours_triangle = (ours.triangle != u32::MAX).then_some(ours.triangle as usize);
        let blur = self.blur(ray, theirs.iter().map(|hit| hit.triangle).chain(ours_triangle));
        let beside = neighbours(ray, blur).any(|shift| self.agree(ray, ours, self.hit(ray, shift).as_ref()));
        if beside { Verdict::Beside } else { Verdict::Wrong }
    }

    /// The same for a shadow ray: whether there is anything up to its end.
    fn judge_shadow(&self, ray: &ProbeRay, ours: &ProbeHit) -> Verdict {
        let is_hit = ours.triangle != u32::MAX;
        let occluded = |shift: DVec3, end: f64| {
            let origin = Vec3::from(ray.origin).as_dvec3() + shift;
            self.oracle.occluded(origin.to_array(), ray.direction.map(f64::from), end)
        };
        let end = f64::from(ray.t_max);
        if occluded(DVec3::ZERO, end) == is_hit {
            return Verdict::Same;
        }
        let theirs = self.hit(ray, DVec3::ZERO).map(|hit| hit.triangle);
        let ours_triangle = is_hit.then_some(ours.triangle as usize);
        let blur = self.blur(ray, theirs.into_iter().chain(ours_triangle));
        let ends = [end, end * (1.0 - 1e-5), end * (1.0 + 1e-5)];
        let beside = neighbours(ray, blur).any(|shift| ends.into_iter().any(|end| occluded(shift, end) == is_hit));
        if beside { Verdict::Beside } else { Verdict::Wrong }
    }
}

/// Rays around a ray: where to move its origin.
fn neighbours(ray: &ProbeRay, blur: f64) -> impl Iterator<Item = DVec3> {
    let (right, up) = Vec3::from(ray.direction).as_dvec3().normalize().any_orthonormal_pair();
    let radii = [0.0, 0.02, 0.1, 0.3, 1.0].into_iter();
    radii.flat_map(move |radius| {
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

/// An origin far outside, near by, or among the triangles.
fn origin(scene: &Scene, random: &mut Random) -> Vec3 {
    let (min, max) = bounds(scene);
    match random.below(4) {
        0 => (min + max) / 2.0 + 10.0 * random.direction(),
        1 => (min + max) / 2.0 + 2.0 * random.direction(),
        _ => random.within(min, max),
    }
}

/// Rays from anywhere to anywhere.
fn random_rays(scene: &Scene, random: &mut Random) -> Vec<ProbeRay> {
    let (min, max) = bounds(scene);
    let mut one = || {
        let origin = origin(scene, random);
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
    let mut rays = random_rays(judge.scene, random);
    for ray in &mut rays {
        let first = judge.hit(ray, DVec3::ZERO).map_or(1.0, |hit| hit.t);
        ray.t_max = (2.0 * random.unit() * first) as f32;
        ray.shadow = 1;
    }
    rays
}

fn bvh_of(scene: &Scene, preset: Preset) -> Bvh {
    raytree::build_bvh(scene, preset).unwrap_or_else(|error| panic!("{error}"))
}

fn trace(device: &Device, scene: &Scene, rays: &[ProbeRay]) -> Vec<ProbeHit> {
    let features = ProgramFeatures::default().with(Feature::Culling, true);
    probe(device, scene, &bvh_of(scene, Preset::Balanced), features, rays).unwrap_or_else(|error| panic!("{error}"))
}

/// Counts verdicts, and describes those that are wrong.
fn verdicts(
    kind: &str,
    rays: &[ProbeRay],
    hits: &[ProbeHit],
    judge: impl Fn(&ProbeRay, &ProbeHit) -> Verdict,
) -> (usize, Vec<String>) {
    let mut beside = 0;
    let mut wrong = Vec::new();
    for (ray, hit) in rays.iter().zip(hits) {
        match judge(ray, hit) {
            Verdict::Same => {}
            Verdict::Beside => beside += 1,
            Verdict::Wrong => wrong.push(format!("{kind}: {ray:?} gave {hit:?}")),
        }
    }
    println!("  {kind:8}: {} rays, {beside} beside an outline, {} wrong", rays.len(), wrong.len());
    (beside, wrong)
}

fn judge_scene(name: &str, mut scene: Scene) {
    let Some(device) = support::device() else { return };
    // Masks are for who shades a hit.
    scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Opaque);
    let judge = Judge::new(&scene);
    let mut random = Random::new(7);
    println!("{name}, {} triangles", scene.geometry.triangles.len());

    let mut wrong = Vec::new();
    let mut off = Off::default();
    let aimed = [
        ("random", random_rays(&scene, &mut random)),
        ("vertices", aimed_rays(&scene, &mut random, false)),
        ("edges", aimed_rays(&scene, &mut random, true)),
        ("axes", axis_rays(&scene, &mut random)),
    ];
    for (kind, rays) in aimed {
        let hits = trace(device, &scene, &rays);
        let (beside, faults) = verdicts(kind, &rays, &hits, |ray, hit| judge.judge(ray, hit));
        wrong.extend(faults);
        if kind == "random" {
            assert!(beside as f64 <= BESIDE_SHARE * RAYS as f64, "{name}: {beside} of {RAYS} rays beside an outline");
            let met = hits.iter().filter(|hit| hit.triangle != u32::MAX).count();
            assert!(met > RAYS / 10, "{name}: only {met} rays hit anything");
        }
        for (ray, hit) in rays.iter().zip(&hits) {
            let theirs = judge.hit(ray, DVec3::ZERO).filter(|theirs| theirs.triangle == hit.triangle as usize);
            if let Some(theirs) = theirs {
                let this = judge.off(ray, hit, &theirs);
                off = Off { t: off.t.max(this.t), place: off.place.max(this.place) };
            }
        }
    }
    println!("  the same triangle: distance off by up to {:.1} roundings, place by {:.1}", off.t, off.place);

    let rays = shadow_rays(&judge, &mut random);
    let hits = trace(device, &scene, &rays);
    wrong.extend(verdicts("shadow", &rays, &hits, |ray, hit| judge.judge_shadow(ray, hit)).1);
    assert!(wrong.is_empty(), "{name}: {} wrong:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

fn own(name: &str) -> Scene {
    support::import(&support::root().join("assets").join(name))
}

#[test]
fn hits_of_everything() {
    judge_scene("everything", own("everything.glb"));
}

#[test]
fn hits_of_a_book() {
    judge_scene("book", own("book.glb"));
}

#[test]
fn hits_of_a_room() {
    judge_scene("cornell", own("cornell.glb"));
}

#[test]
fn hits_of_a_soup() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(raytree::model::Material::default());
    build.soup(20_000, &mut Random::new(3), material);
    judge_scene("soup", build.0);
}
