//! What robustness costs: traversal and frames with and without each measure against rounding, in turn, as ratios of CPU
//! seconds. Criterion compares with earlier runs; here the variants run side by side, so that what else the machine does
//! hits all of them.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use criterion::measurement::Measurement;
use glam::Vec3;
use raytree::{
    Bvh, Device, Numerics, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures,
};
use raytree_gpu::{
    Prober,
    types::{ProbeHit, ProbeRay},
};
use raytree_stress::{BOOK_TOLERANCE, meshes, random::Random};
use support::{
    Effort, Expected,
    cpu_time::CpuTime,
    summary::{Record, Spread},
};

/// Rays of a traversal.
const RAYS: usize = 1 << 19;
/// Rays whose hit may differ by variant: at edges, and through the cracks that some leave.
const OTHER_HITS: f64 = 1e-3;

const WIDTH: u32 = 256;
const HEIGHT: u32 = 192;

/// All, all but one, none.
fn variants() -> [(&'static str, Numerics); 5] {
    let all = Numerics::default();
    [
        ("all", all),
        (
            "no padding",
            Numerics {
                padded_boxes: false,
                ..all
            },
        ),
        (
            "no edge functions",
            Numerics {
                watertight: false,
                ..all
            },
        ),
        (
            "no error bounds",
            Numerics {
                error_bounds: false,
                tolerance: BOOK_TOLERANCE,
                ..all
            },
        ),
        ("the book", Numerics::book(BOOK_TOLERANCE)),
    ]
}

/// CPU seconds of each variant, round by round.
fn rounds(count: usize, mut run: impl FnMut(usize)) -> Vec<Vec<f64>> {
    let clock = CpuTime;
    let mut seconds = vec![Vec::new(); variants().len()];
    for _ in 0..count {
        for (variant, seconds) in seconds.iter_mut().enumerate() {
            let start = clock.start();
            run(variant);
            seconds.push(clock.end(start) as f64 * 1e-9);
        }
    }
    seconds
}

/// Of each variant the median ratio to all measures, and the smallest and largest; for the summary, what all measures cost against
/// it.
fn show(subject: &str, seconds: &[Vec<f64>]) -> Vec<Record> {
    let all = &seconds[0];
    let each = variants().into_iter().zip(seconds).map(|((name, _), own)| {
        let ratio = Spread::of(own.iter().zip(all).map(|(own, all)| own / all));
        println!(
            "{subject:<24} {name:<18} {:>8.3} s   {:.3} ({:.3} to {:.3})",
            Spread::of(own.iter().copied()).median,
            ratio.median,
            ratio.least,
            ratio.most,
        );
        let cost = Spread::of(own.iter().zip(all).map(|(own, all)| all / own));
        let name = format!("numerics/{subject}/all against {name}");
        cost.record(&name, "x", &format!("CPU seconds, {} rounds", own.len()))
    });
    // All against all is 1.
    each.skip(1).collect()
}

/// From inside a mesh to anywhere.
fn rays(mesh: &meshes::Mesh) -> Vec<ProbeRay> {
    let mut random = Random::new(3);
    let mut ray = || ProbeRay {
        origin: mesh.inside(&mut random).to_array(),
        t_max: 1e30,
        direction: random.direction().to_array(),
        shadow: 0,
    };
    (0..RAYS).map(|_| ray()).collect()
}

fn traversal(device: &Device, count: usize, mesh: &meshes::Mesh) -> Vec<Record> {
    let scene = &mesh.scene;
    let bvh = bvh(scene);
    let rays = rays(mesh);
    let probers: Vec<Prober<'_>> = variants()
        .into_iter()
        .map(|(_, numerics)| {
            let features = ProgramFeatures::default();
            Prober::new(device, scene, &bvh, features, numerics)
                .unwrap_or_else(|error| panic!("{error}"))
        })
        .collect();
    let trace = |variant: usize| {
        let hits = probers[variant].trace(&rays);
        hits.unwrap_or_else(|error| panic!("{error}"))
    };
    let expected: Vec<ProbeHit> = trace(0);
    let seconds = rounds(count, |variant| {
        let hits = trace(variant);
        let other = |(a, b): &(&ProbeHit, &ProbeHit)| a.triangle != b.triangle;
        let other = hits.iter().zip(&expected).filter(other).count();
        assert!(
            other as f64 <= OTHER_HITS * RAYS as f64,
            "{}: {other} other hits",
            variants()[variant].0
        );
    });
    show(
        &format!("traversal, {}", scene.geometry.triangles.len()),
        &seconds,
    )
}

fn frame(device: &Device, count: usize, file: &'static str) -> Vec<Record> {
    let scene = support::scene(file);
    let bvh = bvh(&scene);
    let settings = RenderSettings::new(WIDTH, HEIGHT, raytree::default_camera(&scene));
    let expected = Expected::new(&scene, &settings);
    let render = |variant: usize| {
        let settings = RenderSettings {
            numerics: variants()[variant].1,
            ..settings.clone()
        };
        let features = ProgramFeatures::of(&SceneFeatures::of(&scene), &settings);
        let rendered = raytree_gpu::render_with(
            device,
            &scene,
            &bvh,
            &settings,
            features,
            &mut raytree::unobserved,
        );
        rendered.unwrap_or_else(|error| panic!("{error}"))
    };
    // The driver compiles.
    (0..variants().len()).for_each(|variant| drop(render(variant)));
    let seconds = rounds(count, |variant| {
        expected.check(&render(variant).film);
    });
    show(&format!("frame, {}", support::stem(file)), &seconds)
}

fn bvh(scene: &Scene) -> Bvh {
    raytree::build_bvh(scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn main() {
    if !support::cpu_time::available_for("numerics") {
        return;
    }
    let count = Effort::chosen().rounds();
    let device = support::device();
    let ball = meshes::ellipsoid("a ball", Vec3::ZERO, Vec3::ONE, 100);
    let terrain = meshes::terrain_box("a terrain", 160, 0.02);
    let mut records = Vec::new();
    for mesh in [&ball, &terrain] {
        records.extend(traversal(&device, count, mesh));
    }
    for file in ["cornell.glb", "whitted-1980.glb"] {
        records.extend(frame(&device, count, file));
    }
    support::leave("numerics", &records);
}
