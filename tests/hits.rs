//! Traversal alone, judged by the f64 oracle: the probe kernel's hits of 200,000 rays a scene, the kinds that renderers get
//! wrong among them: at vertices and edges, along axes, from among the triangles, from afar.
//!
//! A hit is right if it is the oracle's, or as near as the oracle's (a neighbour's). It is excused if the oracle finds that
//! triangle for a ray that lies beside ours by no more than f32 can tell apart: outlines may differ by that. Distance and place in the
//! triangle are never excused.

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

mod support;

use glam::{DVec3, Vec3};
use raytree::{
    Bvh, Device, Feature, Preset, ProgramFeatures, Scene,
    model::{AlphaMode, Geometry},
};
use raytree_gpu::{
    probe,
    types::{ProbeHit, ProbeRay},
};
use raytree_oracle::{Oracle, Shading};
use raytree_stress::{random::Random, scenes::Build};

/// Rays of each of the six kinds.
const RAYS: usize = 35_000;

/// One rounding.
const EPSILON: f64 = f32::EPSILON as f64 / 2.0;

/// Roundings that a hit may be off by. The corners relative to the ray's origin, at distance D, are rounded (1 each), then the
/// edges and their cross product (4), which tilts a triangle of size s by eps D/s and so moves it by eps D where it is hit; then
/// two scalar products and a quotient (3 each, 1). The place in the triangle takes as many.
const ROUNDINGS: f64 = 16.0;

/// .. and a corner of a triangle, seen along the ray: relative to the origin (1), sheared by a rounded quotient (3). It is the same
/// for all triangles that share it, so nothing slips through, but outlines seem to lie that far beside where they are.
const ROUNDINGS_OF_OUTLINE: f64 = 8.0;

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
        self.0
            .into_iter()
            .map(|corner| corner.distance(origin))
            .fold(0.0, f64::max)
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
        Place {
            t: e2.dot(q) / determinant,
            u: s.dot(p) / determinant,
            v: direction.dot(q) / determinant,
        }
    }
}

fn start(ray: &ProbeRay) -> (DVec3, DVec3) {
    (
        Vec3::from(ray.origin).as_dvec3(),
        Vec3::from(ray.direction).as_dvec3(),
    )
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
        Self {
            scene,
            oracle: Oracle::new(scene),
        }
    }

    fn corners(&self, triangle: usize) -> Corners {
        let geometry = &self.scene.geometry;
        Corners(
            geometry.triangles[triangle]
                .vertices
                .map(|vertex| geometry.positions[vertex as usize].as_dvec3()),
        )
    }

    /// Triangle and distance of the oracle's hit of the ray moved by `shift`.
    fn oracle_hit(&self, ray: &ProbeRay, shift: DVec3) -> Option<(usize, f64)> {
        let (origin, direction) = start(ray);
        let hit = self.oracle.closest_hit(
            (origin + shift).to_array(),
            direction.to_array(),
            Shading::Pbr,
        )?;
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
        let apart = corners
            .at(u, v)
            .distance(corners.at(f64::from(hit.u), f64::from(hit.v)));
        (
            (f64::from(hit.t) - exact.t).abs() * direction.length() / unit,
            apart / unit,
        )
    }

    /// How far beside where it is a triangle's outline may seem to lie.
    fn blur(&self, ray: &ProbeRay, triangle: usize) -> f64 {
        ROUNDINGS_OF_OUTLINE * EPSILON * self.corners(triangle).farthest(start(ray).0)
    }

    fn judge(&self, ray: &ProbeRay, hit: &ProbeHit) -> Verdict {
        let theirs = self.oracle_hit(ray, DVec3::ZERO);
        let ours = (hit.triangle != u32::MAX).then_some(hit.triangle as usize);
        if ours == theirs.map(|(triangle, _)| triangle) {
            return if ours.is_none() || self.has_right_values(ray, hit) {
                Verdict::Same
            } else {
                Verdict::Wrong
            };
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
        let blur = triangles
            .map(|triangle| self.blur(ray, triangle))
            .fold(0.0, f64::max);
        let towards_ours = self
            .shifts_into(ray, hit)
            .filter(|shift| shift.length() <= blur);
        let around = |centre| ring(ray, blur).map(move |shift| centre + shift);
        let beside = towards_ours
            .chain([DVec3::ZERO])
            .any(|centre| meets_ours(centre) || around(centre).any(meets_ours));
        if beside {
            Verdict::Beside
        } else {
            Verdict::Wrong
        }
    }

    fn has_right_values(&self, ray: &ProbeRay, hit: &ProbeHit) -> bool {
        let (t, place) = self.off(ray, hit);
        let inside = hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 2.0 * f32::EPSILON;
        inside && t <= ROUNDINGS && place <= ROUNDINGS
    }

    /// How to move the ray so that it meets the device's triangle, not far inside of the edge that it passes closest.
    fn shifts_into(&self, ray: &ProbeRay, hit: &ProbeHit) -> impl Iterator<Item = DVec3> {
        let (origin, direction) = start(ray);
        let direction = direction.normalize();
        let across =
            move |point: DVec3| (point - origin) - (point - origin).dot(direction) * direction;
        let inwards = (hit.triangle != u32::MAX).then(|| {
            let corners = self.corners(hit.triangle as usize);
            let [a, b, c] = corners.0.map(across);
            let nearest = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                let share = -a.dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE);
                a.lerp(b, share.clamp(0.0, 1.0))
            });
            let edge = nearest
                .into_iter()
                .min_by(|a, b| a.length().total_cmp(&b.length()))
                .unwrap_or(a);
            [1e-6, 1e-4, 1e-3, 1e-2, 0.1, 0.5].map(|share| edge.lerp((a + b + c) / 3.0, share))
        });
        inwards.into_iter().flatten()
    }

    /// The same for a shadow ray: whether there is anything up to its end.
    fn judge_shadow(&self, ray: &ProbeRay, hit: &ProbeHit) -> Verdict {
        let is_hit = hit.triangle != u32::MAX;
        let end = f64::from(ray.t_max);
        let (origin, direction) = start(ray);
        let occluded = |shift, end| {
            self.oracle.occluded(
                DVec3::to_array(&(origin + shift)),
                direction.to_array(),
                end,
            )
        };
        if occluded(DVec3::ZERO, end) == is_hit {
            return Verdict::Same;
        }
        let theirs = self
            .oracle_hit(ray, DVec3::ZERO)
            .map(|(triangle, _)| triangle);
        let triangles = theirs
            .into_iter()
            .chain(is_hit.then_some(hit.triangle as usize));
        let blur = triangles
            .map(|triangle| self.blur(ray, triangle))
            .fold(0.0, f64::max);
        let ends = [end - blur, end, end + blur];
        let shifts = ring(ray, blur).chain(
            self.shifts_into(ray, hit)
                .filter(|shift| shift.length() <= blur),
        );
        let beside = shifts
            .chain([DVec3::ZERO])
            .any(|shift| ends.into_iter().any(|end| occluded(shift, end) == is_hit));
        if beside {
            Verdict::Beside
        } else {
            Verdict::Wrong
        }
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
    ProbeRay {
        origin: origin.to_array(),
        t_max: 1e30,
        direction: direction.to_array(),
        shadow: 0,
    }
}

/// Makes rays for a scene.
struct Marksman<'s> {
    geometry: &'s Geometry,
    min: Vec3,
    max: Vec3,
    random: Random,
}

impl<'s> Marksman<'s> {
    fn new(scene: &'s Scene) -> Self {
        let (min, max) = scene.bounds().expect("there are triangles");
        Self {
            geometry: &scene.geometry,
            min: min.as_vec3(),
            max: max.as_vec3(),
            random: Random::new(7),
        }
    }

    fn coin(&mut self) -> bool {
        self.random.below(2) == 0
    }

    fn among(&mut self) -> Vec3 {
        self.random.within(self.min, self.max)
    }

    fn around(&mut self, distance: f32) -> Vec3 {
        (self.min + self.max) / 2.0 + distance * self.random.direction()
    }

    /// Outside, or among the triangles.
    fn anywhere(&mut self) -> Vec3 {
        if self.coin() {
            self.around(2.0)
        } else {
            self.among()
        }
    }

    /// A corner of a triangle, or the middle of one of its edges.
    fn target(&mut self, edge: bool) -> Vec3 {
        let triangle = self.geometry.triangles[self.random.below(self.geometry.triangles.len())];
        let corner = self.random.below(3);
        let [a, b] = [corner, (corner + 1) % 3]
            .map(|k| self.geometry.positions[triangle.vertices[k] as usize]);
        if edge { (a + b) / 2.0 } else { a }
    }

    fn random_ray(&mut self) -> ProbeRay {
        let origin = self.anywhere();
        ray(origin, (self.among() - origin).normalize_or(Vec3::X))
    }

    fn ray_from_afar(&mut self) -> ProbeRay {
        let origin = self.around(10.0);
        ray(origin, (self.among() - origin).normalize())
    }

    /// Not normalised, which would lead it past the corner.
    fn aimed_ray(&mut self, edge: bool) -> ProbeRay {
        let target = self.target(edge);
        let origin = self.anywhere();
        ray(
            origin,
            if origin == target {
                Vec3::X
            } else {
                target - origin
            },
        )
    }

    /// Along an axis, half of them exactly through a corner: two components are zero, and boxes are grazed.
    fn axis_ray(&mut self) -> ProbeRay {
        let axis = self.random.below(3);
        let sign = if self.coin() { -1.0 } else { 1.0 };
        let mut origin = if self.coin() {
            self.target(false)
        } else {
            self.among()
        };
        origin[axis] = if self.coin() {
            -3.0 * sign
        } else {
            self.among()[axis]
        };
        // Both zeros: their reciprocals differ in sign.
        let mut direction = if self.coin() { Vec3::ZERO } else { -Vec3::ZERO };
        direction[axis] = sign;
        ray(origin, direction)
    }

    /// Ends anywhere before or behind the first thing on its way.
    fn shadow_ray(&mut self, judge: &Judge<'_>) -> ProbeRay {
        let ray = self.random_ray();
        let first = judge.oracle_hit(&ray, DVec3::ZERO).map_or(1.0, |(_, t)| t);
        ProbeRay {
            t_max: (2.0 * self.random.unit() * first) as f32,
            shadow: 1,
            ..ray
        }
    }
}

fn many<T>(mut one: impl FnMut() -> T) -> Vec<T> {
    (0..RAYS).map(|_| one()).collect()
}

fn trace(device: &Device, scene: &Scene, bvh: &Bvh, rays: &[ProbeRay]) -> Vec<ProbeHit> {
    let features = ProgramFeatures::default().with(Feature::Culling, true);
    probe(device, scene, bvh, features, rays).unwrap_or_else(|error| panic!("{error}"))
}

/// How many hits are beside an outline, and descriptions of those that are wrong.
fn judge_all(
    kind: &str,
    judge: &Judge<'_>,
    rays: &[ProbeRay],
    hits: &[ProbeHit],
) -> (usize, Vec<String>) {
    let verdict = |(ray, hit): (&ProbeRay, &ProbeHit)| {
        if ray.shadow == 0 {
            judge.judge(ray, hit)
        } else {
            judge.judge_shadow(ray, hit)
        }
    };
    let pairs: Vec<_> = rays.iter().zip(hits).collect();
    let verdicts: Vec<Verdict> = std::thread::scope(|scope| {
        let halves = pairs.chunks(pairs.len().div_ceil(2));
        let workers: Vec<_> = halves
            .map(|half| {
                scope.spawn(move || half.iter().map(|&pair| verdict(pair)).collect::<Vec<_>>())
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().expect("a judge does not panic"))
            .collect()
    });
    let beside = verdicts
        .iter()
        .filter(|verdict| **verdict == Verdict::Beside)
        .count();
    let wrong: Vec<String> = (pairs.iter().zip(&verdicts))
        .filter(|(_, verdict)| **verdict == Verdict::Wrong)
        .map(|((ray, hit), _)| {
            format!(
                "{kind}: {ray:?} gave {hit:?}, oracle {:?}",
                judge.oracle_hit(ray, DVec3::ZERO)
            )
        })
        .collect();
    println!(
        "  {kind:8}: {} rays, {beside} beside an outline, {} wrong",
        rays.len(),
        wrong.len()
    );
    (beside, wrong)
}

/// `beside_share`: of the random rays, how many may hit beside an outline.
fn judge_scene(name: &str, mut scene: Scene, beside_share: f64) {
    let Some(device) = support::device() else {
        return;
    };
    // Masks are for who shades a hit.
    scene
        .materials
        .iter_mut()
        .for_each(|material| material.alpha_mode = AlphaMode::Opaque);
    let bvh =
        raytree::build_bvh(&scene, Preset::Balanced).unwrap_or_else(|error| panic!("{error}"));
    let judge = Judge::new(&scene);
    let mut marksman = Marksman::new(&scene);
    println!("{name}, {} triangles", scene.geometry.triangles.len());
    let kinds = [
        ("random", many(|| marksman.random_ray())),
        ("far", many(|| marksman.ray_from_afar())),
        ("vertices", many(|| marksman.aimed_ray(false))),
        ("edges", many(|| marksman.aimed_ray(true))),
        ("axes", many(|| marksman.axis_ray())),
        ("shadow", many(|| marksman.shadow_ray(&judge))),
    ];
    let mut wrong = Vec::new();
    let mut worst = (0.0_f64, 0.0_f64);
    for (kind, rays) in kinds {
        let hits = trace(device, &scene, &bvh, &rays);
        let (beside, faults) = judge_all(kind, &judge, &rays, &hits);
        wrong.extend(faults);
        let met: Vec<_> = rays
            .iter()
            .zip(&hits)
            .filter(|(_, hit)| hit.triangle != u32::MAX)
            .collect();
        assert!(
            met.len() > RAYS / 20,
            "{name}, {kind}: only {} rays hit anything",
            met.len()
        );
        if matches!(kind, "random" | "shadow") {
            assert!(
                beside as f64 <= beside_share * RAYS as f64,
                "{name}, {kind}: {beside} of {RAYS} beside an outline"
            );
        }
        for (ray, hit) in met.into_iter().filter(|(ray, _)| ray.shadow == 0) {
            let off = judge.off(ray, hit);
            worst = (worst.0.max(off.0), worst.1.max(off.1));
        }
    }
    println!(
        "  distance off by up to {:.2} roundings, place in the triangle by {:.2}",
        worst.0, worst.1
    );
    assert!(
        wrong.is_empty(),
        "{name}: {} wrong:\n{}",
        wrong.len(),
        wrong[..wrong.len().min(20)].join("\n")
    );
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
    const CENTRE: Vec3 = Vec3::new(0.3, -0.2, 0.1);
    let Some(device) = support::device() else {
        return;
    };
    let mut leaks = Vec::new();
    for (radius, levels) in [(1.0, 6), (1.0, 3), (0.01, 5)] {
        let mut build = Build::before([0.0; 3]);
        let material = build.material(raytree::model::Material {
            double_sided: true,
            ..Default::default()
        });
        build.ball(CENTRE, radius, levels, material);
        let scene = build.0;
        let bvh =
            raytree::build_bvh(&scene, Preset::Balanced).unwrap_or_else(|error| panic!("{error}"));
        let mut marksman = Marksman::new(&scene);
        let mut one = || {
            let origin =
                CENTRE + 0.9 * radius * marksman.random.unit() as f32 * marksman.random.direction();
            let edge = marksman.coin();
            let direction = marksman.target(edge) - origin;
            ray(
                origin,
                if marksman.coin() {
                    direction
                } else {
                    direction.normalize()
                },
            )
        };
        let rays: Vec<ProbeRay> = (0..4 * RAYS).map(|_| one()).collect();
        let hits = trace(device, &scene, &bvh, &rays);
        let leaking = rays
            .iter()
            .zip(&hits)
            .filter(|(_, hit)| hit.triangle == u32::MAX);
        leaks.extend(leaking.map(|(ray, _)| format!("radius {radius}, level {levels}: {ray:?}")));
    }
    assert!(
        leaks.is_empty(),
        "{} leaks:\n{}",
        leaks.len(),
        leaks[..leaks.len().min(20)].join("\n")
    );
}

/// The judge has to be able to fail: hits that are right but for one thing.
#[test]
fn a_wrong_hit_is_noticed() {
    let scene = own("facing-mirrors.glb");
    let judge = Judge::new(&scene);
    let mut marksman = Marksman::new(&scene);
    let right = |ray: &ProbeRay| {
        let (triangle, t) = judge.oracle_hit(ray, DVec3::ZERO)?;
        let (origin, direction) = start(ray);
        let place = judge.corners(triangle).meet(origin, direction);
        Some(ProbeHit {
            t: t as f32,
            u: place.u.max(0.0) as f32,
            v: place.v.max(0.0) as f32,
            triangle: triangle as u32,
        })
    };
    let wrongs: [fn(&mut ProbeHit); 5] = [
        |hit| hit.t *= 1.0005,
        |hit| (hit.u, hit.v) = (hit.v, hit.u),
        |hit| {
            hit.triangle = if hit.triangle == 0 {
                1
            } else {
                hit.triangle - 1
            }
        },
        |hit| hit.triangle = u32::MAX,
        |hit| hit.t = f32::NAN,
    ];
    let mut noticed = [0; 5];
    let mut count = 0;
    for ray in (0..2000).map(|_| marksman.random_ray()) {
        let Some(hit) = right(&ray) else { continue };
        assert_eq!(judge.judge(&ray, &hit), Verdict::Same);
        count += 1;
        for (noticed, change) in noticed.iter_mut().zip(wrongs) {
            let mut changed = hit;
            change(&mut changed);
            *noticed += usize::from(judge.judge(&ray, &changed) == Verdict::Wrong);
        }
        let end = 2.0 * hit.t;
        let shadow = ProbeRay {
            t_max: end,
            shadow: 1,
            ..ray
        };
        let lit = ProbeHit {
            t: end,
            u: 0.0,
            v: 0.0,
            triangle: u32::MAX,
        };
        assert_eq!(judge.judge_shadow(&shadow, &hit), Verdict::Same);
        assert_eq!(judge.judge_shadow(&shadow, &lit), Verdict::Wrong);
    }
    // Seen at a grazing angle, a tiny change is within rounding; u and v may be alike by chance.
    println!("noticed {noticed:?} of {count}");
    assert!(
        count > 1000
            && noticed
                .iter()
                .all(|&noticed| noticed as f64 > 0.97 * f64::from(count))
    );
}
