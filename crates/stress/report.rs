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
    /// What came out by the book's numerics ([`raytree_gpu::Numerics::book`]), if that was tried; held to nothing.
    pub book: Option<f64>,
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

impl Report {
    /// Was anything measured by the book's numerics too?
    fn is_beside_book(&self) -> bool {
        self.rows.iter().any(|row| row.book.is_some())
    }

    fn headings(&self) -> Vec<&'static str> {
        let book = self.is_beside_book().then_some("by the book");
        ["case", "parameter", "measured"]
            .into_iter()
            .chain(book)
            .chain(["limit", "rays", "verdict"])
            .collect()
    }

    fn cells(&self, row: &Row) -> Vec<String> {
        let book = self
            .is_beside_book()
            .then(|| row.book.map_or_else(|| "-".to_owned(), figure));
        [
            row.case.to_owned(),
            row.parameter.clone(),
            figure(row.measured),
        ]
        .into_iter()
        .chain(book)
        .chain([
            row.limit.to_string(),
            row.rays.to_string(),
            row.verdict().to_owned(),
        ])
        .collect()
    }
}

impl Report {
    /// Does every row hold? An empty report does not: nothing was judged.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(Row::holds)
    }

    /// A table for the terminal, remarks below their rows.
    #[must_use]
    pub fn to_text(&self) -> String {
        let headings = self.headings().into_iter().map(str::to_owned).collect();
        let lines: Vec<Vec<String>> = std::iter::once(headings)
            .chain(self.rows.iter().map(|row| self.cells(row)))
            .collect();
        let width = |column: usize| {
            let widths = lines.iter().map(|line| line[column].chars().count());
            widths.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
        let notes = std::iter::once(None).chain(self.rows.iter().map(|row| row.note.as_ref()));
        let mut text = String::new();
        for (line, note) in lines.iter().zip(notes) {
            let padded: Vec<String> = line
                .iter()
                .zip(&widths)
                .map(|(cell, width)| format!("{cell:<width$}"))
                .collect();
            text += padded.join("  ").trim_end();
            text += "\n";
            if let Some(note) = note {
                let _ = writeln!(text, "  {note}"); // writing to a string can't fail
            }
        }
        text + &self.summary() + "\n"
    }

    /// A table in Markdown.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let mut headings: Vec<String> = self.headings().into_iter().map(str::to_owned).collect();
        headings.push("remark".to_owned());
        let rule = "|---".repeat(headings.len()) + "|\n";
        let mut text = line(headings) + &rule;
        for row in &self.rows {
            let mut cells = self.cells(row);
            cells.push(row.note.clone().unwrap_or_default());
            text += &line(cells);
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
                    "book": row.book,
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
            book: None,
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
        assert!(!text.contains("book") && !report.to_markdown().contains("book"));
        let json = report.to_json();
        assert_eq!(json["passed"], false);
        assert_eq!(json["rows"][0]["holds"], true);
        assert_eq!(json["rows"][1]["measured"], Value::Null);
    }

    #[test]
    fn what_the_book_gives_has_a_column_of_its_own() {
        let mut compared = row(0.0, Limit::AtMost(0.0));
        compared.book = Some(1234.0);
        let report = report(vec![compared, row(0.5, Limit::AtMost(1.0))]);
        assert!(report.passed(), "the book is held to nothing");
        let text = report.to_text();
        assert!(
            text.starts_with("case   parameter  measured  by the book  limit"),
            "{text}"
        );
        assert!(text.contains("0         1234         <= 0"), "{text}");
        let markdown = report.to_markdown();
        assert!(
            markdown.contains("|---|---|---|---|---|---|---|---|"),
            "{markdown}"
        );
        assert!(
            markdown.contains("| 0 | 1234 | <= 0 |") && markdown.contains("| 0.5 | - | <= 1 |")
        );
        assert_eq!(report.to_json()["rows"][0]["book"], 1234.0);
        assert_eq!(report.to_json()["rows"][1]["book"], Value::Null);
    }
}
