//! The table.

use std::fmt::Write;

use raytree_gpu::DeviceInfo;
use serde_json::{Value, json};

/// What a figure is held to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Counts of what must not be have `AtMost(0.0)`.
    AtMost(f64),
    /// A floor.
    AtLeast(f64),
}

impl Limit {
    /// Is it kept? Never by NaN.
    #[must_use]
    pub fn holds(self, measured: f64) -> bool {
        match self {
            Self::AtMost(most) => measured <= most,
            Self::AtLeast(least) => measured >= least,
        }
    }
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::AtMost(most) => write!(f, "<= {}", figure(*most)),
            Self::AtLeast(least) => write!(f, ">= {}", figure(*least)),
        }
    }
}

/// One measurement of one case.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the case.
    pub case: &'static str,
    /// What was tried.
    pub parameter: String,
    /// What came out; NaN if nothing did.
    pub measured: f64,
    /// What it is held to.
    pub limit: Limit,
    /// Rays that were traced for it.
    pub rays: u64,
    /// Wall time, compiling included.
    pub seconds: f64,
    /// Why it failed, or how the figure is to be read.
    pub note: Option<String>,
}

impl Row {
    /// Does it hold?
    #[must_use]
    pub fn holds(&self) -> bool {
        self.limit.holds(self.measured)
    }

    /// "pass" or "FAIL".
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        if self.holds() { "pass" } else { "FAIL" }
    }
}

/// What a run of the suite measured.
#[derive(Clone, Debug)]
pub struct Report {
    /// What it ran on.
    pub device: DeviceInfo,
    /// In the order in which they were measured.
    pub rows: Vec<Row>,
}

const HEADINGS: [&str; 6] = ["case", "parameter", "measured", "limit", "rays", "verdict"];

impl Report {
    /// Does every row hold? An empty report does not: nothing was judged.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(Row::holds)
    }

    /// A table for the terminal, remarks below their rows.
    #[must_use]
    pub fn to_text(&self) -> String {
        let cells: Vec<[String; 6]> = self.rows.iter().map(cells).collect();
        let mut widths = HEADINGS.map(str::len);
        for row in &cells {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = (*width).max(cell.chars().count());
            }
        }
        let line = |row: [&str; 6]| {
            let padded: Vec<String> = row
                .iter()
                .zip(widths)
                .map(|(cell, width)| format!("{cell:<width$}"))
                .collect();
            padded.join("  ").trim_end().to_owned() + "\n"
        };
        let mut text = line(HEADINGS);
        for (row, cells) in self.rows.iter().zip(&cells) {
            text += &line(cells.each_ref().map(String::as_str));
            if let Some(note) = &row.note {
                let _ = writeln!(text, "  {note}"); // writing to a string can't fail
            }
        }
        text + &self.summary() + "\n"
    }

    /// A table in Markdown.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let line = |cells: [&str; 7]| {
            format!(
                "| {} |\n",
                cells.map(|cell| cell.replace('|', "\\|")).join(" | ")
            )
        };
        let [a, b, c, d, e, f] = HEADINGS;
        let mut text = line([a, b, c, d, e, f, "remark"]) + "|---|---|---|---|---|---|---|\n";
        for row in &self.rows {
            let [a, b, c, d, e, f] = &cells(row);
            text += &line([a, b, c, d, e, f, row.note.as_deref().unwrap_or("")]);
        }
        format!("{text}\n{}\n", self.summary())
    }

    /// All of it for machines. A figure that is not finite is null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|row| {
                let (kind, bound) = match row.limit {
                    Limit::AtMost(most) => ("at_most", most),
                    Limit::AtLeast(least) => ("at_least", least),
                };
                json!({
                    "case": row.case,
                    "parameter": row.parameter,
                    "measured": row.measured,
                    "limit": { kind: bound },
                    "rays": row.rays,
                    "seconds": row.seconds,
                    "holds": row.holds(),
                    "note": row.note,
                })
            })
            .collect();
        json!({
            "device": { "name": self.device.name, "driver": self.device.driver },
            "passed": self.passed(),
            "rows": rows,
        })
    }

    fn summary(&self) -> String {
        let failed = self.rows.iter().filter(|row| !row.holds()).count();
        let rays: u64 = self.rows.iter().map(|row| row.rays).sum();
        format!(
            "{} of {} rows hold, {rays} rays, on {} ({})",
            self.rows.len() - failed,
            self.rows.len(),
            self.device.name,
            self.device.driver
        )
    }
}

fn cells(row: &Row) -> [String; 6] {
    [
        row.case.to_owned(),
        row.parameter.clone(),
        figure(row.measured),
        row.limit.to_string(),
        row.rays.to_string(),
        row.verdict().to_owned(),
    ]
}

/// Whole numbers as they are, others with three digits.
fn figure(x: f64) -> String {
    if x.is_nan() {
        "-".to_owned()
    } else if x.fract() == 0.0 && x.abs() < 1e15 {
        format!("{x}")
    } else if (1e-3..1e6).contains(&x.abs()) {
        format!("{x:.6}").trim_end_matches('0').to_owned()
    } else {
        format!("{x:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(measured: f64, limit: Limit) -> Row {
        Row {
            case: "scale",
            parameter: "2^k | all".to_owned(),
            measured,
            limit,
            rays: 7,
            seconds: 0.5,
            note: Some("why".to_owned()),
        }
    }

    fn report(rows: Vec<Row>) -> Report {
        let device = DeviceInfo {
            name: "a device".to_owned(),
            driver: "a driver".to_owned(),
            cpu: true,
        };
        Report { device, rows }
    }

    #[test]
    fn a_row_outside_of_its_limit_fails_the_report() {
        let good = row(1e-6, Limit::AtMost(1e-5));
        for bad in [
            row(2e-5, Limit::AtMost(1e-5)),
            row(f64::NAN, Limit::AtMost(1e-5)),
            row(f64::NAN, Limit::AtLeast(0.0)),
            row(0.5, Limit::AtLeast(1.0)),
        ] {
            assert_eq!(bad.verdict(), "FAIL");
            assert!(!report(vec![good.clone(), bad]).passed());
        }
        assert!(report(vec![good]).passed());
        assert!(!report(vec![]).passed());
    }

    #[test]
    fn every_form_says_what_failed() {
        let report = report(vec![
            row(1e-6, Limit::AtMost(1e-5)),
            row(f64::NAN, Limit::AtMost(0.0)),
        ]);
        let text = report.to_text();
        assert!(
            text.contains("1.00e-6") && text.contains("FAIL") && text.contains("  why"),
            "{text}"
        );
        assert!(
            text.ends_with("1 of 2 rows hold, 14 rays, on a device (a driver)\n"),
            "{text}"
        );
        assert!(
            report
                .to_markdown()
                .contains("| scale | 2^k \\| all | - | <= 0 | 7 | FAIL | why |")
        );
        let json = report.to_json();
        assert_eq!(json["passed"], false);
        assert_eq!(json["rows"][0]["holds"], true);
        assert_eq!(json["rows"][1]["measured"], Value::Null);
    }
}
