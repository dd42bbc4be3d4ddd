//! `raytree render`: import, light, choose the view, render, write, report.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use raytree::{Opening, RenderError, RenderSettings, Scene, Tolerance};

use crate::args::{QualityArgs, RenderArgs};
use crate::cancel;
use crate::console::{Console, print_json};
use crate::failure::Interrupted;
use crate::lighting;
use crate::outputs::{Outputs, write_options};
use crate::progress::Progress;
use crate::report::{Contents, Report, Times};
use crate::summary;
use crate::view;

/// What a process takes before and after what is timed here.
const OUTSIDE: Duration = Duration::from_millis(30);

/// A device is opened meanwhile, but what is wrong with all else comes first.
pub fn run(args: &RenderArgs, console: Console) -> anyhow::Result<()> {
    let started = Instant::now();
    args.quality.check()?;
    let outputs = Outputs::plan(args)?;
    cancel::watch()?;

    // Before the device opens, since it may start a thread.
    let progress = Progress::new(console.shows_progress());
    let opening = Opening::begin(args.quality.device.as_str().into());
    progress.stage("importing");
    let (prepared, import) = timed(|| prepare(args, &outputs, started));
    let Prepared {
        scene,
        contents,
        studio,
        settings,
    } = prepared?;
    progress.aside(|| console.warn(&scene.warnings));
    cancel::check()?;

    progress.stage("preparing");
    let (features, assemble) = timed(|| raytree::assemble_for(&scene, &settings));
    let mut observer = |state: raytree::Progress| {
        progress.rendered(state.finished);
        if cancel::requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let preset = args.quality.bvh.into();
    let (device, rendering) =
        raytree::render_when_open(opening, &scene, preset, &settings, features, &mut observer)
            .map_err(as_interruption)?;

    progress.stage("writing");
    let options = write_options(&args.output, scene.surroundings.background);
    let (written, write) = timed(|| outputs.write(&rendering.film, &options));
    written?;
    drop(progress);

    let times = Times {
        import,
        assemble,
        write,
        total: started.elapsed(),
    };
    let report = Report {
        args,
        contents,
        warnings: &scene.warnings,
        surroundings: &scene.surroundings,
        frame: scene.frame,
        studio,
        device: device.info(),
        settings: &settings,
        rendering: &rendering,
        outputs: outputs.paths(),
        times,
    };
    if args.json {
        print_json(&report.json())?;
    }
    console.say(summary::line(&report));
    // What trees were cut off is part of an error that is within the tolerance.
    let kept = rendering.error.is_some_and(|error| error.keeps_tolerance());
    if let Some(warning) = summary::dropped(rendering.dropped).filter(|_| !kept) {
        console.say(warning);
    }
    if console.is_verbose() {
        console.say(summary::details(&report));
    }
    Ok(())
}

/// Everything that is known before a device is needed.
struct Prepared {
    scene: Scene,
    contents: Contents,
    studio: bool,
    settings: RenderSettings,
}

fn prepare(args: &RenderArgs, outputs: &Outputs, started: Instant) -> anyhow::Result<Prepared> {
    let mut scene = raytree::import(&args.scene)?;
    outputs.spare(&scene.files)?;
    let contents = Contents::of(&scene);
    let chosen = view::choose(&args.view, &scene)?;
    let studio = lighting::apply(&args.lighting, &mut scene)?;
    let quality = &args.quality;
    let chosen = controlled(chosen, quality, outputs, started);
    let settings = RenderSettings {
        samples: quality.spp.unwrap_or(chosen.samples),
        max_depth: quality.depth.unwrap_or(chosen.max_depth),
        min_weight: quality
            .min_weight
            .map_or(chosen.min_weight, |weight| weight as f32),
        max_rays: quality.max_rays.unwrap_or(chosen.max_rays),
        shading: quality.shading.into(),
        aovs: outputs.want_layers(),
        counters: args.counters,
        batch_pixels: quality.batch,
        ..chosen
    };
    Ok(Prepared {
        scene,
        contents,
        studio,
        settings,
    })
}

/// With the tolerance and the end that the user asks for.
fn controlled(
    settings: RenderSettings,
    quality: &QualityArgs,
    outputs: &Outputs,
    started: Instant,
) -> RenderSettings {
    let deadline = quality.time_budget.map(|budget| {
        let region = settings.visible_region();
        let after = outputs.time_to_write(region.width, region.height) + OUTSIDE;
        started + budget.saturating_sub(after)
    });
    match (quality.tolerance, deadline) {
        (Some(tolerance), _) => RenderSettings {
            deadline,
            ..settings.to_tolerance(tolerance)
        },
        // With time alone for a limit no error is too small; trees are those of one that may be had.
        (None, Some(_)) => RenderSettings {
            tolerance: Some(Tolerance::absolute(0.0)),
            deadline,
            ..settings.to_tolerance(Tolerance::absolute(0.01))
        },
        (None, None) => settings,
    }
}

/// Only a signal makes the observer say stop.
pub fn as_interruption(error: RenderError) -> anyhow::Error {
    match error {
        RenderError::Cancelled => Interrupted.into(),
        error => error.into(),
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    (work(), started.elapsed())
}
