//! Interpolated normals neither let light through the back nor make a reflected ray enter the surface.

mod bodies;

use glam::{DVec3, Vec3};
use raytree_film::Film;
use raytree_gpu::{
    RenderSettings,
    types::{LEAVING_MIRRORED, SecondaryHit, SecondaryRay},
};
use raytree_oracle::{Oracle, Settings};
use raytree_scene::model::{LightKind, Scene};

use crate::{
    judge::{judge_picture, oracle_settings},
    meshes::Mesh,
    random::Random,
    report::Limit,
    scenes::{Build, parallel},
    stage::{Stage, StressError},
};

/// Pixels on a picture's side.
const SIDE: u32 = 64;
/// Pictures a body, each with a light of its own.
const PICTURES: usize = 24;
/// Reflected rays a body.
const RAYS: usize = 100_000;
/// The flattest angle to a facet at which it is looked at, radians.
const LEAST_ANGLE: f64 = 1e-4;
/// How far below and above a facet's horizon some of the lights are, radians.
const HORIZON: f64 = 1e-6;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for mesh in bodies::bodies() {
        judge_light(stage, &mesh)?;
        judge_reflection(stage, &mesh)?;
    }
    Ok(())
}

fn judge_light(stage: &mut Stage<'_>, mesh: &Mesh) -> Result<(), StressError> {
    let mut random = Random::new(41);
    let (mut through, mut lit, mut unexplained) = (0, 0, 0);
    for k in 0..PICTURES {
        let (towards_light, view) = light_and_view(mesh, k, &mut random);
        let mut lighted = Build(mesh.scene.clone());
        let direction = -towards_light;
        lighted.light(LightKind::Directional { direction }, 1.0);
        let camera = parallel(4.0 * view.as_vec3(), Vec3::ZERO, 1.1);
        let settings = RenderSettings::new(SIDE, SIDE, camera);
        let film = stage.render(&lighted.0, &settings)?.film;
        let facing = facing(&lighted.0, &settings, towards_light);
        through += lit_from_behind(&film, &facing);
        lit += film
            .radiance
            .iter()
            .filter(|radiance| **radiance != [0.0; 3])
            .count();
        unexplained += judge_picture(&lighted.0, &settings, &film, 1e-3)
            .unexplained
            .len();
    }
    let note = format!(
        "of {} pixels, {lit} of them lit",
        PICTURES as u32 * SIDE * SIDE
    );
    let none = Limit::AtMost(0.0);
    let parameter = format!("pixels lit from behind: {}", mesh.name);
    stage.record_with(parameter, through as f64, none, &note);
    let parameter = format!("pixels that the oracle lights otherwise: {}", mesh.name);
    stage.record_with(parameter, unexplained as f64, none, note);
    Ok(())
}

/// Unit vectors to the light and to the camera: for one of three pictures anywhere, else with the light just below or just above
/// the horizon of a facet that the camera sees well.
fn light_and_view(mesh: &Mesh, k: usize, random: &mut Random) -> (DVec3, DVec3) {
    if k.is_multiple_of(3) {
        return (unit(random), unit(random));
    }
    let [a, b, c] = mesh
        .corners(random.below(mesh.scene.geometry.triangles.len()))
        .map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a).normalize();
    let tangent = normal.cross(unit(random)).normalize();
    let height = if k % 3 == 1 { HORIZON } else { -HORIZON };
    let view = (normal + 0.5 * unit(random)).normalize();
    ((tangent + height * normal).normalize(), view)
}

fn unit(random: &mut Random) -> DVec3 {
    random.direction().as_dvec3().normalize()
}

/// Of each pixel, whether the facet in it faces the light; by the oracle, and none where there is no facet.
fn facing(scene: &Scene, settings: &RenderSettings, towards_light: DVec3) -> Vec<Option<bool>> {
    let oracle = Oracle::new(scene);
    let wanted: Settings = oracle_settings(settings);
    let pixels = (0..settings.height).flat_map(|y| (0..settings.width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let hit = oracle.first_hit(&settings.camera, &wanted, x, y)?;
            Some(DVec3::from(hit.geometric_normal).dot(towards_light) > 0.0)
        })
        .collect()
}

/// Pixels with light on a facet that faces away from it. At the body's outline device and oracle may see different facets: a
/// pixel counts only if its neighbours' facets face away too.
fn lit_from_behind(film: &Film, facing: &[Option<bool>]) -> usize {
    let side = film.width as usize;
    let faces_away = |index: usize| facing.get(index) == Some(&Some(false));
    let surely_away = |index: &usize| {
        let index = *index;
        let across = !index.is_multiple_of(side) && index % side + 1 < side && index >= side;
        across
            && [index, index - 1, index + 1, index - side, index + side]
                .into_iter()
                .all(faces_away)
    };
    (0..film.radiance.len())
        .filter(surely_away)
        .filter(|&index| {
            film.radiance[index]
                .iter()
                .any(|&channel| !(channel == 0.0))
        })
        .count()
}

fn judge_reflection(stage: &mut Stage<'_>, mesh: &Mesh) -> Result<(), StressError> {
    let rays = looks(mesh);
    let hits = stage.secondary_prober(&mesh.scene)?.trace(&rays)?;
    let reflections = Reflections::of(mesh, &hits);
    stage.count_rays((rays.len() + reflections.count) as u64);
    let none = Limit::AtMost(0.0);
    let note = format!(
        "of {}; the lowest at {:.1e} rad",
        reflections.count, reflections.lowest
    );
    let parameter = format!("reflected rays that enter the facet: {}", mesh.name);
    stage.record_with(parameter, reflections.entering as f64, none, note);
    let parameter = format!("reflected rays that hit the body itself: {}", mesh.name);
    stage.record(parameter, reflections.inside as f64, none);
    Ok(())
}

/// From outside to all over the body, at all angles, some of them straight down.
fn looks(mesh: &Mesh) -> Vec<SecondaryRay> {
    let mut random = Random::new(43);
    let triangles = mesh.scene.geometry.triangles.len();
    (0..RAYS)
        .map(|k| {
            let corners = mesh.corners(random.below(triangles));
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let (s, t) = (random.unit(), random.unit());
            let (s, t) = if s + t > 1.0 {
                (1.0 - s, 1.0 - t)
            } else {
                (s, t)
            };
            let target = a + s * (b - a) + t * (c - a);
            let normal = (b - a).cross(c - a).normalize();
            let back = if k.is_multiple_of(4) {
                normal
            } else {
                let height = LEAST_ANGLE.powf(random.unit());
                (height * normal + normal.cross(unit(&mut random)).normalize()).normalize()
            };
            SecondaryRay {
                origin: (target + 3.0 * back).as_vec3().to_array(),
                leaving: LEAVING_MIRRORED,
                direction: (-back).as_vec3().to_array(),
                ..SecondaryRay::default()
            }
        })
        .collect()
}

/// What became of reflected rays.
#[derive(Debug)]
struct Reflections {
    count: usize,
    /// Rays that point into the facet, by its exact plane.
    entering: usize,
    /// Rays that hit the body, which is convex and was hit from outside.
    inside: usize,
    /// The flattest angle to the facet, radians.
    lowest: f64,
}

impl Reflections {
    fn of(mesh: &Mesh, hits: &[SecondaryHit]) -> Self {
        let mut found = Self {
            count: 0,
            entering: 0,
            inside: 0,
            lowest: f64::INFINITY,
        };
        for hit in hits
            .iter()
            .filter(|hit| hit.triangle != u32::MAX && hit.back == 0)
        {
            let [a, b, c] = mesh
                .corners(hit.triangle as usize)
                .map(|corner| corner.as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            let height = normal.dot(Vec3::from(hit.direction).as_dvec3());
            found.count += 1;
            found.lowest = found.lowest.min(height);
            found.entering += usize::from(height < 0.0 || height.is_nan());
            found.inside += usize::from(hit.next_triangle != u32::MAX);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_from_behind_is_noticed() {
        let mut film = Film::new(4, 4);
        let facing = [Some(false); 16];
        assert_eq!(lit_from_behind(&film, &facing), 0);
        film.radiance[5] = [0.0, 1e-30, 0.0];
        film.radiance[6] = [f32::NAN; 3];
        assert_eq!(lit_from_behind(&film, &facing), 2);
        let mut beside = facing;
        beside[7] = None;
        assert_eq!(lit_from_behind(&film, &beside), 1);
        assert_eq!(lit_from_behind(&film, &[Some(true); 16]), 0);
    }

    #[test]
    fn a_ray_into_the_facet_and_a_hit_of_the_body_are_noticed() {
        let mesh = &bodies::bodies()[0];
        let [a, b, c] = mesh.corners(0);
        let normal = (b - a).cross(c - a).normalize();
        let out = SecondaryHit {
            direction: normal.to_array(),
            next_triangle: u32::MAX,
            ..SecondaryHit::default()
        };
        let wrongs = [
            out,
            SecondaryHit {
                direction: (-normal).to_array(),
                ..out
            },
            SecondaryHit {
                direction: [f32::NAN; 3],
                ..out
            },
            SecondaryHit {
                next_triangle: 3,
                ..out
            },
            SecondaryHit {
                triangle: u32::MAX,
                ..out
            },
        ];
        let found = Reflections::of(mesh, &wrongs);
        assert_eq!((found.count, found.entering, found.inside), (4, 2, 1));
    }

    /// Rows about what was never looked at would hold too.
    #[test]
    fn there_are_facets_that_face_away() {
        for mesh in bodies::bodies() {
            let mut random = Random::new(41);
            let mut away = 0;
            for k in 0..6 {
                let (light, view) = light_and_view(&mesh, k, &mut random);
                let camera = parallel(4.0 * view.as_vec3(), Vec3::ZERO, 1.1);
                let facing = facing(&mesh.scene, &RenderSettings::new(16, 16, camera), light);
                away += facing
                    .iter()
                    .filter(|facing| **facing == Some(false))
                    .count();
            }
            assert!(away > 50, "{}: {away}", mesh.name);
        }
    }
}
