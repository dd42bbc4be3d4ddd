//! How long until a device renders the first ray of a file, against what obvhs takes to build a hierarchy of its triangles and
//! the system to read it: `cargo run --release --example first_dispatch -- scene.glb`. In turn, so that other work on the
//! machine slows down both.
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

/// Rounds; the first one warms up and does not count.
const ROUNDS: usize = 6;

fn main() -> anyhow::Result<()> {
    let path = env::args().nth(1).context("usage: first_dispatch SCENE")?;
    let path = Path::new(&path);
    let device = Device::open(&DeviceChoice::default())?;
    let triangles = padded(&raytree::import(path)?);
    println!("{} triangles; times in ms", triangles.len());
    println!("obvhs  read  import  features  BVH  program and upload  ratio");
    let mut ratios = Vec::new();
    for round in 0..ROUNDS {
        let mut obvhs = Duration::ZERO;
        build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut obvhs);
        let (_, read) = timed(|| fs::read(path));
        let ours = Start::of(&device, path)?;
        let ratio = (ours.total() - read).as_secs_f64() / obvhs.as_secs_f64();
        let row = [
            obvhs,
            read,
            ours.import,
            ours.features,
            ours.bvh,
            ours.program,
        ];
        let row = row.map(|time| format!("{:.0}", 1e3 * time.as_secs_f64()));
        println!("{}  {ratio:.2}", row.join("  "));
        if round > 0 {
            ratios.push(ratio);
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (least, most) = (ratios[0], ratios[ratios.len() - 1]);
    let median = ratios[ratios.len() / 2];
    println!("without reading, times obvhs: median {median:.2}, {least:.2} to {most:.2}");
    Ok(())
}

fn padded(scene: &Scene) -> Vec<Triangle> {
    let geometry = &scene.geometry;
    let corner = |vertex: u32| Vec3A::from(geometry.positions[vertex as usize]);
    let corners = geometry.triangles.iter().map(|t| t.vertices.map(corner));
    corners
        .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
        .collect()
}

/// Where the time until the first dispatch goes, that to compile apart.
struct Start {
    import: Duration,
    features: Duration,
    bvh: Duration,
    program: Duration,
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
        })
    }

    fn total(&self) -> Duration {
        self.import + self.features + self.bvh + self.program
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    (work(), started.elapsed())
}
