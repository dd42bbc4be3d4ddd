//! What a picture takes at equal error. A reference is made (the mean of two pictures with different patterns of many samples; kept in the
//! target folder), then pictures at many fixed settings, of which those on the Pareto front count, then pictures at several tolerances.
//! What a fixed setting of a tolerance's own error would take is interpolated between its two neighbours on the front (in the
//! logarithms), which are timed once more in turn with it. Where that reference could not tell, smaller pictures are held against those
//! that are kept of our scenes.

use std::{
    cell::{OnceCell, RefCell},
    fs,
    time::Instant,
};

use raytree::{Device, Feature, Film, Picture, RenderSettings, Tolerance, WriteOptions};

use crate::{
    kept,
    reference::{Reference, Uncertainty, combined, rmse},
    support::{
        self, Effort,
        findings::{Bar, Findings},
        frames::{Subject, rendered},
        summary::Spread,
        turns::Turn,
    },
};

/// Large enough that a picture of a sample a pixel takes longer than it takes to begin one.
const SIZE: (u32, u32) = (256, 192);

/// What the error of a picture to a tolerance is of that, about.
const USUAL_ERROR: f64 = 0.3;

/// At the same error, over the time of the best fixed setting: the mean over scenes and tolerances, and any of them.
const MEAN_BAR: Bar = Bar::AtMost(0.7);
const WORST_BAR: Bar = Bar::AtMost(1.1);

/// What both pictures of a reference may take.
const REFERENCE_SECONDS: f64 = 40.0;

/// Where a picture takes longer than the first, three rounds are enough; where it takes longer than the second, all that it is held against
/// would take hours.
const LONG_SECONDS: f64 = 0.5;
const LAST_SECONDS: f64 = 15.0;

/// Fixed settings are tried that take up to this, or up to so much more than the picture to a tolerance. CPU time.
const LONGEST_SECONDS: f64 = 5.0;
const LONGEST: f64 = 2.0;

/// More samples are not tried once the reference can't tell, or trees that are cut off are all of the error.
const TOLD: f64 = 0.7;
const STILL: f64 = 0.97;
const FEW_SAMPLES: u32 = 100;

/// Samples a pixel of fixed settings. None is that of a reference, whose pattern would be the same.
const SAMPLES: [u32; 13] = [1, 2, 4, 8, 18, 40, 80, 160, 320, 640, 1280, 2560, 5120];

/// Depth and least weight of fixed settings.
const TREES: [(u32, f32); 8] = [
    (3, 0.1),
    (3, 0.02),
    (8, 0.1),
    (8, 0.02),
    (8, 0.002),
    (32, 0.02),
    (32, 0.002),
    (64, 0.0002),
];

/// A scene with what its pictures are held against.
struct Judged<'s> {
    device: &'s Device,
    subject: &'s Subject,
    base: RenderSettings,
    reference: Reference,
    /// What was tried so far.
    tried: RefCell<Vec<Fixed>>,
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
    let large = Judged::large(device, subject, effort);
    let small = OnceCell::new();
    let cost = |&tolerance: &f32| {
        let judged = if large.reference.tells(USUAL_ERROR * f64::from(tolerance)) {
            &large
        } else {
            small.get_or_init(|| Judged::small(device, subject))
        };
        let cost = judged.cost(tolerance, effort.rounds());
        match &cost {
            Some(cost) => println!("{cost}"),
            None => println!("{:<28} {tolerance:<6} not tried", subject.name),
        }
        cost
    };
    tolerances.iter().filter_map(cost).collect()
}

impl<'s> Judged<'s> {
    fn new(
        device: &'s Device,
        subject: &'s Subject,
        (width, height): (u32, u32),
        reference: impl FnOnce(&RenderSettings) -> Reference,
    ) -> Self {
        let base = RenderSettings {
            width,
            height,
            ..subject.settings.clone()
        };
        Self {
            device,
            subject,
            reference: reference(&base),
            base,
            tried: RefCell::default(),
        }
    }

    fn large(device: &'s Device, subject: &'s Subject, effort: Effort) -> Self {
        let seconds = if effort == Effort::Test {
            0.5
        } else {
            REFERENCE_SECONDS
        };
        Self::new(device, subject, SIZE, |base| {
            reference_within(seconds, device, subject, base)
        })
    }

    fn small(device: &'s Device, subject: &'s Subject) -> Self {
        Self::new(device, subject, kept::SIZE, |base| {
            kept::reference(device, subject, true, base)
        })
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
    fn front(&self, longest: f64) -> Vec<Fixed> {
        let branches = self.subject.features(&self.base).has(Feature::Branches);
        let trees = if branches { &TREES[..] } else { &[(8, 0.001)] };
        let mut found: Vec<Fixed> = trees
            .iter()
            .flat_map(|&tree| self.with_trees(tree, longest))
            .collect();
        found.sort_by(|a, b| a.error.total_cmp(&b.error));
        let mut quickest = f64::INFINITY;
        found.retain(|fixed| {
            let is_quicker = fixed.seconds < quickest;
            quickest = quickest.min(fixed.seconds);
            is_quicker
        });
        found
    }

    /// More and more samples, as long as that is worth the while.
    fn with_trees(&self, (max_depth, min_weight): (u32, f32), longest: f64) -> Vec<Fixed> {
        let mut before = f64::INFINITY;
        let mut found = Vec::new();
        for samples in SAMPLES {
            let fixed = self.fixed(RenderSettings {
                samples,
                max_depth,
                min_weight,
                ..self.base.clone()
            });
            let (error, seconds) = (fixed.error, fixed.seconds);
            found.push(fixed);
            let is_told = self.reference.error.total() < TOLD * error;
            // Of few samples the error does not fall evenly.
            let is_in_vain = samples > FEW_SAMPLES && error > STILL * before;
            if seconds > longest || !is_told || is_in_vain {
                break;
            }
            before = error;
        }
        found
    }

    /// A fixed setting, tried once.
    fn fixed(&self, settings: RenderSettings) -> Fixed {
        let mut tried = self.tried.borrow_mut();
        if let Some(before) = tried.iter().find(|before| before.settings == settings) {
            return before.clone();
        }
        let (turn, film) = self.render(&settings);
        let fixed = Fixed {
            settings,
            error: rmse(&self.reference.picture, &Picture::from(&film)),
            seconds: turn.cpu,
        };
        tried.push(fixed.clone());
        fixed
    }

    fn cost(&self, tolerance: f32, rounds: usize) -> Option<Cost> {
        let to_tolerance = Tolerance::absolute(tolerance);
        let settings = self.base.clone().to_tolerance(to_tolerance);
        let ready = self.subject.prepared(self.device, &settings);
        let (turn, once) = Turn::of(|| {
            ready
                .render(&mut raytree::unobserved)
                .unwrap_or_else(|error| panic!("{error}"))
        });
        let seconds = once.times.render.as_secs_f64();
        if seconds > LAST_SECONDS {
            return None;
        }
        let error = rmse(&self.reference.picture, &Picture::from(&once.film));
        let report = once.error.expect("a tolerance was asked for");
        let front = self.front(LONGEST_SECONDS.max(LONGEST * turn.cpu));
        let between = Between::of(&front, error);
        let rounds = if seconds > LONG_SECONDS {
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
        Some(Cost {
            name: self.subject.name.clone(),
            tolerance,
            error,
            width: self.base.width,
            uncertainty: self.reference.error.total(),
            is_told: self.reference.tells(error),
            samples: report.samples as f64 / f64::from(self.base.width * self.base.height),
            rays: self.rays(&settings) / between.interpolated(|fixed| self.rays(&fixed.settings)),
            time,
            seconds,
            is_beyond: error < front[0].error,
        })
    }
}

/// The mean of two pictures, and half of what they differ by.
fn reference_within(
    seconds: f64,
    device: &Device,
    subject: &Subject,
    base: &RenderSettings,
) -> Reference {
    let render = |samples| {
        let deep = RenderSettings {
            samples,
            max_depth: 64,
            min_weight: 1e-4,
            max_rays: 1 << 12,
            ..base.clone()
        };
        rendered(&subject.prepared(device, &deep)).1
    };
    let started = Instant::now();
    render(1);
    let one = started.elapsed().as_secs_f64();
    let affordable = (seconds / 2.0 / one).sqrt() as u32;
    // Of few numbers, so that what is kept is found again.
    let roots = [4, 6, 8, 11, 16, 23, 32, 45, 64, 89];
    let fitting = roots.into_iter().filter(|&root| root <= affordable);
    let root = fitting.max().unwrap_or(4);
    let [a, b] = [root, root + 1].map(|root| {
        let name = format!("cost-{}-{root}-{seconds}.exr", subject.name);
        let folder = support::target().join("tolerance");
        fs::create_dir_all(&folder).unwrap_or_else(|error| panic!("{error}"));
        let kept = folder.join(name);
        Picture::read(&kept).unwrap_or_else(|_| {
            let film = render(root * root);
            film.write(&kept, &WriteOptions::default())
                .unwrap_or_else(|error| panic!("{error}"));
            Picture::from(&film)
        })
    });
    Reference {
        error: Uncertainty {
            sampling: 0.5 * rmse(&a, &b),
            trees: 0.0,
        },
        picture: combined(&a, &b, |a, b| 0.5 * (a + b)),
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
    /// Of the picture, pixels.
    width: u32,
    error: f64,
    /// Of the reference.
    uncertainty: f64,
    /// By the reference.
    is_told: bool,
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

impl std::fmt::Display for Cost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let told = if self.is_told {
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
            "{:<28} {:<6} {:>3} wide: error {:.5} (reference {:.5}), {:.1} samples, {:.3} s; of fixed settings' time {:.2} ({:.2} to {:.2}), rays \
             {:.2}{beyond}{told}",
            self.name,
            self.tolerance,
            self.width,
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
    let told: Vec<&Cost> = costs.iter().filter(|cost| cost.is_told).collect();
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
