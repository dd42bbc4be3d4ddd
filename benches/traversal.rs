//! Traversal in WGSL against obvhs's own on the CPU: one hierarchy, the same rays, as many threads, in turn, as ratios of CPU
//! seconds and of wall time. Only the dispatch is timed: rays lie on the device, hits stay there.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::{
    process::Command,
    sync::{Mutex, PoisonError},
    thread,
    time::Instant,
};

use criterion::measurement::Measurement;
use raytree::{Bvh, Device, Numerics, Preset, ProgramFeatures};
use raytree_bvh::CpuTraversal;
use raytree_gpu::{
    Prober,
    types::{ProbeHit, ProbeRay},
};
use support::{
    Effort,
    cpu_time::{CpuTime, of_this_thread},
    rays::{self, Kind, RAYS, Stage},
    summary::{Record, Spread},
};

/// Rays whose hit may differ: two tests of triangles in f32 fall to different sides of an edge.
const OTHER_HITS: f64 = 1e-3;
/// Rays that a thread takes at once: a few of the renderer's tiles.
const CHUNK: usize = 1024;
/// The argument by which this program asks another one of itself how long the driver's compiler takes.
const COMPILE: &str = "--compile-with-cold-cache";

/// What a turn took, seconds.
#[derive(Clone, Copy)]
struct Turn {
    cpu: f64,
    wall: f64,
}

/// One of a turn's times.
type Seconds = fn(&Turn) -> f64;

/// A scene as both sides have it.
struct Sides<'d> {
    stage: Stage,
    prober: Prober<'d>,
    cpu: CpuTraversal,
}

impl<'d> Sides<'d> {
    fn new(device: &'d Device, stage: Stage) -> Self {
        let bvh = hierarchy(&stage);
        Self {
            prober: prober(device, &stage, &bvh),
            cpu: CpuTraversal::new(&bvh, &stage.triangles()),
            stage,
        }
    }

    fn rays(&self, kind: Kind) -> Vec<ProbeRay> {
        match kind {
            Kind::Primary => self.stage.primary(),
            Kind::Incoherent => self.stage.incoherent(),
            _ => {
                let primary = self.stage.primary();
                self.stage.leaving(kind, &primary, &self.hits(&primary))
            }
        }
    }

    fn hits(&self, rays: &[ProbeRay]) -> Vec<ProbeHit> {
        self.prober
            .trace(rays)
            .unwrap_or_else(|error| panic!("{error}"))
    }

    /// The rays that were uploaded.
    fn on_device(&self) -> Turn {
        let (clock, started) = (CpuTime.start(), Instant::now());
        self.prober
            .run(RAYS)
            .unwrap_or_else(|error| panic!("{error}"));
        let wall = started.elapsed().as_secs_f64();
        Turn {
            wall,
            cpu: CpuTime.end(clock) as f64 * 1e-9,
        }
    }

    /// What each ray hits by obvhs, a triangle or none; any but none is the same of a shadow ray.
    fn on_cpu(&self, rays: &[ProbeRay], found: &mut [u32]) -> Turn {
        let started = Instant::now();
        let work = Mutex::new(rays.chunks(CHUNK).zip(found.chunks_mut(CHUNK)));
        let take = || work.lock().unwrap_or_else(PoisonError::into_inner).next();
        let share = || {
            while let Some((rays, found)) = take() {
                for (ray, found) in rays.iter().zip(found) {
                    *found = self.one_on_cpu(ray);
                }
            }
            of_this_thread()
        };
        let run: u64 = thread::scope(|scope| {
            let threads: Vec<_> = (0..threads()).map(|_| scope.spawn(share)).collect();
            let run = threads.into_iter().map(|thread| thread.join());
            run.map(|run| run.unwrap_or_else(|_| panic!("a thread has panicked")))
                .sum()
        });
        Turn {
            wall: started.elapsed().as_secs_f64(),
            cpu: run as f64 * 1e-9,
        }
    }

    fn one_on_cpu(&self, ray: &ProbeRay) -> u32 {
        let (origin, direction) = (ray.origin.into(), ray.direction.into());
        if ray.shadow != 0 {
            return if self.cpu.occluded(origin, direction, ray.t_max) {
                0
            } else {
                u32::MAX
            };
        }
        let hit = self.cpu.closest_hit(origin, direction, ray.t_max);
        hit.map_or(u32::MAX, |hit| hit.triangle)
    }
}

/// Of lavapipe by default, too.
fn threads() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

fn hierarchy(stage: &Stage) -> Bvh {
    raytree::build_bvh(&stage.scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn prober<'d>(device: &'d Device, stage: &Stage, bvh: &Bvh) -> Prober<'d> {
    let features = ProgramFeatures::default();
    Prober::new(device, &stage.scene, bvh, features, Numerics::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

/// How many rays hit something else.
///
/// # Panics
/// If these are more than edges explain, or if next to none hit anything.
fn check(name: &str, kind: Kind, ours: &[ProbeHit], theirs: &[u32]) -> usize {
    let differs = |(ours, theirs): &(&ProbeHit, &u32)| match kind {
        Kind::Shadow => (ours.triangle == u32::MAX) != (**theirs == u32::MAX),
        _ => ours.triangle != **theirs,
    };
    let other = ours.iter().zip(theirs).filter(differs).count();
    let hits = theirs.iter().filter(|hit| **hit != u32::MAX).count();
    assert!(
        other as f64 <= OTHER_HITS * RAYS as f64,
        "{name}: {other} of {RAYS} rays hit something else than on the CPU"
    );
    assert!(
        20 * hits > RAYS,
        "{name}: only {hits} of {RAYS} rays hit anything"
    );
    other
}

fn name(scene: &str, kind: Kind) -> String {
    format!("traversal/{scene}/{}", kind.name())
}

fn wanted_kinds(scene: &str) -> Vec<Kind> {
    let wanted = |kind: &Kind| support::wanted(&name(scene, *kind));
    Kind::ALL.into_iter().filter(wanted).collect()
}

/// Both sides in turn, and what comes of it.
fn compare(scene: &str, sides: &Sides<'_>, kind: Kind, effort: Effort) -> Vec<Record> {
    let name = name(scene, kind);
    let rays = sides.rays(kind);
    let mut found = vec![0; RAYS];
    // Once each, untimed: the driver compiles, memory is touched, results are compared.
    sides.on_cpu(&rays, &mut found);
    let other = check(&name, kind, &sides.hits(&rays), &found);
    let uploaded = sides.prober.upload(&rays);
    uploaded.unwrap_or_else(|error| panic!("{error}"));
    let turns: Vec<(Turn, Turn)> = (0..effort.rounds())
        .map(|_| (sides.on_device(), sides.on_cpu(&rays, &mut found)))
        .collect();
    show(&name, &turns, other);
    records(&name, &turns)
}

fn show_head() {
    println!(
        "{} threads; speeds in millions of rays, ratios are WGSL's to obvhs's: more is better",
        threads()
    );
    println!(
        "{:<29} {:>7} {:>7}   {:<22} {:>7} {:>7}   {:<22} other hits",
        "a CPU second, a second:", "WGSL", "obvhs", "ratio", "WGSL", "obvhs", "ratio"
    );
}

fn show(name: &str, turns: &[(Turn, Turn)], other: usize) {
    let speed = |seconds: fn(&(Turn, Turn)) -> f64| {
        1e-6 * RAYS as f64 / Spread::of(turns.iter().map(seconds)).median
    };
    let ratio = |of: Seconds| {
        let ratio = Spread::of(turns.iter().map(|(ours, theirs)| of(theirs) / of(ours)));
        format!(
            "{:.2} ({:.2} to {:.2})",
            ratio.median, ratio.least, ratio.most
        )
    };
    println!(
        "{name:<29} {:>7.2} {:>7.2}   {:<22} {:>7.2} {:>7.2}   {:<22} {other:>6}",
        speed(|(ours, _)| ours.cpu),
        speed(|(_, theirs)| theirs.cpu),
        ratio(|turn| turn.cpu),
        speed(|(ours, _)| ours.wall),
        speed(|(_, theirs)| theirs.wall),
        ratio(|turn| turn.wall),
    );
}

fn records(name: &str, turns: &[(Turn, Turn)]) -> Vec<Record> {
    let extra = format!("{RAYS} rays, {} rounds", turns.len());
    let nanoseconds = 1e9 / RAYS as f64;
    let ours = |of: Seconds| Spread::of(turns.iter().map(|(ours, _)| nanoseconds * of(ours)));
    let costs = |of: Seconds| Spread::of(turns.iter().map(|(ours, theirs)| of(ours) / of(theirs)));
    let (cpu, wall): (Seconds, Seconds) = (|turn| turn.cpu, |turn| turn.wall);
    vec![
        ours(cpu).record(&format!("{name}/cpu"), "CPU ns a ray", &extra),
        ours(wall).record(&format!("{name}/wall"), "ns a ray", &extra),
        costs(cpu).record(&format!("{name}/cpu of obvhs"), "x", &extra),
        costs(wall).record(&format!("{name}/wall of obvhs"), "x", &extra),
    ]
}

/// Milliseconds of the first dispatch less those of a second one, of a workgroup's rays: what the driver takes to compile.
fn compile(device: &Device) -> f64 {
    let stage = rays::spheres();
    let prober = prober(device, &stage, &hierarchy(&stage));
    let rays = &stage.primary()[..64];
    let once = || {
        let started = Instant::now();
        prober.trace(rays).unwrap_or_else(|error| panic!("{error}"));
        started.elapsed().as_secs_f64() * 1e3
    };
    let first = once();
    first - once()
}

/// The same in a process whose driver finds nothing in its cache.
fn compile_with_cold_cache() -> f64 {
    let program = std::env::current_exe().unwrap_or_else(|error| panic!("{error}"));
    let output = Command::new(program)
        .arg(COMPILE)
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .output()
        .unwrap_or_else(|error| panic!("{error}"));
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().last().and_then(|line| line.parse().ok());
    last.unwrap_or_else(|| {
        panic!(
            "{COMPILE}: {text}{}",
            String::from_utf8_lossy(&output.stderr)
        )
    })
}

fn measure_compiling(effort: Effort) -> Option<Record> {
    let name = "traversal/compile";
    support::wanted(name).then(|| {
        let count = effort.rounds().min(3);
        let times = Spread::of((0..count).map(|_| compile_with_cold_cache()));
        println!(
            "{name:<29} {:>7.0} ms ({:.0} to {:.0})",
            times.median, times.least, times.most
        );
        times.record(name, "ms", "first dispatch, driver's cache off")
    })
}

fn main() {
    let device = support::device();
    if std::env::args().any(|argument| argument == COMPILE) {
        println!("{}", compile(&device));
        return;
    }
    if !support::cpu_time::available_for("traversal") {
        return;
    }
    let effort = Effort::chosen();
    show_head();
    let mut records = Vec::new();
    for (scene, stage) in rays::STAGES {
        let kinds = wanted_kinds(scene);
        if !kinds.is_empty() {
            let sides = Sides::new(&device, stage());
            let compared = kinds
                .into_iter()
                .map(|kind| compare(scene, &sides, kind, effort));
            records.extend(compared.flatten());
        }
    }
    records.extend(measure_compiling(effort));
    support::leave("traversal", &records);
}
