//! What the benches share: scenes, the device, and the check that what was timed is right.
#![allow(dead_code, reason = "each bench uses a part of it")]

pub mod cpu_time;
pub mod findings;
pub mod frames;
pub mod rays;
pub mod summary;
pub mod turns;

use std::{path::Path, time::Duration};

use criterion::{Criterion, SamplingMode, measurement::Measurement};
use raytree::{Device, DeviceChoice, Film, RenderSettings, Scene};
use raytree_oracle::{Oracle, Settings};

/// Imports a scene of ours by its file's name.
pub fn scene(file: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("assets")
        .join(file);
    let mut scene = raytree::import(&path).unwrap_or_else(|error| panic!("{error}"));
    raytree::light_if_dark(&mut scene);
    scene
}

/// A file's name without its ending: what a bench is called by.
pub fn stem(file: &str) -> &str {
    file.split('.').next().unwrap_or(file)
}

/// The device, which is the CPU's unless `RAYTREE_DEVICE` names another. Numbers of different drivers can't be compared, so
/// it says which it is.
pub fn device() -> Device {
    let choice = std::env::var("RAYTREE_DEVICE")
        .map_or_else(|_| DeviceChoice::default(), |text| text.as_str().into());
    let device = Device::open(&choice).unwrap_or_else(|error| panic!("{error}"));
    println!("device: {} ({})", device.info().name, device.info().driver);
    device
}

/// Cargo's target folder: where results go.
pub fn target() -> &'static Path {
    // Cargo's folder for what tests leave is the one folder in it that it names.
    let inside = Path::new(env!("CARGO_TARGET_TMPDIR"));
    inside.parent().unwrap_or(inside)
}

/// How long all benches may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Each once, to see that it works: cargo's `-- --test`.
    Test,
    /// Two minutes.
    Quick,
    /// Ten.
    Full,
}

impl Effort {
    /// As `RAYTREE_BENCH` says, `quick` or `full`; without it, quick.
    pub fn chosen() -> Self {
        if std::env::args().any(|argument| argument == "--test") {
            return Self::Test;
        }
        match std::env::var("RAYTREE_BENCH").as_deref() {
            Err(_) | Ok("quick") => Self::Quick,
            Ok("full") => Self::Full,
            Ok(other) => panic!("RAYTREE_BENCH is '{other}'; it can be 'quick' or 'full'"),
        }
    }

    /// Rounds of a bench that compares variants in turn.
    pub fn rounds(self) -> usize {
        match self {
            Self::Test => 1,
            Self::Quick => 3,
            Self::Full => 9,
        }
    }

    /// Criterion's measurement time for what deserves `seconds`: a quarter of it, or three times that.
    fn measuring(self, seconds: u64) -> Duration {
        let seconds = Duration::from_secs(seconds);
        match self {
            Self::Test | Self::Quick => seconds / 4,
            Self::Full => 3 * seconds,
        }
    }
}

/// The names on the command line that a bench's name has to contain one of; criterion's options are not for benches that do without
/// it.
pub fn wanted(name: &str) -> bool {
    let arguments: Vec<String> = std::env::args().collect();
    let is_option = |argument: &str| argument.starts_with("--");
    // What follows an option is its value (`--baseline before`), but for those of cargo's that have none.
    let is_name = |pair: &&[String]| {
        !is_option(&pair[1]) && (!is_option(&pair[0]) || ["--test", "--bench"].contains(&&*pair[0]))
    };
    let mut names = arguments
        .windows(2)
        .filter(is_name)
        .map(|pair| &pair[1])
        .peekable();
    names.peek().is_none() || names.any(|part| name.contains(part.as_str()))
}

/// Leaves a bench's figures for the summary, if it has any.
pub fn leave(bench: &str, records: &[summary::Record]) {
    if Effort::chosen() != Effort::Test && !records.is_empty() {
        summary::leave(target(), bench, records).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Few samples of equal size: a bench of a tenth of a second each would else take minutes. `seconds` are what it deserves, for
/// [`Effort`] to make more or less of.
pub fn group<'c, M: Measurement>(
    criterion: &'c mut Criterion<M>,
    name: &str,
    seconds: u64,
) -> criterion::BenchmarkGroup<'c, M> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Effort::chosen().measuring(seconds));
    group
}

/// The oracle's colours at some pixels of a picture: fast wrong pictures must not count.
pub struct Expected {
    pixels: Vec<(usize, [f64; 3])>,
    count: usize,
}

/// Pixels between those that are checked: 48 of 256 x 192.
const STEP: u32 = 32;

/// Of radiance 1, as in `tests/oracle.rs`.
const TOLERANCE: f64 = 1e-3;

/// Share of the checked pixels that may lie on an edge, where f32 and f64 fall to different sides.
const EDGE_SHARE: f64 = 0.05;

impl Expected {
    /// Asks the oracle.
    pub fn new(scene: &Scene, settings: &RenderSettings) -> Self {
        let oracle = Oracle::new(scene);
        let (width, height) = (settings.width, settings.height);
        let wanted = Settings {
            max_depth: settings.max_depth,
            ..Settings::new(width, height)
        };
        let places = (STEP / 2..height).step_by(STEP as usize).flat_map(|y| {
            let across = (STEP / 2..width).step_by(STEP as usize);
            across.map(move |x| (x, y))
        });
        let pixels = places
            .map(|(x, y)| {
                (
                    (y * width + x) as usize,
                    oracle.radiance(&settings.camera, &wanted, x, y),
                )
            })
            .collect();
        Self {
            pixels,
            count: (width * height) as usize,
        }
    }

    /// # Panics
    /// If the film is another picture.
    pub fn check(&self, film: &Film) {
        assert_eq!(film.radiance.len(), self.count);
        let near = |(index, expected): &&(usize, [f64; 3])| {
            let channels = film.radiance[*index].iter().zip(expected);
            channels
                .into_iter()
                .all(|(a, b)| (f64::from(*a) - b).abs() <= TOLERANCE * b.abs().max(1.0))
        };
        let right = self.pixels.iter().filter(near).count();
        let least = (1.0 - EDGE_SHARE) * self.pixels.len() as f64;
        assert!(
            right as f64 >= least,
            "the picture is wrong: only {right} of {} pixels are as the oracle has them",
            self.pixels.len()
        );
        assert!(
            self.pixels
                .iter()
                .any(|(_, color)| color.iter().any(|c| *c > 0.05)),
            "nothing is lit where it is checked"
        );
    }
}
