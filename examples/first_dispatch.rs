//! How long until a device has done the first dispatch of a file, against what obvhs takes to build a hierarchy of its triangles and
//! the system to read it: `cargo run --release --example first_dispatch -- scene.glb`. In turn, so that other work on the
//! machine slows down both; compiling happens in the first round, which does not count.
#![allow(clippy::print_stdout, reason = "a program for people")]

use std::{
    env, fs,
    path::Path,
    time::{Duration, Instant},
};

use anyhow::Context;
use glam::Vec3A;
use obvhs::{BvhBuildParams, cwbvh::builder::build_cwbvh_from_tris, triangle::Triangle};
use raytree::{Device, DeviceChoice, Preset, RenderSettings, Scene};

/// Rounds that count, behind one that warms up.
const ROUNDS: usize = 12;

fn main() -> anyhow::Result<()> {
    let path = env::args().nth(1).context("usage: first_dispatch SCENE")?;
    let path = Path::new(&path);
    let device = Device::open(&DeviceChoice::default())?;
    let triangles = padded(&raytree::import(path)?);
    println!("{} triangles; times in ms", triangles.len());
    println!("obvhs  read  import  features  BVH  program and upload  first dispatch  ratio");
    let mut rounds = Vec::new();
    for round in 0..=ROUNDS {
        let mut obvhs = Duration::ZERO;
        build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut obvhs);
        let (_, read) = timed(|| fs::read(path));
        let ours = Start::of(&device, path)?;
        let total = ours.total().saturating_sub(read);
        let parts = [
            ours.import,
            ours.features,
            ours.bvh,
            ours.program,
            ours.dispatch,
        ];
        let row = [obvhs, read].into_iter().chain(parts);
        let row: Vec<String> = row
            .map(|time| format!("{:.0}", 1e3 * time.as_secs_f64()))
            .collect();
        println!("{}  {:.2}", row.join("  "), times(total, obvhs));
        if round > 0 {
            rounds.push((total, obvhs));
        }
    }
    summarise(&rounds);
    Ok(())
}

/// Of each round our time, reading left out, and obvhs'.
fn summarise(rounds: &[(Duration, Duration)]) {
    let mut ratios: Vec<f64> = rounds
        .iter()
        .map(|&(ours, obvhs)| times(ours, obvhs))
        .collect();
    ratios.sort_by(f64::total_cmp);
    let (least, most) = (ratios[0], ratios[ratios.len() - 1]);
    let median = ratios[ratios.len() / 2];
    let ours = rounds.iter().map(|round| round.0).min().unwrap_or_default();
    let obvhs = rounds.iter().map(|round| round.1).min().unwrap_or_default();
    let quiet = times(ours, obvhs);
    println!(
        "without reading, times obvhs: median {median:.2}, {least:.2} to {most:.2}; the least times of both {quiet:.2}"
    );
}

fn times(ours: Duration, obvhs: Duration) -> f64 {
    ours.as_secs_f64() / obvhs.as_secs_f64()
}

fn padded(scene: &Scene) -> Vec<Triangle> {
    let geometry = &scene.geometry;
    let corner = |vertex: u32| Vec3A::from(geometry.positions[vertex as usize]);
    let corners = geometry.triangles.iter().map(|t| t.vertices.map(corner));
    corners
        .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
        .collect()
}

/// Where the time until the end of the first dispatch goes.
struct Start {
    import: Duration,
    features: Duration,
    bvh: Duration,
    program: Duration,
    /// With what is left of copying tables.
    dispatch: Duration,
}

impl Start {
    fn of(device: &Device, path: &Path) -> anyhow::Result<Self> {
        let (scene, import) = timed(|| raytree::import(path));
        let mut scene = scene?;
        raytree::light_if_dark(&mut scene);
        let settings = RenderSettings::new(8, 8, raytree::default_camera(&scene));
        let started = Instant::now();
        let rendering = raytree::render(
            device,
            &scene,
            Preset::default(),
            &settings,
            &mut raytree::unobserved,
        )?;
        let (times, bvh) = (rendering.times, rendering.bvh_time);
        Ok(Self {
            import,
            features: started.elapsed() - bvh - times.program - times.compile - times.render,
            bvh,
            program: times.program,
            dispatch: times.compile,
        })
    }

    fn total(&self) -> Duration {
        self.import + self.features + self.bvh + self.program + self.dispatch
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    (work(), started.elapsed())
}
