//! What a tolerance is worth: whether it is kept, how good the estimate of the error is, and what a picture takes at equal error
//! beside the best of many fixed settings.
//!
//! For each scene a reference is made (the mean of two pictures with different patterns of many samples; kept in the target folder), then
//! pictures at many fixed settings, of which those on the Pareto front count, then pictures at several tolerances. What a fixed setting of
//! a tolerance's own error would take is interpolated between its two neighbours on the front (in the logarithms), which are timed once
//! more in turn with it.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use raytree::{
    Bvh, CompareOptions, Device, Feature, Film, Picture, Preset, ProgramFeatures, RenderSettings,
    Scene, SceneFeatures, Tolerance, WriteOptions, compare,
};
use support::{
    Effort,
    findings::{Bar, Findings},
    frames::{Subject, prepared, rendered},
    summary::Spread,
    turns::{Sides, Turn},
};

const SIZE: (u32, u32) = (128, 96);

const TOLERANCES: [f32; 3] = [1e-1, 1e-2, 1e-3];

const OWN: [&str; 10] = [
    "book.glb",
    "cards.gltf",
    "cornell.glb",
    "critical-prism.glb",
    "everything.glb",
    "facing-mirrors.glb",
    "glass-in-water.glb",
    "materials.gltf",
    "ten-lights.glb",
    "whitted-1980.glb",
];

/// Those that a quick run takes.
const FEW: [&str; 3] = ["book.glb", "cornell.glb", "whitted-1980.glb"];

/// Of scenes that nobody here wrote.
const OTHERS: [&str; 10] = [
    "AlphaBlendModeTest",
    "Avocado",
    "BoxVertexColors",
    "EmissiveStrengthTest",
    "LightsPunctualLamp",
    "MetalRoughSpheresNoTextures",
    "NormalTangentTest",
    "SpecularTest",
    "ToyCar",
    "TransmissionTest",
];

/// Of error, at the same: the mean over our scenes, and any of them.
const MEAN_BAR: Bar = Bar::AtMost(0.7);
const WORST_BAR: Bar = Bar::AtMost(1.1);

/// Of a diffuse scene with a sample a pixel, what ordering it may add.
const DIFFUSE_BAR: Bar = Bar::AtMost(1.03);

/// What both pictures of a reference may take.
const REFERENCE_SECONDS: f64 = 20.0;

/// A tenth of the tolerance takes up to a hundred times as long: it is not tried where a picture takes longer than this.
const LAST_SECONDS: f64 = 0.5;

/// Where a picture takes longer, three rounds are enough.
const LONG_SECONDS: f64 = 0.5;

/// Fixed settings are not tried that take longer.
const LONGEST_SECONDS: f64 = 2.5;

/// A scene with what its pictures are held against.
struct Judged {
    name: String,
    is_ours: bool,
    scene: Scene,
    bvh: Bvh,
    base: RenderSettings,
    reference: Picture,
    /// Root mean square, of the reference itself.
    uncertainty: f64,
}

/// A fixed setting on the front.
#[derive(Clone)]
struct Fixed {
    settings: RenderSettings,
    error: f64,
    seconds: f64,
}

fn main() {
    let effort = Effort::chosen();
    let device = support::device();
    let mut findings = Findings::new(
        "tolerance",
        "to a tolerance, CPU time over that of fixed settings with the same error",
    );
    let mut outcomes = Vec::new();
    for (name, path, is_ours) in scenes(effort) {
        if !support::wanted(&format!("tolerance/{name}")) {
            continue;
        }
        let judged = Judged::new(&device, name, &path, is_ours, effort);
        outcomes.extend(judged.outcomes(&device, effort));
    }
    if !outcomes.is_empty() {
        tell(&outcomes, &mut findings);
    }
    if support::wanted("tolerance/diffuse") {
        findings.compare("tolerance/diffuse", &diffuse(&device, effort), DIFFUSE_BAR);
    }
    findings.finish();
}

/// A sample of each pixel, as ordered and with nothing left out, against a sample of each pixel.
///
/// # Panics
/// If the pictures differ.
fn diffuse(device: &Device, effort: Effort) -> Sides {
    let subject = Subject::of_file("cornell.glb", 512);
    let all = Tolerance::absolute(1e-9);
    let settings = RenderSettings {
        samples: 1,
        ..subject.settings.clone().to_tolerance(all)
    };
    let ours = subject.prepared(device, &settings);
    let theirs = subject.prepared(device, &subject.settings);
    assert!(rendered(&ours).1.radiance == rendered(&theirs).1.radiance);
    let render = |ready| rendered(ready).0;
    Sides::in_turn(effort.rounds(), || render(&ours), || render(&theirs))
}

/// Name, file, and whether it is ours.
fn scenes(effort: Effort) -> Vec<(String, PathBuf, bool)> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let own: &[&str] = match effort {
        Effort::Test => &FEW[1..2],
        Effort::Quick => &FEW,
        Effort::Full => &OWN,
    };
    let own = own.iter().map(|file| {
        let name = support::stem(file).to_owned();
        (name, root.join("assets").join(file), true)
    });
    let mut scenes: Vec<_> = own.collect();
    if effort == Effort::Full {
        for name in OTHERS {
            let folder = root.join("../shared/gltf").join(name);
            match scene_file(folder) {
                Some(file) => scenes.push((name.to_owned(), file, false)),
                None => println!("skipped: ../shared/gltf/{name} is not there"),
            }
        }
    }
    scenes
}

/// The first scene file below a folder.
fn scene_file(folder: PathBuf) -> Option<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    entries.sort();
    let is_scene = |path: &PathBuf| {
        path.extension()
            .is_some_and(|end| end == "glb" || end == "gltf")
    };
    let found = entries.iter().find(|path| is_scene(path)).cloned();
    found.or_else(|| {
        entries
            .into_iter()
            .filter(|path| path.is_dir())
            .find_map(scene_file)
    })
}

fn picture(film: &Film) -> Picture {
    Picture::from(film)
}

/// Root mean square, nothing clipped.
fn rmse(expected: &Picture, actual: &Picture) -> f64 {
    let options = CompareOptions {
        clip: false,
        thresholds: Vec::new(),
        flip: false,
    };
    let compared = compare(expected, actual, &options).unwrap_or_else(|error| panic!("{error}"));
    compared.rmse
}

impl Judged {
    fn new(device: &Device, name: String, path: &Path, is_ours: bool, effort: Effort) -> Self {
        let mut scene = raytree::import(path).unwrap_or_else(|error| panic!("{error}"));
        raytree::light_if_dark(&mut scene);
        let bvh =
            raytree::build_bvh(&scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"));
        let base = RenderSettings::new(SIZE.0, SIZE.1, raytree::default_camera(&scene));
        let mut judged = Self {
            name,
            is_ours,
            scene,
            bvh,
            base,
            reference: Picture::from(&Film::new(SIZE.0, SIZE.1)),
            uncertainty: f64::INFINITY,
        };
        let seconds = if effort == Effort::Test {
            0.5
        } else {
            REFERENCE_SECONDS
        };
        (judged.reference, judged.uncertainty) = judged.reference_within(device, seconds);
        judged
    }

    /// The mean of two pictures, and half of what they differ by.
    fn reference_within(&self, device: &Device, seconds: f64) -> (Picture, f64) {
        let deep = |samples| RenderSettings {
            samples,
            max_depth: 64,
            min_weight: 1e-4,
            max_rays: 1 << 12,
            ..self.base.clone()
        };
        let started = Instant::now();
        self.render(device, &deep(1));
        let one = started.elapsed().as_secs_f64();
        let affordable = (seconds / 2.0 / one).sqrt() as u32;
        // Of few numbers, so that what is kept is found again.
        let roots = [4, 6, 8, 11, 16, 23, 32, 45, 64, 89];
        let fitting = roots.into_iter().filter(|&root| root <= affordable);
        let root = fitting.max().unwrap_or(4);
        let films = [root, root + 1].map(|root| {
            let kept =
                support::target().join(format!("tolerance-{}-{root}-{seconds}.exr", self.name));
            Picture::read(&kept).unwrap_or_else(|_| {
                let film = self.render(device, &deep(root * root)).1;
                film.write(&kept, &WriteOptions::default())
                    .unwrap_or_else(|error| panic!("{error}"));
                picture(&film)
            })
        });
        let [a, b] = films;
        let uncertainty = 0.5 * rmse(&a, &b);
        let middle = |a: f32, b: f32| 0.5 * (a + b);
        let pairs = a.rgb.iter().zip(&b.rgb);
        let rgb = pairs
            .map(|(a, b)| [0, 1, 2].map(|c| middle(a[c], b[c])))
            .collect();
        (Picture { rgb, ..a }, uncertainty)
    }

    fn features(&self, settings: &RenderSettings) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(&self.scene), settings)
    }

    fn render(&self, device: &Device, settings: &RenderSettings) -> (Turn, Film) {
        let ready = prepared(
            device,
            (&self.scene, &self.bvh),
            settings,
            self.features(settings),
        );
        rendered(&ready)
    }

    /// Fixed settings of which no other is both nearer to the reference and quicker, from the least error on.
    fn front(&self, device: &Device) -> Vec<Fixed> {
        let branches = self.features(&self.base).has(Feature::Branches);
        let trees: &[(u32, f32)] = if branches {
            &[
                (3, 0.1),
                (3, 0.02),
                (8, 0.1),
                (8, 0.02),
                (8, 0.002),
                (32, 0.02),
                (32, 0.002),
            ]
        } else {
            &[(8, 0.001)]
        };
        let mut found = Vec::new();
        for &(max_depth, min_weight) in trees {
            for samples in [1, 2, 4, 8, 16, 36, 64, 144, 256] {
                let settings = RenderSettings {
                    samples,
                    max_depth,
                    min_weight,
                    ..self.base.clone()
                };
                let (turn, film) = self.render(device, &settings);
                found.push(Fixed {
                    error: rmse(&self.reference, &picture(&film)),
                    seconds: turn.cpu,
                    settings,
                });
                if turn.cpu > LONGEST_SECONDS {
                    break;
                }
            }
        }
        found.sort_by(|a, b| a.error.total_cmp(&b.error));
        let mut quickest = f64::INFINITY;
        found.retain(|fixed| {
            let is_quicker = fixed.seconds < quickest;
            quickest = quickest.min(fixed.seconds);
            is_quicker
        });
        found
    }

    fn outcomes(&self, device: &Device, effort: Effort) -> Vec<Outcome> {
        let front = self.front(device);
        let tolerances: &[f32] = if effort == Effort::Test {
            &TOLERANCES[..1]
        } else {
            &TOLERANCES
        };
        let mut outcomes: Vec<Outcome> = Vec::new();
        for &tolerance in tolerances {
            if outcomes
                .last()
                .is_some_and(|last| last.seconds > LAST_SECONDS)
            {
                println!(
                    "{:<28} {tolerance:<6} not tried: it would take minutes",
                    self.name
                );
                break;
            }
            let outcome = self.outcome(device, tolerance, &front, effort.rounds());
            println!("{outcome}");
            outcomes.push(outcome);
        }
        outcomes
    }

    fn outcome(&self, device: &Device, tolerance: f32, front: &[Fixed], rounds: usize) -> Outcome {
        let settings = self
            .base
            .clone()
            .to_tolerance(Tolerance::absolute(tolerance));
        let features = self.features(&settings);
        let ready = prepared(device, (&self.scene, &self.bvh), &settings, features);
        let once = ready
            .render(&mut raytree::unobserved)
            .unwrap_or_else(|error| panic!("{error}"));
        let error = rmse(&self.reference, &picture(&once.film));
        let report = once.error.unwrap_or_default();
        let (finer, coarser, share) = neighbours(front, error);
        let rounds = if once.times.render.as_secs_f64() > LONG_SECONDS {
            rounds.min(3)
        } else {
            rounds
        };
        let ratio = Spread::of((0..rounds).map(|_| {
            let (ours, film) = rendered(&ready);
            assert!(
                film.radiance == once.film.radiance,
                "{}: another picture",
                self.name
            );
            let seconds = |fixed: &Fixed| self.render(device, &fixed.settings).0.cpu.ln();
            let (finer, coarser) = (seconds(finer), seconds(coarser));
            ours.cpu / (finer + share * (coarser - finer)).exp()
        }));
        Outcome {
            name: self.name.clone(),
            is_ours: self.is_ours,
            tolerance: f64::from(tolerance),
            error,
            uncertainty: self.uncertainty,
            estimated: report.estimated_rmse,
            keeps: report.keeps_tolerance(),
            samples: report.samples as f64 / f64::from(SIZE.0 * SIZE.1),
            ratio,
            seconds: once.times.render.as_secs_f64(),
            is_beyond: error < front[0].error,
        }
    }
}

/// Of the front, the next better and the next worse setting, and how far between them the error is, from 0 to 1. Of an error that no fixed
/// setting comes down to the best one, twice: to be quicker than that is less than is asked.
fn neighbours(front: &[Fixed], error: f64) -> (&Fixed, &Fixed, f64) {
    let worse = front.partition_point(|fixed| fixed.error < error);
    let clamped = |index: usize| &front[index.min(front.len() - 1)];
    let (finer, coarser) = (clamped(worse.saturating_sub(1)), clamped(worse));
    let width = (coarser.error / finer.error).ln();
    let share = if width > 0.0 {
        (error / finer.error).ln() / width
    } else {
        0.0
    };
    (finer, coarser, share.clamp(0.0, 1.0))
}

/// A scene at a tolerance.
struct Outcome {
    name: String,
    is_ours: bool,
    tolerance: f64,
    error: f64,
    uncertainty: f64,
    estimated: f64,
    keeps: bool,
    samples: f64,
    ratio: Spread,
    /// Of rendering, by the wall's clock.
    seconds: f64,
    /// No fixed setting came as near to the reference.
    is_beyond: bool,
}

impl Outcome {
    /// Without what the reference itself is off by: two errors that know nothing of each other.
    fn own_error(&self) -> f64 {
        (self.error.powi(2) - self.uncertainty.powi(2))
            .max(0.0)
            .sqrt()
    }

    /// The reference is good enough to tell.
    fn is_told(&self) -> bool {
        self.uncertainty < 0.5 * self.error
    }

    fn effectivity(&self) -> f64 {
        self.estimated / self.own_error()
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            name,
            tolerance,
            error,
            uncertainty,
            estimated,
            samples,
            ratio,
            ..
        } = self;
        let told = match (self.is_told(), self.keeps) {
            (false, _) => ", the reference is too far off to tell",
            (true, false) => ", says it is not kept",
            (true, true) => "",
        };
        let beyond = if self.is_beyond {
            ", beyond the best of them"
        } else {
            ""
        };
        write!(
            f,
            "{name:<28} {tolerance:<6} error {error:.5} (reference {uncertainty:.5}), estimated {estimated:.5}: x{:.2}; {samples:.1} samples; \
             {:.2} ({:.2} to {:.2}) of fixed settings' time{beyond}{told}",
            self.effectivity(),
            ratio.median,
            ratio.least,
            ratio.most,
        )
    }
}

fn tell(outcomes: &[Outcome], findings: &mut Findings) {
    let outcomes: Vec<&Outcome> = outcomes.iter().filter(|o| o.is_told()).collect();
    let kept = outcomes
        .iter()
        .filter(|o| o.own_error() <= o.tolerance)
        .count();
    let above = outcomes.iter().filter(|o| o.effectivity() >= 1.0).count();
    let mean = outcomes.iter().map(|o| o.effectivity()).sum::<f64>() / outcomes.len() as f64;
    println!(
        "{} pictures: {kept} within the tolerance, {above} with an estimate above the error, which is x{mean:.2} in the mean",
        outcomes.len()
    );
    let ours = || outcomes.iter().filter(|outcome| outcome.is_ours);
    let worst = ours().max_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median));
    let mean_of = |of: fn(&Spread) -> f64| {
        let logarithms: Vec<f64> = ours().map(|outcome| of(&outcome.ratio).ln()).collect();
        (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp()
    };
    let mean = Spread {
        median: mean_of(|ratio| ratio.median),
        least: mean_of(|ratio| ratio.least),
        most: mean_of(|ratio| ratio.most),
    };
    let extra = "geometric mean over our scenes and tolerances";
    findings.figure(
        "tolerance/mean",
        mean,
        MEAN_BAR,
        mean.record("tolerance/mean", "x", extra),
    );
    if let Some(worst) = worst {
        println!("worst: {worst}");
        let record = worst.ratio.record("tolerance/worst", "x", &worst.name);
        findings.figure("tolerance/worst", worst.ratio, WORST_BAR, record);
    }
}
