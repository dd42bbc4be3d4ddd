//! A finished render in words, for people.

use std::fmt::Write;
use std::time::Duration;

use raytree::{Dropped, ErrorReport, Kernel, RenderTimes};

use crate::report::{Report, milliseconds};

/// What was written, and in what time.
pub fn line(report: &Report<'_>) -> String {
    let names: Vec<String> = report
        .outputs
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    let film = &report.rendering.film;
    let samples = match (&report.rendering.error, report.settings.samples) {
        (Some(error), _) => achieved(
            error,
            film.pixel_count(),
            report.args.quality.tolerance.is_some(),
        ),
        (None, 1) => "1 sample a pixel".to_owned(),
        (None, n) => format!("{n} samples a pixel"),
    };
    let (width, height) = (film.width, film.height);
    format!(
        "{}: {width}x{height}, {samples}, {}",
        names.join(", "),
        readable(report.times.total)
    )
}

/// What a picture that was rendered to a tolerance took, and how far it is off.
fn achieved(error: &ErrorReport, pixels: usize, asked: bool) -> String {
    let mean = error.samples as f64 / pixels.max(1) as f64;
    let off = format!("off by an estimated {:.1e} (RMSE)", error.estimated_rmse);
    let samples = format!("{mean:.1} samples a pixel");
    let beyond = if error.keeps_tolerance() || !asked {
        ""
    } else {
        ", more than asked for"
    };
    format!("{samples}, {off}{beyond}")
}

/// What the picture lacks, if anything, and what to do about it.
pub fn dropped(dropped: Dropped) -> Option<String> {
    let reasons: Vec<String> = [
        (
            dropped.budget,
            "their trees had as many rays as they may; raise --max-rays or --min-weight, or lower --depth",
        ),
        (
            dropped.storage,
            "rays can't remember more than 8 solids inside each other",
        ),
    ]
    .into_iter()
    .filter(|(count, _)| *count > 0)
    .map(|(count, why)| format!("{count} branches were dropped ({why})"))
    .collect();
    (!reasons.is_empty())
        .then(|| format!("warning: the picture lacks light: {}", reasons.join("; ")))
}

/// Where the time went, what the program had, what it counted.
pub fn details(report: &Report<'_>) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: &str| {
        // Writing to a string can't fail.
        let _ = writeln!(text, "  {name:<9} {value}");
    };
    let (contents, rendering) = (report.contents, report.rendering);
    let what = [
        (contents.triangles, "triangles"),
        (contents.materials, "materials"),
        (contents.textures, "textures"),
        (contents.lights, "lights"),
    ]
    .map(|(count, name)| format!("{count} {name}"))
    .join(", ");
    row("scene", &what);
    row(
        "light",
        if report.studio {
            "the built-in studio"
        } else {
            "as the scene and the command line say"
        },
    );
    row("camera", &report.settings.camera.name);
    row(
        "device",
        &format!("{} ({})", report.device.name, report.device.driver),
    );

    let (used, left_out) = rendering.features.labels();
    row("used", &list(&used));
    row("left out", &list(&left_out));

    let iterations = match rendering.iterations {
        1 => "in one iteration".to_owned(),
        n => format!("in {n} iterations"),
    };
    let kernels = kernels(&rendering.times);
    let total = ("total", report.times.total);
    for (name, time) in report.stages().into_iter().chain([total]) {
        let note = match name {
            "compile" => kernels.as_str(),
            "render" => iterations.as_str(),
            _ => "",
        };
        let milliseconds = milliseconds(time);
        row(name, format!("{milliseconds:9.1} ms  {note}").trim_end());
    }
    if let Some(counters) = &rendering.counters {
        let (rays, ended) = (&counters.rays, &counters.ended);
        let all = rays.total();
        let rate = all as f64 / 1e6 / rendering.times.render.as_secs_f64().max(1e-9);
        row("rays", &format!("{all} ({rate:.2} million a second)"));
        row(
            "",
            &format!(
                "primary {}, shadow {}, reflection {}, refraction {}",
                rays.primary, rays.shadow, rays.reflection, rays.refraction
            ),
        );
        row(
            "work",
            &format!(
                "{} node visits, {} triangle tests",
                counters.node_visits, counters.triangle_tests
            ),
        );
        row(
            "ended",
            &format!(
                "miss {}, depth {}, weight {}, tolerance {}, storage {}, budget {}",
                ended.miss, ended.depth, ended.weight, ended.tolerance, ended.storage, ended.budget
            ),
        );
    }
    text.truncate(text.trim_end().len());
    text
}

/// What each kernel's first dispatch took.
fn kernels(times: &RenderTimes) -> String {
    let kernels = Kernel::PICTURE.iter().zip(times.kernels);
    let parts: Vec<String> = kernels
        .map(|(kernel, time)| format!("{} {:.1}", kernel.name(), milliseconds(time)))
        .collect();
    parts.join(", ")
}

fn list(labels: &[&str]) -> String {
    if labels.is_empty() {
        "nothing".to_owned()
    } else {
        labels.join(", ")
    }
}

fn readable(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        ..1.0 => format!("{:.0} ms", seconds * 1e3),
        ..100.0 => format!("{seconds:.2} s"),
        _ => format!("{} min {:.0} s", time.as_secs() / 60, seconds % 60.0),
    }
}
