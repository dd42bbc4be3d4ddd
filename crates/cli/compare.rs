//! `raytree compare`: how much two pictures differ, and whether that is too much.

use std::fmt::Write;

use anyhow::bail;
use raytree::{
    BrokenLimit, CompareOptions, Comparison, Format, Limits, Picture, compare, difference_picture,
};
use serde_json::{Value, json};

use crate::args::{CompareArgs, LimitArgs};
use crate::console::{print, print_json};
use crate::failure::Usage;
use crate::outputs::check_writable;

/// Where the user names no threshold.
const DEFAULT_THRESHOLD: f64 = 0.02;

pub fn run(args: &CompareArgs) -> anyhow::Result<()> {
    if let Some(path) = &args.diff {
        if Format::of_path(path)? != Format::Png {
            return Err(Usage(format!(
                "{}: a difference picture is a PNG; end its name in .png",
                path.display()
            ))
            .into());
        }
        check_writable(path)?;
    }
    let expected = Picture::read(&args.expected)?;
    let actual = Picture::read(&args.actual)?;
    let comparison = compare(&expected, &actual, &options(args))?;
    if let Some(path) = &args.diff {
        difference_picture(&expected, &actual)?.write_png(path)?;
    }
    if args.json {
        print_json(&as_json(&comparison))?;
    } else {
        print(&as_text(&comparison))?;
    }
    check(&args.limits, &comparison)
}

fn options(args: &CompareArgs) -> CompareOptions {
    let limits = args.limits.max_outliers.iter().map(|limit| limit.threshold);
    let mut thresholds: Vec<f64> = args.threshold.iter().copied().chain(limits).collect();
    thresholds.sort_by(f64::total_cmp);
    thresholds.dedup();
    if thresholds.is_empty() {
        thresholds.push(DEFAULT_THRESHOLD);
    }
    CompareOptions {
        clip: args.clip,
        thresholds,
        flip: !args.no_flip,
    }
}

fn check(args: &LimitArgs, comparison: &Comparison) -> anyhow::Result<()> {
    let limits = Limits {
        max_rmse: args.max_rmse,
        max_mean: args.max_mean,
        max_abs: args.max_abs,
        max_p99: args.max_p99,
        max_alpha: args.max_alpha,
        max_flip: args.max_flip,
        max_outliers: args
            .max_outliers
            .iter()
            .map(|limit| (limit.threshold, limit.share))
            .collect(),
    };
    // Whoever sets no limits wants numbers, of whatever pictures.
    if limits == Limits::default() {
        return Ok(());
    }
    let broken: Vec<String> = limits
        .check(comparison)
        .iter()
        .map(BrokenLimit::to_string)
        .collect();
    if !broken.is_empty() {
        bail!("the pictures differ too much: {}", broken.join("; "));
    }
    Ok(())
}

fn as_json(comparison: &Comparison) -> Value {
    let outliers: Vec<Value> = comparison
        .outliers
        .iter()
        .map(|(threshold, share)| json!({ "threshold": threshold, "share": share }))
        .collect();
    json!({
        "pixels": comparison.pixels,
        "rmse": comparison.rmse,
        "relative_mse": comparison.relative_mse,
        "mean_abs": comparison.mean_abs,
        "max_abs": comparison.max_abs,
        "p99_abs": comparison.p99_abs,
        "flip_mean": comparison.flip_mean,
        "outliers": outliers,
        "max_alpha": comparison.max_alpha,
        "non_finite": comparison.non_finite,
    })
}

fn as_text(comparison: &Comparison) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: &str| {
        // Writing to a string can't fail.
        let _ = writeln!(text, "{name:<16} {value}");
    };
    let number = |value: f64| format!("{value:.6}");
    row("pixels", &comparison.pixels.to_string());
    row("mean", &number(comparison.mean_abs));
    row("rmse", &number(comparison.rmse));
    row("relative mse", &number(comparison.relative_mse));
    row("99th percentile", &number(comparison.p99_abs));
    row("max", &number(comparison.max_abs));
    row("max alpha", &number(comparison.max_alpha));
    if let Some(flip) = comparison.flip_mean {
        row("FLIP", &number(flip));
    }
    for (threshold, share) in &comparison.outliers {
        row(
            &format!("above {threshold}"),
            &format!("{:.4} %", 100.0 * share),
        );
    }
    if comparison.non_finite > 0 {
        row(
            "NaN or infinite",
            &format!("{} pixels", comparison.non_finite),
        );
    }
    text
}
