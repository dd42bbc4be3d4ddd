//! The same for terminals and spreadsheets.

use std::fmt::Write;

use crate::measurement::{MadeBy, Metric, Reference};
use crate::setting::Knob;
use crate::statistics::{Order, Spread, TimeTo};
use crate::summary::{Clock, Point, Summary, TimeToError, Truth};

/// Columns of errors, with their widths.
const ERRORS: [(&str, Metric); 6] = [
    ("RMSE", Metric::Rmse),
    ("rel. MSE", Metric::RelativeMse),
    ("mean", Metric::MeanAbs),
    ("99 %", Metric::P99Abs),
    ("max", Metric::MaxAbs),
    ("FLIP", Metric::FlipMean),
];

/// For a terminal some 150 columns wide: a block for each ladder, then what follows from them.
#[must_use]
pub fn table(summary: &Summary) -> String {
    let mut text = String::new();
    for (index, ladder) in summary.ladders.iter().enumerate() {
        if index > 0 {
            text.push('\n');
        }
        // Writing to a string can't fail, here and below.
        let _ = writeln!(text, "{}", heading(ladder.knob, &ladder.fixed, summary));
        for point in &ladder.points {
            let _ = writeln!(text, "{}", row(summary, ladder.knob, *point));
        }
    }
    text.push('\n');
    for ladder in &summary.ladders {
        if let Some(order) = &ladder.order {
            let _ = writeln!(text, "{}", order_line(ladder.knob, order));
        }
    }
    for truth in &summary.truths {
        let _ = write!(text, "{}", truth_lines(truth, summary));
    }
    text
}

fn heading(knob: Knob, fixed: &str, summary: &Summary) -> String {
    let mut line = format!(
        "{:<16}{:<30}{:<30}{:>8}",
        knob.title(),
        "CPU s",
        "wall s",
        "Mrays"
    );
    for (name, _) in ERRORS {
        let _ = write!(line, "{name:>10}");
    }
    if estimates(summary) {
        let _ = write!(line, "{:>10}", "est./true");
    }
    match fixed {
        "" => line,
        fixed => format!("{line}   ({fixed})"),
    }
}

fn estimates(summary: &Summary) -> bool {
    summary
        .points
        .iter()
        .any(|point| point.estimated_rmse.is_some())
}

fn row(summary: &Summary, knob: Knob, index: usize) -> String {
    let point = &summary.points[index];
    let on_front = summary
        .truths
        .iter()
        .any(|truth| truth.front.contains(&index));
    let mark = if on_front { '*' } else { ' ' };
    let mut line = format!(
        "{mark} {:<14}{:<30}{:<30}{:>8.3}",
        knob.value_of(&point.setting),
        told(point.cpu_s),
        told(point.wall_s),
        point.rays.total() as f64 / 1e6,
    );
    for (_, metric) in ERRORS {
        let _ = write!(line, "{:>10}", error(point, metric));
    }
    if estimates(summary) {
        let ratio = point
            .effectivity
            .map_or("-".to_owned(), |e| format!("{e:.2}"));
        let _ = write!(line, "{ratio:>10}");
    }
    line
}

fn error(point: &Point, metric: Metric) -> String {
    match point.shown(metric) {
        Some(value) => short(value),
        None => format!("<{}", short(point.limit.get(metric))),
    }
}

/// Three digits, in nine characters at most.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        0.001..1000.0 => {
            let before = value.abs().log10().floor() as i32;
            let decimals = (2 - before).clamp(0, 5) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.2e}"),
    }
}

/// Median, least and most; no figure without them.
fn told(spread: Option<Spread>) -> String {
    spread.map_or("-".to_owned(), |spread| {
        let (median, least, most) = (spread.median, spread.least, spread.most);
        format!("{} ({} to {})", short(median), short(least), short(most))
    })
}

fn order_line(knob: Knob, found: &Order) -> String {
    let Order {
        order, low, high, ..
    } = found;
    let what = match knob {
        Knob::Tolerance => "tolerance^",
        _ => "N^-",
    };
    let points = found.points;
    if *low <= 0.0 {
        return format!(
            "RMSE shows no order: it may rise as well as fall (95 %: {low:.2} to {high:.2}, {points} points)"
        );
    }
    format!("RMSE falls as {what}{order:.2} (95 %: {low:.2} to {high:.2}, {points} points)")
}

fn truth_lines(truth: &Truth, summary: &Summary) -> String {
    let mut text = format!("{}\n", reference_line(&truth.reference));
    for time in &truth.times {
        let _ = writeln!(text, "{}", time_line(time, summary.clock));
    }
    text
}

/// What the truth is, by which figures it agrees, and what it can't tell.
fn reference_line(reference: &Reference) -> String {
    let shading = reference.shading;
    let made_by = match reference.made_by {
        MadeBy::Ourselves => "two pictures of ours",
        MadeBy::OracleAndOurselves => "a picture of the f64 oracle and one of ours",
        MadeBy::Given => "as given",
    };
    let samples: Vec<String> = reference.samples.iter().map(u32::to_string).collect();
    let mut line = format!("reference ({shading}): {made_by}");
    if !samples.is_empty() {
        let _ = write!(
            line,
            ", {} samples, depth {}, weights down to {}",
            samples.join(" and "),
            reference.depth,
            reference.min_weight
        );
    }
    if let Some(agreement) = &reference.agreement {
        let _ = write!(line, "; the two differ by RMSE {}", short(agreement.rmse));
    }
    if let Some(truncation) = &reference.truncation {
        let _ = write!(line, "; deeper trees change {}", short(truncation.rmse));
    }
    if let Some(check) = &reference.oracle {
        let _ = write!(
            line,
            "; in {:.0} % of the pixels the f64 oracle's with the same samples is {} off",
            100.0 * check.share,
            short(check.rmse)
        );
    }
    if reference.agreement.is_some() && reference.truncation.is_none() && !samples.is_empty() {
        line.push_str("; what deeper trees change is not known, they take too long");
    }
    match reference.error() {
        Some(error) => {
            let _ = write!(
                line,
                "; so it is off by about {} itself, and errors below {} are not told",
                short(error.rmse),
                short(reference.limit().rmse)
            );
        }
        None => line.push_str("; its own error is not known, so small errors may be its own"),
    }
    line
}

fn time_line(time: &TimeToError, clock: Clock) -> String {
    let unit = match clock {
        Clock::Cpu => "CPU s",
        Clock::Wall => "s",
    };
    let cost = |time: TimeTo| match time {
        TimeTo::Cost(seconds) => short(seconds),
        TimeTo::AtMost(seconds) => format!("at most {}", short(seconds)),
        TimeTo::NotReached => "not reached".to_owned(),
    };
    let (median, least, most) = (cost(time.median), cost(time.least), cost(time.most));
    format!(
        "RMSE {:<6} takes {median} {unit} ({least} to {most})",
        time.rmse
    )
}

/// A line for each point: medians, least and most; empty where there is no spread, or where the reference can't tell.
#[must_use]
pub fn csv(summary: &Summary) -> String {
    let mut text = header().join(",") + "\n";
    for (index, point) in summary.points.iter().enumerate() {
        text.push_str(&cells(summary, index, point).join(","));
        text.push('\n');
    }
    text
}

/// Reads a time of a point.
type Time = fn(&Point) -> Option<Spread>;

/// Columns of times, three each.
const TIMES: [(&str, Time); 5] = [
    ("cpu_s", |point| point.cpu_s),
    ("wall_s", |point| point.wall_s),
    ("prepare_s", |point| point.prepare_s),
    ("compile_s", |point| point.compile_s),
    ("bvh_s", |point| point.bvh_s),
];

fn header() -> Vec<String> {
    let knobs = Knob::ALL.map(|knob| knob.name().replace('-', "_"));
    let times = TIMES
        .iter()
        .flat_map(|(name, _)| ["", "_least", "_most"].map(|suffix| format!("{name}{suffix}")));
    let rays = ["primary", "shadow", "reflection", "refraction"].map(|kind| format!("rays_{kind}"));
    let errors = Metric::ALL.map(|metric| metric.name().to_owned());
    let last = ["estimated_rmse", "effectivity", "dropped", "pareto"].map(str::to_owned);
    let runs = ["runs".to_owned()];
    knobs
        .into_iter()
        .chain(runs)
        .chain(times)
        .chain(rays)
        .chain(errors)
        .chain(last)
        .collect()
}

fn cells(summary: &Summary, index: usize, point: &Point) -> Vec<String> {
    let optional = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let knobs = Knob::ALL.map(|knob| knob.value_of(&point.setting));
    let runs = [point.wall_s.map_or(0, |spread| spread.runs).to_string()];
    let times = TIMES.iter().flat_map(|(_, time)| {
        let spread = time(point);
        [
            spread.map(|s| s.median),
            spread.map(|s| s.least),
            spread.map(|s| s.most),
        ]
        .map(optional)
    });
    let rays = point.rays;
    let rays = [rays.primary, rays.shadow, rays.reflection, rays.refraction];
    let errors = Metric::ALL.map(|metric| optional(point.shown(metric)));
    let on_front = |truth: &Truth| truth.front.contains(&index);
    let last = [
        optional(point.estimated_rmse),
        optional(point.effectivity),
        point.dropped.to_string(),
        summary.truths.iter().any(on_front).to_string(),
    ];
    knobs
        .into_iter()
        .chain(runs)
        .chain(times)
        .chain(rays.map(|count| count.to_string()))
        .chain(errors)
        .chain(last)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_summary;

    #[test]
    fn a_figure_without_its_spread_is_not_told() {
        let mut summary = test_summary::summary();
        assert!(
            table(&summary).contains("(0.100 to 0.130)"),
            "{}",
            table(&summary)
        );
        for point in &mut summary.points {
            point.cpu_s = None;
        }
        assert!(!table(&summary).contains("0.100 to"));
    }

    #[test]
    fn an_error_that_the_reference_cannot_tell_is_not_told() {
        let mut summary = test_summary::summary();
        let rmse = summary.points[3].measured.rmse;
        let told = short(rmse);
        assert!(table(&summary).contains(&told));
        summary.points[3].limit.rmse = 2.0 * rmse;
        let text = table(&summary);
        assert!(text.contains(&format!("<{}", short(2.0 * rmse))), "{text}");
        let line = csv(&summary).lines().nth(4).unwrap().to_owned();
        assert!(!line.contains(&rmse.to_string()), "{line}");
    }

    #[test]
    fn an_order_that_may_be_none_is_not_told_as_one() {
        let order = |low| Order {
            order: 0.5,
            low,
            high: 1.0,
            constant: 1.0,
            points: 5,
        };
        let told = order_line(Knob::Spp, &order(0.1));
        assert_eq!(told, "RMSE falls as N^-0.50 (95 %: 0.10 to 1.00, 5 points)");
        assert!(order_line(Knob::Spp, &order(-0.1)).contains("no order"));
    }

    #[test]
    fn every_line_of_csv_has_every_column() {
        let summary = test_summary::summary();
        let text = csv(&summary);
        let columns: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(columns.len(), summary.points.len() + 1);
        assert!(columns.iter().all(|n| *n == columns[0]), "{columns:?}");
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.0123456, "0.0123"),
            (1.23456, "1.23"),
            (12.3456, "12.3"),
            (123.456, "123"),
            (1e-5, "1.00e-5"),
            (1e6, "1.00e6"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
