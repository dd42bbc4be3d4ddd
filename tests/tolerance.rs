//! Pictures to a tolerance: it is kept, the estimate of the error is above the error, what decides it is the same every time, and what is
//! left out of ray trees is bounded. The judge is a reference that is made in another way (kept in tests/tolerance/, made anew by
//! `RAYTREE_BLESS=1 cargo test --test tolerance`), the oracle, and answers on paper. More scenes, and those that take long:
//! `RAYTREE_BENCH=full cargo bench --bench tolerance -- kept`.
#![allow(clippy::print_stdout, reason = "what a test says is read by people")]

mod support;

#[path = "support/alike.rs"]
mod alike;
#[path = "support/everything.rs"]
mod everything;
#[path = "support/reference.rs"]
mod reference;

use std::path::Path;

use alike::{Alike, Words};
use everything::{everything, filled};
use glam::{DVec3, Vec3};
use raytree::{
    Device, Film, Picture, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures,
    Tolerance,
    model::{Camera, Material, Projection},
};
use raytree_oracle::{Oracle, Settings};
use raytree_stress::random::Random;
use raytree_stress::scenes::{Build, clear_glass, matte, parallel, pinhole};
use reference::{Reference, rmse};

const SIZE: (u32, u32) = (64, 48);

/// Of these the smallest tolerance takes longer than a test may: the bench has it.
const SLOW: [&str; 4] = ["everything", "glass-in-water", "materials", "whitted-1980"];

fn scene(path: &Path) -> Scene {
    let mut scene = support::import(path);
    raytree::light_if_dark(&mut scene);
    scene
}

fn own(name: &str) -> Scene {
    scene(&support::root().join("assets").join(name))
}

fn base(scene: &Scene) -> RenderSettings {
    RenderSettings::new(SIZE.0, SIZE.1, support::camera(scene))
}

fn to(scene: &Scene, tolerance: f32) -> RenderSettings {
    base(scene).to_tolerance(Tolerance::absolute(tolerance))
}

/// What a scene's pictures are held against: made by the renderer without any tolerance (`support/reference.rs`).
fn reference(device: &Device, name: &str, scene: &Scene) -> Reference {
    let folder = support::root().join("tests/tolerance");
    if support::blessing() {
        Reference::make(device, scene, &base(scene)).write(&folder, name);
    }
    Reference::read(&folder, name).unwrap_or_else(|| panic!("tests/tolerance/{name}.exr is gone"))
}

fn error_of(reference: &Reference, film: &Film) -> f64 {
    rmse(&reference.picture, &Picture::from(film))
}

/// Of every scene of ours: within the tolerance, and not by luck; the estimate above the error, and not far above in the mean.
#[test]
fn tolerances_are_kept_and_estimates_are_above_the_error() {
    let Some(device) = support::device() else {
        return;
    };
    let mut ratios = Vec::new();
    for path in support::own_scenes() {
        let (name, scene) = (support::stem(&path), scene(&path));
        let reference = reference(device, &name, &scene);
        for tolerance in [0.1_f32, 0.01, 0.001] {
            if tolerance < 0.01 && SLOW.contains(&name.as_str()) {
                continue;
            }
            let rendering = support::render(device, &scene, &to(&scene, tolerance));
            let report = rendering.error.expect("a tolerance was asked for");
            let error = error_of(&reference, &rendering.film);
            assert!(
                reference.tells(error),
                "{name} {tolerance}: the reference does not tell {error}"
            );
            let ratio = report.estimated_rmse / error;
            println!(
                "{name} {tolerance}: off by {error:.5}, estimated {:.5} (x{ratio:.2}), {:.1} samples a pixel",
                report.estimated_rmse,
                report.samples as f64 / f64::from(SIZE.0 * SIZE.1),
            );
            assert!(report.keeps_tolerance(), "{name} {tolerance}: {report:?}");
            assert!(
                error <= f64::from(tolerance),
                "{name} {tolerance}: off by {error}"
            );
            assert!(ratio >= 1.0, "{name} {tolerance}: {ratio}");
            ratios.push(ratio);
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!(
        "{} pictures, estimate over error {mean:.2} in the mean",
        ratios.len()
    );
    assert!(mean <= 5.0, "{mean}");
    assert!(!support::blessing(), "references were made anew");
}

/// A smaller tolerance is another picture, and a better one: or the test above would say nothing.
#[test]
fn one_sample_a_pixel_keeps_no_small_tolerance() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = own("book.glb");
    let reference = reference(device, "book", &scene);
    let plain = support::render(device, &scene, &base(&scene));
    assert!(error_of(&reference, &plain.film) > 0.01);
    let few = RenderSettings {
        samples: 1,
        ..to(&scene, 0.01)
    };
    let report = support::render(device, &scene, &few)
        .error
        .expect("asked for");
    assert!(!report.keeps_tolerance(), "{report:?}");
}

#[test]
fn the_same_tolerance_gives_the_same_bytes_in_batches_of_any_size() {
    let Some(device) = support::device() else {
        return;
    };
    for name in ["book.glb", "cards.gltf", "glass-in-water.glb"] {
        let scene = own(name);
        let of = |batch_pixels| {
            let settings = RenderSettings {
                batch_pixels: Some(batch_pixels),
                ..to(&scene, 0.03)
            };
            Words::of(&support::render(device, &scene, &settings).film)
        };
        let whole = of(1 << 16);
        for batch in [1, 640, 4096] {
            let found = Alike::Equal.difference(&whole, &of(batch));
            assert_eq!(found, None, "{name}: batches of {batch}");
        }
    }
}

#[test]
fn what_the_program_could_do_besides_changes_nothing() {
    let Some(device) = support::device() else {
        return;
    };
    for name in ["book.glb", "cards.gltf", "cornell.glb"] {
        let scene = own(name);
        let settings = to(&scene, 0.05);
        let special = ProgramFeatures::of(&SceneFeatures::of(&scene), &settings);
        let render = |scene: &Scene, features| {
            let rendering = raytree::render_with_features(
                device,
                scene,
                Preset::default(),
                &settings,
                features,
                &mut raytree::unobserved,
            );
            rendering.unwrap_or_else(|error| panic!("{error}"))
        };
        let all = everything(&settings, special);
        let general = render(&filled(scene.clone()), all);
        let special = render(&scene, special);
        let judge = Alike::on(device);
        let found = judge.difference(&Words::of(&general.film), &Words::of(&special.film));
        assert_eq!(found, None, "{name}");
        let counted = judge.counted(general.counters, special.counters);
        assert_eq!(counted, None, "{name}");
    }
}

/// Dark pixels are no worse off by a share of their own radiance.
#[test]
fn a_relative_tolerance_looks_at_each_pixel() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = own("cornell.glb");
    let relative = base(&scene).to_tolerance(Tolerance::relative(0.02));
    let rendering = support::render(device, &scene, &relative);
    let report = rendering.error.expect("asked for");
    assert!(report.keeps_tolerance(), "{report:?}");
    let reference = reference(device, "cornell", &scene);
    let pairs = reference
        .picture
        .rgb
        .iter()
        .flatten()
        .zip(rendering.film.radiance.iter().flatten());
    let squares = pairs.map(|(a, b)| (f64::from(a - b) / (f64::from(*a) + 0.01)).powi(2));
    let root = (squares.sum::<f64>() / (3.0 * reference.picture.rgb.len() as f64)).sqrt();
    println!("relative error {root:.4}, {report:?}");
    assert!(root <= 0.02, "{root}");
}

/// Mirrors of this reflectance that face each other, each of radiance 1 (as in the stress suite).
fn facing_mirrors(reflectance: f32) -> Scene {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(Material {
        metallic: 1.0,
        roughness: 0.0,
        emissive: Vec3::ONE,
        ..matte([reflectance; 3])
    });
    build.square(Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z, 0.5, material);
    build.square(Vec3::new(0.0, 0.0, -0.5), Vec3::Z, 0.5, material);
    build.0
}

/// The series ends where what is left of it does not matter, long before the limit, and what is said of it is true.
#[test]
fn facing_mirrors_end_by_themselves() {
    const LIMIT: u32 = 4000;
    let Some(device) = support::device() else {
        return;
    };
    let scene = facing_mirrors(0.99);
    let camera = pinhole(Vec3::ZERO, Vec3::Z, 2e-4);
    let settings = RenderSettings {
        max_depth: LIMIT,
        max_rays: 1 << 16,
        counters: true,
        ..RenderSettings::new(16, 16, camera).to_tolerance(Tolerance::absolute(1e-3))
    };
    let rendering = support::render(device, &scene, &settings);
    let report = rendering.error.expect("asked for");
    let exact = 1.0 / (1.0 - f64::from(0.99_f32));
    let radiance = rendering.film.radiance.iter().flatten();
    let squares = radiance.map(|&value| (f64::from(value) - exact).powi(2));
    let error = (squares.sum::<f64>() / 768.0).sqrt();
    let counters = rendering.counters.expect("counted");
    let levels = counters.rays.reflection as f64 / counters.rays.primary as f64;
    println!(
        "off by {error:.6}, estimated {:.6}, {levels:.0} levels",
        report.estimated_rmse
    );
    assert_eq!(counters.ended.depth + counters.ended.budget, 0);
    assert!(levels < 0.5 * f64::from(LIMIT), "{levels}");
    assert!(
        error <= 1e-3 && report.keeps_tolerance(),
        "{error} {report:?}"
    );
}

/// A hundred thin panes before a lamp, seen at normal incidence (as in the stress suite): their transmittance is Stokes' (1862).
#[test]
fn a_hundred_panes_end_by_themselves() {
    const PANES: u16 = 100;
    const IOR: f32 = 1.05;
    let Some(device) = support::device() else {
        return;
    };
    let mut build = Build::before([0.0; 3]);
    let pane = build.material(Material {
        volume: None,
        double_sided: true,
        ..clear_glass(IOR)
    });
    let lamp = build.material(Material {
        emissive: Vec3::ONE,
        specular: 0.0,
        ..matte([0.0; 3])
    });
    for k in 0..PANES {
        let depth = -0.5 + f32::from(k) / f32::from(PANES);
        build.square(Vec3::new(0.0, 0.0, depth), Vec3::Z, 0.5, pane);
    }
    build.square(Vec3::new(0.0, 0.0, -0.8), Vec3::Z, 0.5, lamp);
    let from = Vec3::new(0.1, 0.05, 2.0);
    let camera = parallel(from, from - 4.0 * Vec3::Z, 1e-6);
    let settings = RenderSettings {
        max_depth: 1000,
        max_rays: 1 << 21,
        counters: true,
        ..RenderSettings::new(2, 2, camera).to_tolerance(Tolerance::absolute(1e-3))
    };
    let rendering = support::render(device, &build.0, &settings);
    let r = ((f64::from(IOR) - 1.0) / (f64::from(IOR) + 1.0)).powi(2);
    let exact = (1.0 - r) / (1.0 + (f64::from(PANES) - 1.0) * r);
    let seen = f64::from(rendering.film.radiance[0][0]);
    let report = rendering.error.expect("asked for");
    let counters = rendering.counters.expect("counted");
    let rays = counters.rays.total() as f64 / counters.rays.primary as f64;
    println!(
        "{seen:.6} of {exact:.6}, estimated {:.6}, {rays:.0} rays a sample",
        report.estimated_rmse
    );
    assert_eq!(counters.ended.depth + counters.ended.budget, 0);
    assert!(
        (seen - exact).abs() <= 1e-3 && report.keeps_tolerance(),
        "{seen} {exact} {report:?}"
    );
}

/// Nothing is left out of a scene whose trees are of one ray, and its program has none of it (`tests/shaders.rs`).
#[test]
fn a_diffuse_scene_takes_as_many_rays_as_without() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = own("cornell.glb");
    let count = |settings: RenderSettings| {
        let settings = RenderSettings {
            counters: true,
            ..settings
        };
        support::render(device, &scene, &settings)
            .counters
            .expect("counted")
            .rays
    };
    let plain = count(base(&scene));
    let coarse = count(to(&scene, 10.0));
    assert_eq!(coarse.primary, plain.primary);
    assert!(coarse.shadow <= plain.shadow);
}

/// What pilots show must not make branches worth nothing that weigh much: the floor mirrors next to nothing of the dark, but the ball
/// shows the wall behind the camera.
#[test]
fn faint_reflections_of_the_dark_make_no_mirror_black() {
    let Some(device) = support::device() else {
        return;
    };
    let mut build = Build::before([0.0; 3]);
    let floor = build.material(Material {
        roughness: 0.0,
        ..matte([0.5; 3])
    });
    let mirror = build.material(Material {
        metallic: 1.0,
        roughness: 0.0,
        ..matte([0.9; 3])
    });
    let wall = build.material(Material {
        emissive: Vec3::ONE,
        specular: 0.0,
        ..matte([0.0; 3])
    });
    build.square(Vec3::new(0.0, 0.0, -0.5), Vec3::Z, 0.5, floor);
    build.square(Vec3::new(0.0, 0.0, -0.4), Vec3::Z, 0.03, mirror);
    // Behind the camera, and narrow: only the mirror in the middle sees it.
    build.square(Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z, 0.04, wall);
    build.light(
        raytree::model::LightKind::Directional {
            direction: DVec3::NEG_Z,
        },
        0.5,
    );
    let camera = pinhole(Vec3::new(0.0, 0.0, 0.3), Vec3::NEG_Z, 1.0);
    for tolerance in [0.2, 0.05] {
        let settings = RenderSettings::new(64, 64, camera.clone())
            .to_tolerance(Tolerance::absolute(tolerance));
        let rendering = support::render(device, &build.0, &settings);
        let middle = rendering.film.radiance[32 * 64 + 32][0];
        assert!(middle > 0.7, "{tolerance}: the mirror shows {middle}");
    }
}

/// A lamp in the very place of a surface: there is no bound of what it lights, but what computers take for one.
#[test]
fn a_lamp_on_a_surface_leaves_numbers_numbers() {
    let Some(device) = support::device() else {
        return;
    };
    let mut build = Build::before([0.2; 3]);
    let shiny = build.material(Material {
        roughness: 0.2,
        ..matte([0.5; 3])
    });
    build.square(Vec3::new(0.0, 0.0, -0.5), Vec3::Z, 0.5, shiny);
    build.light(
        raytree::model::LightKind::Point {
            position: DVec3::new(0.1, 0.1, -0.5),
            range: f64::INFINITY,
        },
        1.0,
    );
    let camera = pinhole(Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z, 1.0);
    let settings = RenderSettings {
        samples: 17,
        ..RenderSettings::new(64, 48, camera).to_tolerance(Tolerance::absolute(0.1))
    };
    let report = support::render(device, &build.0, &settings)
        .error
        .expect("asked for");
    assert!(
        report.estimated_rmse.is_finite() && report.lost_rmse.is_finite(),
        "{report:?}"
    );
}

/// Cameras anywhere in the scene, looking anywhere: no ray brings more than the bound says, under either model.
#[test]
fn no_ray_brings_more_than_the_bound() {
    use raytree_oracle::Shading::{Pbr, Whitted};
    let mut random = Random::new(7);
    for path in support::own_scenes() {
        let scene = scene(&path);
        let oracle = Oracle::new(&scene);
        let (min, max) = scene.geometry.bounds().expect("own scenes have triangles");
        for shading in [Pbr, Whitted] {
            let settings = RenderSettings {
                shading: match shading {
                    Pbr => raytree::Shading::Pbr,
                    Whitted => raytree::Shading::Whitted,
                },
                ..base(&scene)
            };
            let bound = raytree_gpu::branch_bound(&scene, &settings).as_dvec3();
            let asked = Settings {
                max_depth: 6,
                shading,
                ..Settings::new(1, 1)
            };
            let mut brightest = DVec3::ZERO;
            for _ in 0..60 {
                let from = random.within(min.as_vec3(), max.as_vec3()).as_dvec3();
                let camera = looking(from, random.direction().as_dvec3().normalize());
                let seen = oracle.radiance(&camera, &asked, 0, 0);
                brightest = brightest.max(DVec3::from(seen));
            }
            println!(
                "{} {shading:?}: {brightest} of {bound}",
                support::stem(&path)
            );
            assert!(brightest.max_element() > 0.0, "nothing was seen");
            if bound == DVec3::ZERO {
                continue; // no surface spawns rays
            }
            assert!(
                brightest.cmple(bound * (1.0 + 1e-6)).all(),
                "{shading:?}: {brightest} of {bound}"
            );
        }
    }
}

fn looking(position: DVec3, forward: DVec3) -> Camera {
    let aside = if forward.y.abs() < 0.9 {
        DVec3::Y
    } else {
        DVec3::X
    };
    let right = forward.cross(aside).normalize();
    Camera {
        name: "anywhere".to_owned(),
        position,
        right,
        up: right.cross(forward),
        forward,
        projection: Projection::Perspective {
            yfov: 1e-3,
            aspect: None,
        },
    }
}
