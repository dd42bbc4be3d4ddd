//! Trees of boxes that spare a ray next to nothing: triangles in one place, slivers across the whole scene; and next to no tree.

use glam::Vec3;
use raytree_bvh::Preset;
use raytree_gpu::{RenderSettings, Rendered, build_bvh};
use raytree_scene::model::{Material, Scene};

use crate::{
    judge::{difference, judge_picture},
    random::Random,
    report::Limit,
    scenes::{Build, parallel},
    stage::{Stage, StressError},
};

const COPIES: usize = 100_000;
const SLIVERS: usize = 20_000;

/// Of radiance 1.
const TOLERANCE: f64 = 1e-3;

/// What 8 lanes may do together before Mesa older than 25.0 ends their loops.
const LOOP_LIMIT: f64 = 65_535.0;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    copies(stage)?;
    slivers(stage)?;
    next_to_nothing(stage)
}

/// A surface that is its own light.
fn lamp(build: &mut Build, radiance: [f32; 3]) -> u32 {
    build.material(Material {
        base_color: glam::Vec4::W,
        metallic: 0.0,
        ior: 1.0,
        emissive: radiance.into(),
        double_sided: true,
        ..Material::default()
    })
}

fn view(pixels: u32) -> RenderSettings {
    let camera = parallel(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 0.8);
    RenderSettings::new(pixels, pixels, camera)
}

const TRIANGLE: [Vec3; 3] = [
    Vec3::new(-1.0, -0.7, 0.0),
    Vec3::new(0.9, -0.6, 0.1),
    Vec3::new(0.1, 0.9, -0.1),
];

fn add(build: &mut Build, corners: [Vec3; 3], material: u32) {
    let vertices = corners.map(|corner| build.vertex(corner, Vec3::Z));
    build.triangle(vertices, material);
}

/// A hundred thousand triangles in one place: the lowest index is the one that is seen.
fn copies(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut build = Build::before([0.0, 0.0, 0.25]);
    let [seen, copy] = [[0.75, 0.0, 0.0], [0.0, 0.75, 0.0]].map(|color| lamp(&mut build, color));
    for k in 0..COPIES {
        add(&mut build, TRIANGLE, if k == 0 { seen } else { copy });
    }
    let settings = view(16);
    let rendered = stage.render(&build.0, &settings)?;
    let wrong = rendered
        .film
        .radiance
        .iter()
        .filter(|rgb| !is_one_of(**rgb, &[[0.75, 0.0, 0.0], [0.0, 0.0, 0.25]]));
    stage.record(
        format!("{COPIES} triangles in one place: pixels that see another than the first"),
        wrong.count() as f64,
        Limit::AtMost(0.0),
    );

    // The same picture as of one of them.
    let mut once = Build::before([0.0, 0.0, 0.25]);
    let seen = lamp(&mut once, [0.75, 0.0, 0.0]);
    add(&mut once, TRIANGLE, seen);
    let single = stage.render(&once.0, &settings)?;
    let pairs = rendered.film.radiance.iter().zip(&single.film.radiance);
    let different = pairs.filter(|(a, b)| a != b).count();
    stage.record(
        format!("{COPIES} triangles in one place: pixels unlike those of one"),
        different as f64,
        Limit::AtMost(0.0),
    );
    one_ray(stage, &build.0, "triangles in one place", COPIES, true)
}

fn is_one_of(seen: [f32; 3], expected: &[[f64; 3]]) -> bool {
    expected
        .iter()
        .any(|color| difference(seen.map(f64::from), *color) < 1e-6)
}

/// What a single ray in the middle of the picture takes, and takes of each iteration. A driver that cuts its loops short tests less
/// than there is; a traversal that is not taken up where it was left, more.
fn one_ray(
    stage: &mut Stage<'_>,
    scene: &Scene,
    name: &str,
    triangles: usize,
    all_are_met: bool,
) -> Result<(), StressError> {
    let nodes = build_bvh(scene, Preset::default())?.nodes.len();
    let middle = Vec3::new(0.013, 0.021, 0.0);
    let camera = parallel(middle + 3.0 * Vec3::Z, middle, 1e-6);
    let rendered = stage.render(scene, &RenderSettings::new(1, 1, camera))?;
    let (steps, all) = (steps(&rendered), (nodes + triangles) as f64);
    let note = format!(
        "{steps} steps, {triangles} triangles, {nodes} nodes, {} iterations",
        rendered.iterations
    );
    if all_are_met {
        stage.record_with(
            format!("{name}: nodes and triangles that one ray misses, or meets again"),
            (steps - all).abs(),
            Limit::AtMost(0.0),
            note,
        );
    } else {
        stage.record_with(
            format!("{name}: node visits and triangle tests of one ray"),
            steps,
            Limit::AtMost(all),
            note,
        );
    }
    stage.record(
        format!("{name}: 8 times the steps of an iteration"),
        8.0 * steps / f64::from(rendered.iterations.max(1)),
        Limit::AtMost(LOOP_LIMIT),
    );
    Ok(())
}

fn steps(rendered: &Rendered) -> f64 {
    let counters = rendered.counters.unwrap_or_default();
    (counters.node_visits + counters.triangle_tests) as f64
}

/// Slivers from side to side of the scene; then two blocks of glass and water that share a face among them, so that rays branch,
/// and gather faces, where each of them takes several iterations.
fn slivers(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut random = Random::new(17);
    let mut build = Build::before([0.1, 0.2, 0.25]);
    let colors = [[0.75, 0.1, 0.0], [0.0, 0.6, 0.1], [0.9, 0.8, 0.7]];
    let colors = colors.map(|color| lamp(&mut build, color));
    for k in 0..SLIVERS {
        let ends = diagonal(&mut random);
        let aside = 0.002 * random.direction();
        let [from, to] = ends;
        add(&mut build, [from, to, to + aside], colors[k % colors.len()]);
    }
    judge(stage, "slivers across the scene", &build.0, 20)?;
    one_ray(stage, &build.0, "slivers across the scene", SLIVERS, false)?;

    let [water, glass] = [1.33, 1.5].map(|ior| build.material(super::media::clear(ior)));
    build.cuboid(
        Vec3::new(-0.5, -0.4, 0.95),
        Vec3::new(0.05, 0.4, 1.4),
        water,
    );
    build.cuboid(Vec3::new(0.05, -0.4, 0.95), Vec3::new(0.6, 0.4, 1.4), glass);
    judge(
        stage,
        "slivers behind glass that touches water",
        &build.0,
        12,
    )
}

/// From one side of the cube from -1 to 1 to the opposite side, close to one of its diagonals.
fn diagonal(random: &mut Random) -> [Vec3; 2] {
    let corner = [0.8, 0.8, 0.8].map(|at: f32| if random.unit() < 0.5 { -at } else { at });
    let jitter = |random: &mut Random| random.within(Vec3::splat(-0.2), Vec3::splat(0.2));
    let corner = Vec3::from_array(corner);
    [corner + jitter(random), -corner + jitter(random)]
}

fn judge(stage: &mut Stage<'_>, name: &str, scene: &Scene, pixels: u32) -> Result<(), StressError> {
    let mut settings = view(pixels);
    settings.max_depth = 4;
    let rendered = stage.render(scene, &settings)?;
    let background = rendered.film.radiance[0];
    let seen = rendered.film.radiance.iter();
    let share = seen.filter(|rgb| **rgb != background).count() as f64 / f64::from(pixels * pixels);
    let judged = judge_picture(scene, &settings, &rendered.film, TOLERANCE);
    let note = format!(
        "{:.2} % of the pixels within {TOLERANCE}, {} iterations",
        100.0 * judged.near_share,
        rendered.iterations
    );
    stage.record_with(
        format!("{name}, by the oracle"),
        judged.worst,
        Limit::AtMost(TOLERANCE),
        note,
    );
    stage.record(
        format!("{name}: share of pixels unlike the first, so that there is something to see"),
        share,
        Limit::AtLeast(0.25),
    );
    stage.record(
        format!("{name}: share of pixels near the oracle's"),
        judged.near_share,
        Limit::AtLeast(0.98),
    );
    Ok(())
}

/// One triangle, and none.
fn next_to_nothing(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let background = [0.0, 0.5, 0.25];
    let mut build = Build::before(background);
    let seen = lamp(&mut build, [0.75, 0.0, 0.0]);
    let empty = build.0.clone();
    add(&mut build, TRIANGLE, seen);
    let settings = view(32);
    let one = stage.render(&build.0, &settings)?;
    let judged = judge_picture(&build.0, &settings, &one.film, TOLERANCE);
    stage.record(
        "one triangle, by the oracle",
        judged.worst,
        Limit::AtMost(TOLERANCE),
    );
    stage.record(
        "one triangle: node visits and triangle tests of a ray",
        steps(&one) / f64::from(32 * 32),
        Limit::AtMost(2.0),
    );
    let none = stage.render(&empty, &settings)?;
    let wrong = none
        .film
        .radiance
        .iter()
        .filter(|rgb| !is_one_of(**rgb, &[background.map(f64::from)]));
    stage.record(
        "no triangle: pixels that are not the background",
        wrong.count() as f64,
        Limit::AtMost(0.0),
    );
    // The root has no children then, and is all that a ray visits.
    stage.record(
        "no triangle: node visits and triangle tests of a ray",
        steps(&none) / none.film.pixel_count() as f64,
        Limit::AtMost(1.0),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_color_is_noticed() {
        let colors = [[0.75, 0.0, 0.0], [0.0, 0.0, 0.25]];
        assert!(is_one_of([0.75, 0.0, 0.0], &colors) && is_one_of([0.0, 0.0, 0.25], &colors));
        assert!(!is_one_of([0.0, 0.75, 0.0], &colors));
        assert!(!is_one_of([0.75, 0.0, 0.25], &colors));
        assert!(!is_one_of([f32::NAN, 0.0, 0.0], &colors));
    }

    #[test]
    fn slivers_have_boxes_of_the_scene_s_size() {
        let mut random = Random::new(17);
        for _ in 0..100 {
            let [from, to] = diagonal(&mut random);
            assert!((to - from).abs().min_element() > 1.0);
        }
    }
}
