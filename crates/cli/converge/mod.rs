//! `raytree converge`: a sweep of settings, timed in turn, each picture against a reference.

mod args;
mod cache;
mod cpu_time;
mod journal;
mod key;
mod lab;
mod oracle;
mod outputs;
mod reference;
mod settings;

use std::path::Path;

use anyhow::bail;
use raytree::{Device, Picture, RenderSettings, Scene};
use raytree_converge::{
    Bvh, Model, Picture as Counted, Record, Setting, Subject, Summary, Sweep, table,
};

pub use args::ConvergeArgs;

use crate::args::{BvhChoice, QualityArgs, ShadingChoice};
use crate::cancel;
use crate::console::{Console, print};
use crate::failure::{Interrupted, Usage};
use crate::progress::Progress;
use crate::{lighting, view};
use journal::JournalFile;
use lab::Lab;
use outputs::Folder;
use reference::{Plan, Truth};

/// Pixels where no size is given: so many that edges are many, so few that the default sweep ends within a minute or so.
const PIXELS: f64 = 160.0 * 120.0;

/// All that needs no device is checked before one is opened.
pub fn run(args: &ConvergeArgs, console: Console) -> anyhow::Result<()> {
    args.quality.check()?;
    let sweep = sweep(args)?;
    let points = sweep.settings();
    let shadings = shadings(&points);
    check(args, &shadings)?;
    cancel::watch()?;

    let progress = Progress::new(console.shows_progress());
    progress.stage("importing");
    let mut scene = raytree::import(&args.scene)?;
    let base = base(args, &scene)?;
    lighting::apply(&args.lighting, &mut scene)?;
    progress.aside(|| console.warn(&scene.warnings));
    cancel::check()?;
    let given = given(args, &shadings, &base)?;
    let folder = Folder::prepare(args.output.as_deref(), &args.scene)?;

    progress.stage("opening the device");
    let device = Device::open(&args.quality.device.as_str().into())?;
    let mut key = key::subject(&args.scene, &scene, &base, &args.lighting, device.info())?;
    let plan = Plan::beyond(&points, args.reference_spp, args.oracle);
    let judged_by = match &given {
        Some(truth) => format!("a reference given, {:016x}", fingerprint(&truth.picture)),
        None => plan.key(),
    };
    key = format!("{key}; against {judged_by}");
    let journal = JournalFile::open(folder.path(), &key, args.fresh)?;

    let lab = Lab::new(&scene, &device, &base);
    let mut bench = Bench {
        args,
        console,
        progress,
        folder,
        journal,
        lab,
        points,
        done: 0.0,
    };
    let measured = bench.measure(&plan, &shadings, &key, given);
    let references = match measured {
        Ok(references) => references,
        Err(error) => {
            if error.is::<Interrupted>() {
                bench.say_what_is_kept();
            }
            return Err(error);
        }
    };
    let subject = Subject {
        scene: stem(&args.scene),
        size: (base.visible_region().width, base.visible_region().height),
        device: device.info().name.clone(),
        driver: device.info().driver.clone(),
        command: command(),
    };
    let references: Vec<_> = references
        .into_iter()
        .map(|truth| truth.reference)
        .collect();
    let journal = &bench.journal.journal;
    let summary = Summary::new(subject, &sweep, journal, &references, args.time.into());
    bench.folder.write(&summary)?;
    let folder = bench.folder.path().display().to_string();
    drop(bench);
    if args.json {
        print(&(serde_json::to_string_pretty(&summary)? + "\n"))?;
    } else {
        print(&table(&summary))?;
    }
    console.say(format_args!("{folder}: converge.csv, .json, .svg and .png"));
    Ok(())
}

/// The sweep that was asked for, about the settings that were.
fn sweep(args: &ConvergeArgs) -> Result<Sweep, Usage> {
    let base = about(&args.quality);
    if args.sweep.is_empty() {
        return Ok(Sweep::standard(base));
    }
    Sweep::product(base, &args.sweep).map_err(|error| Usage(format!("--sweep: {error}")))
}

/// What is not varied.
fn about(quality: &QualityArgs) -> Setting {
    let default = Setting::default();
    Setting {
        depth: quality.depth.unwrap_or(default.depth),
        min_weight: quality.min_weight.unwrap_or(default.min_weight),
        spp: quality.spp.unwrap_or(default.spp),
        tolerance: None,
        bvh: match quality.bvh {
            BvhChoice::Fast => Bvh::Fast,
            BvhChoice::Balanced => Bvh::Balanced,
            BvhChoice::Best => Bvh::Best,
        },
        shading: match quality.shading {
            ShadingChoice::Pbr => Model::Pbr,
            ShadingChoice::Whitted => Model::Whitted,
        },
    }
}

/// Each once, in their order: each has a truth of its own.
fn shadings(points: &[Setting]) -> Vec<Model> {
    let mut shadings = Vec::new();
    for point in points {
        if !shadings.contains(&point.shading) {
            shadings.push(point.shading);
        }
    }
    shadings
}

/// What can be said to make no sense before anything is read.
fn check(args: &ConvergeArgs, shadings: &[Model]) -> Result<(), Usage> {
    if args.quality.tolerance.is_some() {
        let problem = "a tolerance is swept, not set; write --sweep tolerance=0.1,0.03,0.01";
        return Err(Usage(format!("--tolerance: {problem}")));
    }
    if args.quality.time_budget.is_some() {
        let problem = "what a picture takes is what is measured here; leave it out";
        return Err(Usage(format!("--time-budget: {problem}")));
    }
    if args.reference.len() > 2 {
        return Err(Usage("--reference can be given once or twice".to_owned()));
    }
    if !args.reference.is_empty() && shadings.len() > 1 {
        let problem = "both shading models are swept, and each has a truth of its own; sweep one, or leave --reference out";
        return Err(Usage(format!("--reference: {problem}")));
    }
    Ok(())
}

/// Camera and size, and what of the command line a sweep does not vary.
fn base(args: &ConvergeArgs, scene: &Scene) -> anyhow::Result<RenderSettings> {
    let chosen = view::choose(&args.view, scene)?;
    let (width, height) = match (args.view.size, args.view.region, args.reference.first()) {
        (Some(_), ..) | (_, Some(_), _) => (chosen.width, chosen.height),
        (None, None, Some(path)) => {
            let picture = Picture::read(path)?;
            (picture.width, picture.height)
        }
        (None, None, None) => small(chosen.width, chosen.height),
    };
    Ok(RenderSettings {
        width,
        height,
        max_rays: args.quality.max_rays.unwrap_or(chosen.max_rays),
        batch_pixels: args.quality.batch,
        ..chosen
    })
}

/// About [`PIXELS`] in the same proportions.
fn small(width: u32, height: u32) -> (u32, u32) {
    let scale = (PIXELS / (f64::from(width) * f64::from(height))).sqrt();
    let scaled = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (scaled(width), scaled(height))
}

fn given(
    args: &ConvergeArgs,
    shadings: &[Model],
    base: &RenderSettings,
) -> anyhow::Result<Option<Truth>> {
    match (args.reference.is_empty(), shadings.first()) {
        (false, Some(shading)) => {
            let region = base.visible_region();
            let size = (region.width, region.height);
            Ok(Some(reference::given(&args.reference, *shading, size)?))
        }
        _ => Ok(None),
    }
}

fn fingerprint(picture: &Picture) -> u64 {
    let mut hash = key::Hash::default();
    for channel in picture.rgb.as_flattened() {
        hash.add(&channel.to_bits().to_le_bytes());
    }
    hash.value()
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// As it was typed, but for the program's folder.
fn command() -> String {
    let arguments = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    format!("raytree {arguments}")
}

/// A sweep being measured.
struct Bench<'a> {
    args: &'a ConvergeArgs,
    console: Console,
    progress: Progress,
    folder: Folder,
    journal: JournalFile,
    lab: Lab<'a>,
    points: Vec<Setting>,
    /// Work done, in samples a pixel and what a run takes besides.
    done: f64,
}

/// What a run takes besides its samples, in samples a pixel of a small picture.
const RUN: f64 = 1.0;

impl Bench<'_> {
    /// Whatever is not there yet: references, pictures, rounds of timed runs.
    fn measure(
        &mut self,
        plan: &Plan,
        shadings: &[Model],
        key: &str,
        given: Option<Truth>,
    ) -> anyhow::Result<Vec<Truth>> {
        self.say_what_is_there();
        let all = self.work(plan, shadings, given.is_some());
        let truths = match given {
            Some(truth) => vec![truth],
            None => self.references(plan, shadings, key, all)?,
        };
        self.pictures(&truths, all)?;
        self.rounds(all)?;
        Ok(truths)
    }

    /// All of it, for the time that is left.
    fn work(&self, plan: &Plan, shadings: &[Model], given: bool) -> f64 {
        let references = if given { 0 } else { shadings.len() };
        let pictures = self.points.iter().filter(|point| self.needs_picture(point));
        let runs = (0..self.args.repeat).flat_map(|round| {
            let journal = &self.journal.journal;
            let missing = self.points.iter();
            missing.filter(move |point| !journal.has_run(point, round))
        });
        let cost = |point: &Setting| f64::from(point.spp) + RUN;
        f64::from(plan.samples()) * references as f64
            + pictures.map(cost).sum::<f64>()
            + runs.map(cost).sum::<f64>()
    }

    fn advance(&mut self, work: f64, all: f64) {
        self.done += work;
        self.progress.done((self.done / all.max(1.0)).min(1.0));
    }

    fn references(
        &mut self,
        plan: &Plan,
        shadings: &[Model],
        key: &str,
        all: f64,
    ) -> anyhow::Result<Vec<Truth>> {
        let mut truths = Vec::new();
        for shading in shadings {
            self.progress.stage(format!("reference ({shading})"));
            let (progress, console) = (&self.progress, self.console);
            let warn = |text: &str| progress.aside(|| console.say(text));
            let (truth, kept) = reference::kept_or_made(&mut self.lab, plan, *shading, key, &warn)?;
            if kept {
                self.say(&format!(
                    "reference ({shading}): as kept from an earlier run"
                ));
            }
            truths.push(truth);
            self.advance(f64::from(plan.samples()), all);
        }
        Ok(truths)
    }

    fn needs_picture(&self, point: &Setting) -> bool {
        let lacks_error = self.args.errors && !self.folder.error_picture(point).exists();
        lacks_error || self.journal.journal.picture(point).is_none()
    }

    /// Each setting's picture against its reference, and its rays.
    fn pictures(&mut self, truths: &[Truth], all: f64) -> anyhow::Result<()> {
        for point in self.points.clone() {
            if !self.needs_picture(&point) {
                continue;
            }
            self.progress.stage(format!("rays of {}", point.key()));
            let Some(truth) = truths
                .iter()
                .find(|truth| truth.reference.shading == point.shading)
            else {
                continue;
            };
            let counted = self.lab.counted(&point)?;
            let picture = Picture::from(&counted.film);
            if self.args.errors {
                self.folder
                    .write_error_picture(&point, &truth.picture, &picture)?;
            }
            if self.journal.journal.picture(&point).is_none() {
                self.journal.add(Record::Picture(Counted {
                    setting: point,
                    errors: reference::errors(&truth.picture, &picture)?,
                    rays: counted.rays,
                    dropped: counted.dropped,
                    fingerprint: counted.fingerprint,
                    estimated_rmse: counted.estimated_rmse,
                }))?;
            }
            self.advance(f64::from(point.spp) + RUN, all);
        }
        Ok(())
    }

    /// Every setting once a round, every other round from the last to the first: what drifts on the machine drifts for all.
    fn rounds(&mut self, all: f64) -> anyhow::Result<()> {
        let session = self.journal.journal.next_session();
        for round in 0..self.args.repeat {
            self.builds(round)?;
            let mut points = self.points.clone();
            if round % 2 == 1 {
                points.reverse();
            }
            for point in points {
                if self.journal.journal.has_run(&point, round) {
                    continue;
                }
                let of = self.args.repeat;
                self.progress.stage(format!("round {} of {of}", round + 1));
                let (run, fingerprint) = self.lab.timed(&point, round, session)?;
                self.same_picture(&point, fingerprint)?;
                self.journal.add(Record::Run(run))?;
                self.advance(f64::from(point.spp) + RUN, all);
            }
        }
        Ok(())
    }

    fn builds(&mut self, round: u32) -> anyhow::Result<()> {
        for bvh in [Bvh::Fast, Bvh::Balanced, Bvh::Best] {
            let used = self.points.iter().any(|point| point.bvh == bvh);
            if used && !self.journal.journal.has_build(bvh, round) {
                cancel::check()?;
                let build = self.lab.build(bvh, round)?;
                self.journal.add(Record::Build(build))?;
            }
        }
        Ok(())
    }

    /// A time is that of the picture whose error stands beside it.
    fn same_picture(&self, point: &Setting, fingerprint: u64) -> anyhow::Result<()> {
        let before = self.journal.journal.picture(point);
        if before.is_some_and(|picture| picture.fingerprint != fingerprint) {
            bail!(
                "{}: two runs gave different pictures: time and error are not of the same one; this is a bug of raytree or of the driver",
                point.key()
            );
        }
        Ok(())
    }

    fn say(&self, text: &str) {
        let console = self.console;
        self.progress.aside(|| console.say(text));
    }

    fn say_what_is_there(&self) {
        let kept = self.runs_kept();
        if kept > 0 {
            let (all, folder) = (self.runs(), self.folder.path().display());
            self.say(&format!(
                "{folder}: {kept} of {all} runs are there already; going on from them (--fresh starts over)"
            ));
        }
    }

    fn say_what_is_kept(&self) {
        let (kept, all, folder) = (self.runs_kept(), self.runs(), self.folder.path().display());
        self.say(&format!(
            "{folder}: {kept} of {all} runs are kept; the same command goes on from them"
        ));
    }

    fn runs(&self) -> usize {
        self.points.len() * self.args.repeat as usize
    }

    fn runs_kept(&self) -> usize {
        let journal = &self.journal.journal;
        let of = |point: &Setting| {
            (0..self.args.repeat)
                .filter(|round| journal.has_run(point, *round))
                .count()
        };
        self.points.iter().map(of).sum()
    }
}
