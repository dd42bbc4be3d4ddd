//! The program as its user meets it: a process from its start to its end, the picture's file written; with an empty cache of
//! compiled programs, and with one that has this scene's.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::{
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use raytree::Picture;
use support::{
    Effort, cpu_time,
    findings::{Bar, Findings},
    summary::Spread,
    turns::{TIMES, Turn},
};

const SCENE: &str = "whitted-1980.glb";
/// Pixels on the picture's side.
const SIDE: u32 = 512;
/// Milliseconds.
const COLD_BAR: Bar = Bar::AtMost(800.0);
const WARM_BAR: Bar = Bar::AtMost(400.0);

/// Renders with this folder for caches.
///
/// # Panics
/// If there is no picture.
fn process(caches: &Path, picture: &Path) -> Turn {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("assets")
        .join(SCENE);
    let (clock, started) = (cpu_time::of_children(), Instant::now());
    let output = Command::new(env!("CARGO_BIN_EXE_raytree"))
        .arg("render")
        .arg(scene)
        .args(["--size", &format!("{SIDE}x{SIDE}"), "--quiet", "-o"])
        .arg(picture)
        .env("XDG_CACHE_HOME", caches)
        .env_remove("MESA_SHADER_CACHE_DIR")
        .env_remove("MESA_SHADER_CACHE_DISABLE")
        .output()
        .unwrap_or_else(|error| panic!("{error}"));
    let wall = started.elapsed().as_secs_f64();
    let cpu = cpu_time::of_children().saturating_sub(clock) as f64 * 1e-9;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    Turn {
        cpu,
        wall,
        ..Turn::default()
    }
}

/// The picture that a process has left.
fn read(path: &Path) -> Picture {
    Picture::read(path).unwrap_or_else(|error| panic!("{error}"))
}

/// Folders that a run uses, gone with it.
struct Folders(tempfile::TempDir);

impl Folders {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap_or_else(|error| panic!("{error}")))
    }

    fn caches(&self) -> PathBuf {
        self.0.path().join("caches")
    }

    fn picture(&self) -> PathBuf {
        self.0.path().join("picture.png")
    }
}

/// With caches that are empty, each time.
fn cold() -> Turn {
    let folders = Folders::new();
    process(&folders.caches(), &folders.picture())
}

/// The bar is for the user's time.
fn show(findings: &mut Findings, name: &str, turns: &[Turn], bar: Bar) {
    let [cpu, wall] = TIMES.map(|(time, of)| {
        let milliseconds = Spread::of(turns.iter().map(|turn| 1e3 * of(turn)));
        let extra = format!("{} rounds", turns.len());
        (
            milliseconds,
            milliseconds.record(&format!("{name}/{time}"), "ms", &extra),
        )
    });
    println!("{name}: {:.0} ms of CPU time", cpu.0.median);
    findings.aside(cpu.1);
    findings.figure(name, wall.0, bar, wall.1);
}

fn main() {
    let rounds = Effort::chosen().rounds();
    let mut findings = Findings::new("start", "milliseconds of a process");
    let [cold_name, warm_name] =
        ["cold", "warm"].map(|cache| format!("start/{}/{cache}", support::stem(SCENE)));
    let folders = Folders::new();
    if support::wanted(&cold_name) {
        let turns: Vec<Turn> = (0..rounds).map(|_| cold()).collect();
        show(&mut findings, &cold_name, &turns, COLD_BAR);
    }
    if support::wanted(&warm_name) {
        let warm = || process(&folders.caches(), &folders.picture());
        warm();
        let first = read(&folders.picture());
        let turns: Vec<Turn> = (0..rounds).map(|_| warm()).collect();
        assert!(read(&folders.picture()).rgb == first.rgb, "another picture");
        show(&mut findings, &warm_name, &turns, WARM_BAR);
    }
    findings.finish();
}
