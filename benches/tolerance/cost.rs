//! What a picture takes at equal error. A reference is made (the mean of two pictures with different patterns of many samples; kept in the
//! target folder), then pictures at many fixed settings, of which those on the Pareto front count, then pictures at several tolerances.
//! What a fixed setting of a tolerance's own error would take is interpolated between its two neighbours on the front (in the
//! logarithms), which are timed once more in turn with it.

use std::{fs, time::Instant};

use raytree::{Device, Feature, Film, Picture, RenderSettings, Tolerance, WriteOptions};

use crate::{
    reference::{combined, rmse},
    support::{
        self, Effort,
        findings::{Bar, Findings},
        frames::{Subject, rendered},
        summary::Spread,
        turns::Turn,
    },
};

/// Large enough that a picture takes longer than it takes to begin one.
const SIZE: (u32, u32) = (256, 192);

/// At the same error, over the time of the best fixed setting: the mean over scenes and tolerances, and any of them.
const MEAN_BAR: Bar = Bar::AtMost(0.7);
const WORST_BAR: Bar = Bar::AtMost(1.1);

/// What both pictures of a reference may take.
const REFERENCE_SECONDS: f64 = 40.0;

/// A tenth of the tolerance takes up to a hundred times as long: it is not tried where a picture takes longer than this.
const LAST_SECONDS: f64 = 2.0;

/// Where a picture takes longer, three rounds are enough.
const LONG_SECONDS: f64 = 0.5;

/// Fixed settings are not tried that take longer.
const LONGEST_SECONDS: f64 = 5.0;

/// Samples a pixel of fixed settings.
const SAMPLES: [u32; 9] = [1, 2, 4, 8, 16, 36, 64, 144, 256];

/// Depth and least weight of fixed settings.
const TREES: [(u32, f32); 7] = [
    (3, 0.1),
    (3, 0.02),
    (8, 0.1),
    (8, 0.02),
    (8, 0.002),
    (32, 0.02),
    (32, 0.002),
];

/// A scene with what its pictures are held against.
struct Judged<'s> {
    device: &'s Device,
    subject: &'s Subject,
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

/// A scene's pictures at tolerances.
pub fn outcomes(
    device: &Device,
    subject: &Subject,
    tolerances: &[f32],
    effort: Effort,
) -> Vec<Cost> {
    let judged = Judged::new(device, subject, effort);
    let front = judged.front();
    let mut costs: Vec<Cost> = Vec::new();
    for &tolerance in tolerances {
        if costs.last().is_some_and(|last| last.seconds > LAST_SECONDS) {
            println!(
                "{:<28} {tolerance:<6} not tried: it would take minutes",
                subject.name
            );
            break;
        }
        let cost = judged.cost(tolerance, &front, effort.rounds());
        println!("{cost}");
        costs.push(cost);
    }
    costs
}

impl<'s> Judged<'s> {
    fn new(device: &'s Device, subject: &'s Subject, effort: Effort) -> Self {
        let mut judged = Self {
            device,
            subject,
            base: RenderSettings {
                width: SIZE.0,
                height: SIZE.1,
                ..subject.settings.clone()
            },
            reference: Picture::from(&Film::new(SIZE.0, SIZE.1)),
            uncertainty: f64::INFINITY,
        };
        let seconds = if effort == Effort::Test {
            0.5
        } else {
            REFERENCE_SECONDS
        };
        (judged.reference, judged.uncertainty) = judged.reference_within(seconds);
        judged
    }

    /// The mean of two pictures, and half of what they differ by.
    fn reference_within(&self, seconds: f64) -> (Picture, f64) {
        let deep = |samples| RenderSettings {
            samples,
            max_depth: 64,
            min_weight: 1e-4,
            max_rays: 1 << 12,
            ..self.base.clone()
        };
        let started = Instant::now();
        self.render(&deep(1));
        let one = started.elapsed().as_secs_f64();
        let affordable = (seconds / 2.0 / one).sqrt() as u32;
        // Of few numbers, so that what is kept is found again.
        let roots = [4, 6, 8, 11, 16, 23, 32, 45, 64, 89];
        let fitting = roots.into_iter().filter(|&root| root <= affordable);
        let root = fitting.max().unwrap_or(4);
        let [a, b] = [root, root + 1].map(|root| {
            let name = format!("cost-{}-{root}-{seconds}.exr", self.subject.name);
            let folder = support::target().join("tolerance");
            fs::create_dir_all(&folder).unwrap_or_else(|error| panic!("{error}"));
            let kept = folder.join(name);
            Picture::read(&kept).unwrap_or_else(|_| {
                let film = self.render(&deep(root * root)).1;
                film.write(&kept, &WriteOptions::default())
                    .unwrap_or_else(|error| panic!("{error}"));
                Picture::from(&film)
            })
        });
        let uncertainty = 0.5 * rmse(&a, &b);
        (combined(&a, &b, |a, b| 0.5 * (a + b)), uncertainty)
    }

    fn render(&self, settings: &RenderSettings) -> (Turn, Film) {
        rendered(&self.subject.prepared(self.device, settings))
    }

    /// Rays of all kinds.
    fn rays(&self, settings: &RenderSettings) -> f64 {
        let settings = RenderSettings {
            counters: true,
            ..settings.clone()
        };
        let ready = self.subject.prepared(self.device, &settings);
        let rendered = ready
            .render(&mut raytree::unobserved)
            .unwrap_or_else(|error| panic!("{error}"));
        rendered.counters.expect("they were asked for").rays.total() as f64
    }

    /// Fixed settings of which no other is both nearer to the reference and quicker, from the least error on.
    fn front(&self) -> Vec<Fixed> {
        let branches = self.subject.features(&self.base).has(Feature::Branches);
        let trees = if branches { &TREES[..] } else { &[(8, 0.001)] };
        let mut found = Vec::new();
        for &(max_depth, min_weight) in trees {
            for samples in SAMPLES {
                let settings = RenderSettings {
                    samples,
                    max_depth,
                    min_weight,
                    ..self.base.clone()
                };
                let (turn, film) = self.render(&settings);
                found.push(Fixed {
                    error: rmse(&self.reference, &Picture::from(&film)),
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

    fn cost(&self, tolerance: f32, front: &[Fixed], rounds: usize) -> Cost {
        let to_tolerance = Tolerance::absolute(tolerance);
        let settings = self.base.clone().to_tolerance(to_tolerance);
        let ready = self.subject.prepared(self.device, &settings);
        let once = ready
            .render(&mut raytree::unobserved)
            .unwrap_or_else(|error| panic!("{error}"));
        let error = rmse(&self.reference, &Picture::from(&once.film));
        let report = once.error.expect("a tolerance was asked for");
        let between = Between::of(front, error);
        let rounds = if once.times.render.as_secs_f64() > LONG_SECONDS {
            rounds.min(3)
        } else {
            rounds
        };
        let time = Spread::of((0..rounds).map(|_| {
            let (ours, film) = rendered(&ready);
            let is_same = film.radiance == once.film.radiance;
            assert!(is_same, "{}: another picture", self.subject.name);
            let theirs = between.interpolated(|fixed| self.render(&fixed.settings).0.cpu);
            ours.cpu / theirs
        }));
        Cost {
            name: self.subject.name.clone(),
            tolerance,
            error,
            uncertainty: self.uncertainty,
            samples: report.samples as f64 / f64::from(SIZE.0 * SIZE.1),
            rays: self.rays(&settings) / between.interpolated(|fixed| self.rays(&fixed.settings)),
            time,
            seconds: once.times.render.as_secs_f64(),
            is_beyond: error < front[0].error,
        }
    }
}

/// The neighbours of an error on the front: the next better and the next worse setting, and how far between them it is, from 0 to 1. Of
/// an error that no fixed setting comes down to the best one, twice: to be quicker than that is less than is asked.
struct Between<'f> {
    finer: &'f Fixed,
    coarser: &'f Fixed,
    share: f64,
}

impl<'f> Between<'f> {
    fn of(front: &'f [Fixed], error: f64) -> Self {
        let worse = front.partition_point(|fixed| fixed.error < error);
        let clamped = |index: usize| &front[index.min(front.len() - 1)];
        let (finer, coarser) = (clamped(worse.saturating_sub(1)), clamped(worse));
        let width = (coarser.error / finer.error).ln();
        let share = if width > 0.0 {
            (error / finer.error).ln() / width
        } else {
            0.0
        };
        Self {
            finer,
            coarser,
            share: share.clamp(0.0, 1.0),
        }
    }

    fn interpolated(&self, value: impl Fn(&Fixed) -> f64) -> f64 {
        let [finer, coarser] = [self.finer, self.coarser].map(|fixed| value(fixed).ln());
        (finer + self.share * (coarser - finer)).exp()
    }
}

/// A picture to a tolerance beside fixed settings of the same error.
pub struct Cost {
    name: String,
    tolerance: f32,
    error: f64,
    /// Of the reference.
    uncertainty: f64,
    samples: f64,
    /// Over those of fixed settings.
    rays: f64,
    /// CPU time, over theirs.
    time: Spread,
    /// Of rendering, by the wall's clock.
    seconds: f64,
    /// No fixed setting came as near to the reference.
    is_beyond: bool,
}

impl Cost {
    /// The reference is good enough to tell.
    fn is_told(&self) -> bool {
        self.uncertainty < 0.5 * self.error
    }
}

impl std::fmt::Display for Cost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let told = if self.is_told() {
            ""
        } else {
            ", the reference is too far off to tell"
        };
        let beyond = if self.is_beyond {
            ", beyond the best of them"
        } else {
            ""
        };
        write!(
            f,
            "{:<28} {:<6} error {:.5} (reference {:.5}), {:.1} samples, {:.3} s; of fixed settings' time {:.2} ({:.2} to {:.2}), rays \
             {:.2}{beyond}{told}",
            self.name,
            self.tolerance,
            self.error,
            self.uncertainty,
            self.samples,
            self.seconds,
            self.time.median,
            self.time.least,
            self.time.most,
            self.rays,
        )
    }
}

/// Of all that can be told.
pub fn tell(costs: &[Cost], findings: &mut Findings) {
    let told: Vec<&Cost> = costs.iter().filter(|cost| cost.is_told()).collect();
    println!("{} of {} costs can be told", told.len(), costs.len());
    if told.is_empty() {
        return;
    }
    let mean_of = |of: &dyn Fn(&Cost) -> f64| {
        let logarithms: f64 = told.iter().map(|cost| of(cost).ln()).sum();
        (logarithms / told.len() as f64).exp()
    };
    let mean = Spread {
        median: mean_of(&|cost| cost.time.median),
        least: mean_of(&|cost| cost.time.least),
        most: mean_of(&|cost| cost.time.most),
    };
    println!(
        "geometric mean of rays: {:.2} of theirs",
        mean_of(&|cost| cost.rays)
    );
    let extra = "geometric mean over our scenes and tolerances";
    let record = mean.record("tolerance/cost/mean", "x", extra);
    findings.figure("tolerance/cost/mean", mean, MEAN_BAR, record);
    let worst = told
        .iter()
        .max_by(|a, b| a.time.median.total_cmp(&b.time.median));
    if let Some(worst) = worst {
        println!("worst: {worst}");
        let record = worst.time.record("tolerance/cost/worst", "x", &worst.name);
        findings.figure("tolerance/cost/worst", worst.time, WORST_BAR, record);
    }
}
