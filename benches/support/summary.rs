//! What was measured, in the form that continuous-benchmark services read: a JSON array of names, units, values and ranges, where
//! smaller is better (github-action-benchmark's `customSmallerIsBetter`). No clock and no device: `tests/summary.rs` tests it.

use std::{
    fs, io,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use serde::{Deserialize, Serialize};

/// Results that are older than the newest by more belong to an earlier run, whose benches may not be there any more.
const ONE_RUN: Duration = Duration::from_secs(3600);

/// A figure of which less is better.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// What a history is kept by: `render/cornell`, `traversal/spheres/primary`.
    pub name: String,
    /// Of `value`: `ms`, `CPU ns a ray`, `x`.
    pub unit: String,
    /// A median.
    pub value: f64,
    /// How sure that is, in the same unit.
    pub range: String,
    /// For people.
    pub extra: String,
}

/// The median of some rounds, with the smallest and largest of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub median: f64,
    pub least: f64,
    pub most: f64,
}

impl Spread {
    /// # Panics
    /// Without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        Self {
            median: sorted[sorted.len() / 2],
            least: sorted[0],
            most: sorted[sorted.len() - 1],
        }
    }

    /// In another unit.
    pub fn times(self, factor: f64) -> Self {
        Self {
            median: factor * self.median,
            least: factor * self.least,
            most: factor * self.most,
        }
    }

    /// One over it.
    pub fn inverse(self) -> Self {
        Self {
            median: self.median.recip(),
            least: self.most.recip(),
            most: self.least.recip(),
        }
    }

    /// As a service takes it.
    pub fn record(self, name: &str, unit: &str, extra: &str) -> Record {
        Record {
            name: name.to_owned(),
            unit: unit.to_owned(),
            value: self.median,
            range: format!("{:.3} to {:.3}", self.least, self.most),
            extra: extra.to_owned(),
        }
    }
}

/// What criterion says of a bench in `benchmark.json`.
#[derive(Deserialize)]
struct Benchmark {
    full_id: String,
}

/// What it found, in `estimates.json`: nanoseconds, of the clock or of the CPU.
#[derive(Deserialize)]
struct Estimates {
    median: Estimate,
}

#[derive(Deserialize)]
struct Estimate {
    point_estimate: f64,
    confidence_interval: Interval,
}

#[derive(Deserialize)]
struct Interval {
    confidence_level: f64,
    lower_bound: f64,
    upper_bound: f64,
}

/// A bench of criterion's, by the two files that it leaves of each: the median and its confidence interval, milliseconds.
pub fn of_criterion(benchmark: &str, estimates: &str) -> serde_json::Result<Record> {
    let Benchmark { full_id } = serde_json::from_str(benchmark)?;
    let Estimates { median } = serde_json::from_str(estimates)?;
    let interval = median.confidence_interval;
    let ms = |nanoseconds: f64| nanoseconds * 1e-6;
    Ok(Record {
        name: full_id,
        unit: "ms".to_owned(),
        value: ms(median.point_estimate),
        range: format!(
            "{:.3} to {:.3}",
            ms(interval.lower_bound),
            ms(interval.upper_bound)
        ),
        extra: format!(
            "median; {:.0} % confidence",
            100.0 * interval.confidence_level
        ),
    })
}

/// Leaves what a bench without criterion has found where [`collect`] finds it.
pub fn leave(target: &Path, bench: &str, records: &[Record]) -> io::Result<()> {
    let folder = parts(target);
    fs::create_dir_all(&folder)?;
    fs::write(
        folder.join(bench).with_extension("json"),
        serde_json::to_string_pretty(records)?,
    )
}

fn parts(target: &Path) -> PathBuf {
    target.join("bench-parts")
}

/// All that the last run under a target folder has found, by name.
pub fn collect(target: &Path) -> io::Result<Vec<Record>> {
    let mut found = of_folder(&target.join("criterion"), of_criterion_folder)?;
    found.extend(of_folder(&parts(target), of_part)?);
    let newest = found.iter().map(|(written, _)| *written).max();
    let mut records: Vec<Record> = found
        .into_iter()
        .filter(|(written, _)| newest.is_some_and(|newest| newest <= *written + ONE_RUN))
        .flat_map(|(_, records)| records)
        .collect();
    records.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(records)
}

/// Records with when they were written.
type Written = (SystemTime, Vec<Record>);

/// What `read` makes of the files under a folder, which need not be there.
fn of_folder(
    folder: &Path,
    read: fn(&Path) -> io::Result<Option<Vec<Record>>>,
) -> io::Result<Vec<Written>> {
    let mut found = Vec::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            for entry in fs::read_dir(&path)? {
                pending.push(entry?.path());
            }
        } else if path.exists()
            && let Some(records) = read(&path)?
        {
            found.push((fs::metadata(&path)?.modified()?, records));
        }
    }
    Ok(found)
}

/// Only what lies in `new` was measured last; `base` and saved baselines lie beside it.
fn of_criterion_folder(path: &Path) -> io::Result<Option<Vec<Record>>> {
    if !path.ends_with("new/estimates.json") {
        return Ok(None);
    }
    let benchmark = fs::read_to_string(path.with_file_name("benchmark.json"))?;
    let record = of_criterion(&benchmark, &fs::read_to_string(path)?);
    Ok(Some(vec![record.map_err(|error| in_file(path, &error))?]))
}

fn of_part(path: &Path) -> io::Result<Option<Vec<Record>>> {
    let records = serde_json::from_str(&fs::read_to_string(path)?);
    records.map(Some).map_err(|error| in_file(path, &error))
}

fn in_file(path: &Path, error: &serde_json::Error) -> io::Error {
    io::Error::other(format!("{}: {error}", path.display()))
}
