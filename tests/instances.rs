//! A mesh that nodes share is seen as if each had a copy: traversal, pictures, rays that leave; and the oracle, which knows of no shared
//! meshes, judges it. Nodes turn, mirror, stretch, shear, shrink and enlarge the mesh, and hang below each other.

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

mod support;

#[path = "support/alike.rs"]
mod alike;
#[path = "support/everything.rs"]
mod everything;

use std::{
    f64::consts::TAU,
    fs,
    path::{Path, PathBuf},
};

use alike::{Alike, Words};
use everything::{everything, filled};
use glam::{DMat4, DQuat, DVec3, Vec3, dvec3, dvec4};
use raytree::{
    Feature, ImportOptions, Numerics, Preset, ProgramFeatures, RenderSettings, Scene,
    SceneFeatures, Shading, Sharing, build_bvh,
};
use raytree_assets::{
    gltf::{Container, Gltf, Material, Node},
    shapes::{Shape, cuboid, icosphere, quad},
};
use raytree_gpu::{
    SecondaryProber, probe,
    types::{ProbeRay, SecondaryRay},
};
use raytree_stress::{
    judge::{judge_picture, largest_difference},
    random::Random,
};

/// A file of that scene.
fn written(gltf: Gltf, name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("instances-{name}.glb"));
    let files = gltf.files(Container::Glb);
    fs::write(&path, &files[0].bytes).expect("a writable target folder");
    path
}

/// With shared meshes or copies.
fn import(path: &Path, sharing: Sharing) -> Scene {
    let options = ImportOptions {
        sharing,
        ..ImportOptions::default()
    };
    let mut scene = raytree::import_with(path, &options).unwrap_or_else(|error| panic!("{error}"));
    raytree::light_if_dark(&mut scene);
    scene
}

/// A ball, a box that mirrors, and another mesh below the first, each in nine places, over a floor that mirrors a little, under a lamp
/// and a sun.
fn places() -> Gltf {
    let mut gltf = Gltf::new("places");
    let skin = gltf.material(Material::glossy("skin", [0.8, 0.4, 0.2], 0.5));
    let steel = gltf.material(Material::metal("steel", [0.7, 0.8, 0.9], 0.05));
    let floor = gltf.material(Material::glossy("floor", [0.3, 0.35, 0.3], 0.15));
    let ball = gltf.mesh("ball", &icosphere(6).plain(), skin);
    let block = gltf.mesh("block", &cuboid(dvec3(0.5, 0.3, 0.4)).plain(), steel);
    let wide = quad(DVec3::Z * 14.0, DVec3::X * 14.0).plain();
    let floor = gltf.mesh("floor", &wide, floor);
    gltf.node(Node::new("floor").at(-7.0, -1.2, -7.0).mesh(floor));
    let sheared = DMat4::from_cols(
        dvec4(0.9, 0.5, 0.0, 0.0),
        dvec4(0.3, 0.7, -0.4, 0.0),
        dvec4(0.0, 0.2, 1.1, 0.0),
        dvec4(-2.4, 0.4, -1.0, 1.0),
    );
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.4);
    let lower = gltf.node(
        Node::new("lower")
            .at(0.0, 1.1, 0.3)
            .scaled(0.4, 0.4, -0.4)
            .mesh(block),
    );
    for node in [
        Node::new("plain").at(0.0, 0.0, 0.0).mesh(ball),
        Node::new("turned")
            .at(2.2, 0.0, 0.4)
            .oriented(turn)
            .mesh(block),
        Node::new("mirrored")
            .at(2.0, 0.0, -2.4)
            .oriented(turn)
            .scaled(-1.0, 0.8, 0.9)
            .mesh(ball),
        Node::new("stretched")
            .at(-0.6, -0.4, 2.2)
            .scaled(0.9, 0.3, 0.2)
            .mesh(ball),
        Node::new("sheared").matrix(sheared).mesh(ball),
        Node::new("tiny")
            .at(1.2, -1.1, 2.6)
            .scaled(0.02, 0.02, 0.02)
            .mesh(ball),
        Node::new("huge")
            .at(0.0, 0.0, -30.0)
            .scaled(16.0, 16.0, 16.0)
            .mesh(ball),
        Node::new("upper")
            .at(-2.2, -0.6, 1.6)
            .oriented(turn)
            .scaled(0.8, 0.5, 0.8)
            .mesh(block)
            .children(&[lower]),
    ] {
        gltf.node(node);
    }
    gltf.point_light("lamp", dvec3(-2.0, 5.0, 4.0), [1.0, 0.9, 0.8], 300.0, None);
    gltf.directional_light("sun", dvec3(0.4, -1.0, -0.6), [0.8, 0.9, 1.0], 1.0);
    gltf.perspective("camera", dvec3(0.4, 2.2, 6.0), dvec3(0.0, 0.0, 0.0), 50.0);
    gltf
}

fn features(scene: &Scene, settings: &RenderSettings) -> ProgramFeatures {
    ProgramFeatures::of(&SceneFeatures::of(scene), settings)
}

fn settings(scene: &Scene, shading: Shading) -> RenderSettings {
    let mut settings = RenderSettings::new(160, 120, support::camera(scene));
    settings.shading = shading;
    settings.counters = true;
    settings.aovs = true;
    settings
}

/// Rays from anywhere to anywhere, and from afar.
fn rays(scene: &Scene, count: usize) -> Vec<ProbeRay> {
    let (min, max) = scene.bounds().expect("there are triangles");
    let mut random = Random::new(7);
    let mut point = || {
        let share = dvec3(random.unit(), random.unit(), random.unit());
        (min + share * (max - min)).as_vec3()
    };
    let ray = |k: usize| {
        let (from, to) = (point(), point());
        let from = if k.is_multiple_of(3) {
            3.0 * from
        } else {
            from
        };
        ProbeRay {
            origin: from.to_array(),
            t_max: 1e30,
            direction: (to - from).normalize_or(Vec3::X).to_array(),
            shadow: 0,
        }
    };
    (0..count).map(ray).collect()
}

/// The same triangle at the same distance as among copies; but for rays that pass an edge so closely that rounding decides.
#[test]
fn rays_hit_what_they_would_hit_of_copies() {
    let Some(device) = support::device() else {
        return;
    };
    let shared = import(&written(places(), "hits"), Sharing::Always);
    let copied = shared.copied().into_owned();
    assert_eq!((shared.meshes.len(), shared.instances.len()), (2, 9));
    let rays = rays(&shared, 200_000);
    let trace = |scene: &Scene| {
        let bvh = build_bvh(scene, Preset::default()).expect("few triangles");
        let features = features(scene, &settings(scene, Shading::Pbr));
        probe(device, scene, &bvh, features, &rays).unwrap_or_else(|error| panic!("{error}"))
    };
    let (found, expected) = (trace(&shared), trace(&copied));
    let own = shared.own_triangles() as u32;
    let (mut hits, mut of_meshes, mut others) = (0, 0, 0);
    for ((a, b), ray) in found.iter().zip(&expected).zip(&rays) {
        hits += u32::from(b.triangle != u32::MAX);
        of_meshes += u32::from(b.triangle != u32::MAX && b.triangle >= own);
        if a.triangle != b.triangle {
            others += 1;
            continue;
        }
        let size = 1.0 + Vec3::from(ray.origin).length();
        if a.triangle != u32::MAX {
            let off = (a.t - b.t).abs() / size;
            assert!(off < 1e-4, "{ray:?}: {a:?}, not {b:?}");
        }
    }
    println!("{hits} hits, {of_meshes} of shared meshes, {others} of other triangles");
    assert!(of_meshes > 20_000, "{of_meshes} rays hit a shared mesh");
    assert!(others < 40, "{others} of 200,000 rays hit something else");
}

fn off(a: [f32; 3], b: [f32; 3]) -> f64 {
    let difference = Vec3::from(a).as_dvec3() - Vec3::from(b).as_dvec3();
    difference.length_squared() / 3.0
}

/// Pictures, first-hit layers included, of the same file with shared meshes and with copies.
#[test]
fn pictures_are_those_of_copies() {
    let Some(device) = support::device() else {
        return;
    };
    let file = written(places(), "pictures");
    let shared = import(&file, Sharing::Always);
    let copied = import(&file, Sharing::Never);
    for shading in [Shading::Pbr, Shading::Whitted] {
        let ours = support::render(device, &shared, &settings(&shared, shading));
        let theirs = support::render(device, &copied, &settings(&copied, shading));
        support::write(&ours.film, &format!("instances-{shading:?}.png"));
        assert!(ours.features.has(Feature::Instances) && !theirs.features.has(Feature::Instances));
        let pixels = || ours.film.radiance.iter().zip(&theirs.film.radiance);
        let outliers = pixels().filter(|(a, b)| off(**a, **b) > 1e-6).count();
        let near = pixels()
            .map(|(a, b)| off(*a, *b))
            .filter(|off| *off <= 1e-6);
        let rmse = (near.sum::<f64>() / ours.film.radiance.len() as f64).sqrt();
        let layers = [&ours, &theirs].map(|rendered| rendered.film.aovs.clone().unwrap());
        let ids = layers[0].node_id.iter().zip(&layers[1].node_id);
        let other_nodes = ids.filter(|(a, b)| a != b).count();
        let normals = layers[0]
            .shading_normal
            .iter()
            .zip(&layers[1].shading_normal);
        let other_normals = normals.filter(|(a, b)| off(**a, **b) > 1e-8).count();
        println!(
            "{shading:?}: RMSE {rmse:.2e}, {outliers} outliers, {other_nodes} other nodes, {other_normals} normals"
        );
        assert!(rmse < 1e-5 && outliers < 12 && other_nodes < 8 && other_normals < 8);
        let nodes: std::collections::BTreeSet<u32> = layers[0].node_id.iter().copied().collect();
        assert!(nodes.len() >= 9, "{nodes:?}: nodes are told apart");
    }
}

#[test]
fn the_oracle_agrees() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = import(&written(places(), "oracle"), Sharing::Always);
    for shading in [Shading::Pbr, Shading::Whitted] {
        let settings = settings(&scene, shading);
        let ours = support::render(device, &scene, &settings);
        let judged = judge_picture(&scene, &settings, &ours.film, 1e-3);
        println!(
            "{shading:?}: {:.3} % near, {} outliers, {} not explained",
            100.0 * judged.near_share,
            judged.outliers.len(),
            judged.unexplained.len()
        );
        assert!(
            judged.near_share > 0.999 && judged.unexplained.is_empty(),
            "{:?}",
            judged.unexplained
        );
    }
}

/// By a program that could do more; of a scene with shared meshes, and of one without.
#[test]
fn a_program_with_everything_gives_the_same_picture() {
    let Some(device) = support::device() else {
        return;
    };
    let file = written(places(), "everything");
    for sharing in [Sharing::Always, Sharing::Never] {
        let scene = import(&file, sharing);
        let settings = settings(&scene, Shading::Pbr);
        let special = support::render(device, &scene, &settings);
        let full = filled(scene);
        let bvh = build_bvh(&full, Preset::default()).expect("few triangles");
        let all = everything(&settings, special.features);
        assert!(all.has(Feature::Instances));
        let general = raytree_gpu::render_with(
            device,
            &full,
            &bvh,
            &settings,
            all,
            &mut raytree::unobserved,
        )
        .unwrap_or_else(|error| panic!("{error}"));
        let judge = Alike::on(device);
        let found = judge.difference(&Words::of(&general.film), &Words::of(&special.film));
        assert_eq!(found, None, "{sharing:?}");
        let counted = judge.counted(general.counters, special.counters);
        assert_eq!(counted, None, "{sharing:?}");
    }
}

/// Every ray that leaves a ball outwards leaves it for good, wherever it is and however flat the ray: none begins behind a neighbour of
/// the triangle that it leaves, nor sees one where it is not.
#[test]
fn rays_that_leave_do_not_come_back() {
    let Some(device) = support::device() else {
        return;
    };
    let mut gltf = Gltf::new("leaving");
    let skin = gltf.material(Material::glossy("skin", [0.8, 0.4, 0.2], 0.5));
    let ball = gltf.mesh("ball", &icosphere(5).plain(), skin);
    let mut random = Random::new(3);
    for k in 0..60_i32 {
        let size = 0.3 * 10_f64.powf(-3.0 * random.unit());
        let sides = dvec3(1.0, 1.0, if k % 3 == 0 { 1.0 } else { 0.2 + random.unit() }) * size;
        let place = 2.0 * dvec3(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16));
        let turn = DQuat::from_rotation_x(6.0 * random.unit())
            * DQuat::from_rotation_z(6.0 * random.unit());
        let flip = if k % 2 == 0 { 1.0 } else { -1.0 };
        gltf.node(
            Node::new("ball")
                .at(place.x, place.y, place.z)
                .oriented(turn)
                .scaled(flip * sides.x, sides.y, sides.z)
                .mesh(ball),
        );
    }
    let scene = import(&written(gltf, "leaving"), Sharing::Always);
    assert_eq!(scene.instances.len(), 60);
    let per_instance = (scene.placed_triangles() / 60) as u32;
    let rays: Vec<SecondaryRay> = (0..1_000_000)
        .map(|k| {
            let instance = &scene.instances[k % 60];
            let (min, max) = instance.bounds;
            let outwards = random.direction();
            let middle = 0.5 * (min + max);
            let from = (middle + 0.8 * (max - min).length() * outwards.as_dvec3()).as_vec3();
            let aim = middle + 0.3 * (max - min) * random.direction().as_dvec3();
            // From nearly along the surface to straight up.
            let height = 10_f64.powf(-5.0 * random.unit());
            let (sine, cosine) = (TAU * random.unit()).sin_cos();
            let along = (1.0 - height * height).sqrt();
            SecondaryRay {
                origin: from.to_array(),
                direction: (aim.as_vec3() - from).normalize().to_array(),
                leaving: 1,
                next: dvec3(along * cosine, along * sine, height)
                    .as_vec3()
                    .to_array(),
                ..SecondaryRay::default()
            }
        })
        .collect();
    let bvh = build_bvh(&scene, Preset::default()).expect("few triangles");
    let features = features(&scene, &settings(&scene, Shading::Pbr));
    let prober = SecondaryProber::new(device, &scene, &bvh, features, Numerics::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let hits = prober
        .trace(&rays)
        .unwrap_or_else(|error| panic!("{error}"));
    let (mut left, mut back) = (0, 0);
    for (hit, ray) in hits.iter().zip(&rays) {
        if hit.triangle == u32::MAX {
            continue;
        }
        left += 1;
        let instance = hit.triangle / per_instance;
        if hit.next_triangle != u32::MAX && hit.next_triangle / per_instance == instance {
            back += 1;
            println!("{ray:?}: {hit:?}, {:?}", scene.instances[instance as usize]);
        }
    }
    println!("{left} rays left, {back} came back");
    assert!(left > 800_000);
    assert_eq!(back, 0, "of {left} rays that left a convex mesh");
}

/// Cages one in another, so that a ray has to look into each and takes several iterations: what it was at is kept.
#[test]
fn a_ray_that_takes_several_iterations_is_not_lost() {
    let Some(device) = support::device() else {
        return;
    };
    let mut gltf = Gltf::new("cages");
    let iron = gltf.material(Material::glossy("iron", [0.7, 0.6, 0.5], 0.6));
    let bar = |place: DVec3, half: DVec3| cuboid(half).plain().moved(place.x, place.y, place.z);
    let bars = (0..12).map(|k| {
        let side = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        match k / 4 {
            0 => bar(dvec3(0.0, side(0), side(1)), dvec3(1.0, 0.02, 0.02)),
            1 => bar(dvec3(side(0), 0.0, side(1)), dvec3(0.02, 1.0, 0.02)),
            _ => bar(dvec3(side(0), side(1), 0.0), dvec3(0.02, 0.02, 1.0)),
        }
    });
    let cage: Shape = bars.reduce(Shape::and).expect("twelve bars");
    let cage = gltf.mesh("cage", &cage, iron);
    let mut random = Random::new(5);
    for _ in 0..4000 {
        let [x, y, z] = [(); 3].map(|()| TAU * random.unit());
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, x, y, z);
        let size = 0.5 + 0.1 * random.unit();
        gltf.node(
            Node::new("cage")
                .oriented(turn)
                .scaled(size, size, size)
                .mesh(cage),
        );
    }
    gltf.directional_light("sun", dvec3(0.4, -1.0, -0.6), [1.0; 3], 2.0);
    gltf.perspective("camera", dvec3(0.0, 0.0, 3.0), DVec3::ZERO, 40.0);
    let file = written(gltf, "cages");
    let shared = import(&file, Sharing::Always);
    let copied = import(&file, Sharing::Never);
    let picture = |scene: &Scene| {
        let mut settings = RenderSettings::new(48, 36, support::camera(scene));
        settings.max_depth = 1;
        settings.counters = true;
        support::render(device, scene, &settings)
    };
    let (ours, theirs) = (picture(&shared), picture(&copied));
    let pixels = ours.film.radiance.iter().zip(&theirs.film.radiance);
    let outliers = pixels.filter(|(a, b)| off(**a, **b) > 1e-6).count();
    let iterations = ours.iterations;
    println!(
        "{iterations} iterations; {outliers} of 1728 pixels differ, the worst by {}",
        largest_difference(&ours.film, &theirs.film)
    );
    // A camera ray and a shadow ray, or two that are mirrored, are three iterations.
    assert!(
        ours.features.has(Feature::LongRays) && iterations > 4,
        "no ray takes several iterations"
    );
    assert!(outliers < 20);
}
