//! What is measured, as it is kept: lines of JSON that a run appends to, so that one that was interrupted goes on.

use raytree_film::Comparison;
use serde::{Deserialize, Serialize};

use crate::setting::{Bvh, Model, Setting};

/// How far a picture is from its reference, linear radiance (white = 1), nothing clipped but by FLIP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// [`Comparison::rmse`].
    pub rmse: f64,
    /// [`Comparison::relative_mse`].
    pub relative_mse: f64,
    /// [`Comparison::mean_abs`].
    pub mean_abs: f64,
    /// [`Comparison::p99_abs`].
    pub p99_abs: f64,
    /// [`Comparison::max_abs`].
    pub max_abs: f64,
    /// [`Comparison::flip_mean`].
    pub flip_mean: f64,
}

/// One of [`Errors`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// [`Errors::rmse`].
    Rmse,
    /// [`Errors::relative_mse`].
    RelativeMse,
    /// [`Errors::mean_abs`].
    MeanAbs,
    /// [`Errors::p99_abs`].
    P99Abs,
    /// [`Errors::max_abs`].
    MaxAbs,
    /// [`Errors::flip_mean`].
    FlipMean,
}

impl Metric {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 6] = [
        Self::Rmse,
        Self::RelativeMse,
        Self::MeanAbs,
        Self::P99Abs,
        Self::MaxAbs,
        Self::FlipMean,
    ];

    /// In files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rmse => "rmse",
            Self::RelativeMse => "relative_mse",
            Self::MeanAbs => "mean_abs",
            Self::P99Abs => "p99_abs",
            Self::MaxAbs => "max_abs",
            Self::FlipMean => "flip_mean",
        }
    }

    /// The power of the differences in it.
    fn power(self) -> i32 {
        match self {
            Self::RelativeMse => 2,
            _ => 1,
        }
    }
}

impl From<&Comparison> for Errors {
    /// FLIP that was not asked for is 0.
    fn from(comparison: &Comparison) -> Self {
        Self {
            rmse: comparison.rmse,
            relative_mse: comparison.relative_mse,
            mean_abs: comparison.mean_abs,
            p99_abs: comparison.p99_abs,
            max_abs: comparison.max_abs,
            flip_mean: comparison.flip_mean.unwrap_or_default(),
        }
    }
}

impl Errors {
    /// One of them.
    #[must_use]
    pub fn get(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Rmse => self.rmse,
            Metric::RelativeMse => self.relative_mse,
            Metric::MeanAbs => self.mean_abs,
            Metric::P99Abs => self.p99_abs,
            Metric::MaxAbs => self.max_abs,
            Metric::FlipMean => self.flip_mean,
        }
    }

    fn from_each(value: impl Fn(Metric) -> f64) -> Self {
        Self {
            rmse: value(Metric::Rmse),
            relative_mse: value(Metric::RelativeMse),
            mean_abs: value(Metric::MeanAbs),
            p99_abs: value(Metric::P99Abs),
            max_abs: value(Metric::MaxAbs),
            flip_mean: value(Metric::FlipMean),
        }
    }

    /// Those of differences that are `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self::from_each(|metric| self.get(metric) * factor.powi(metric.power()))
    }

    /// Those of errors from several sources that know nothing of each other: squares add up.
    #[must_use]
    pub fn combined(parts: &[Self]) -> Self {
        Self::from_each(|metric| {
            let exponent = f64::from(2 / metric.power());
            let sum: f64 = parts
                .iter()
                .map(|part| part.get(metric).powf(exponent))
                .sum();
            sum.powf(exponent.recip())
        })
    }
}

/// Errors below so many of the reference's own are not told: a third of what is told may be the reference's.
pub const RESOLVED: f64 = 3.0;

/// What the truth is taken to be, and how far that can be trusted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Whose truth it is.
    pub shading: Model,
    /// Whose pictures it is the mean of.
    pub made_by: MadeBy,
    /// Samples a pixel of each.
    pub samples: Vec<u32>,
    /// Levels of its trees.
    pub depth: u32,
    /// Its least weight.
    pub min_weight: f64,
    /// By how much the two differ. The mean of two that know nothing of each other is off by half of that.
    pub agreement: Option<Errors>,
    /// By how much a picture of few samples changes with twice the depth and a tenth of the least weight. `None`: those trees take too
    /// long.
    pub truncation: Option<Errors>,
    /// By how much our picture differs from the f64 oracle's with the same samples.
    pub oracle: Option<OracleCheck>,
}

/// Who renders references.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MadeBy {
    /// This renderer, twice, by two sample patterns.
    Ourselves,
    /// The f64 oracle and this renderer, by two sample patterns.
    OracleAndOurselves,
    /// Files from the command line.
    Given,
}

/// What of a reference the oracle has looked at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OracleCheck {
    /// Share of the pixels, 0 to 1.
    pub share: f64,
    /// Root of the mean squared difference in them.
    pub rmse: f64,
}

impl Reference {
    /// What it may be off by itself, from all that is known. `None`: nothing is, since a single picture was given.
    #[must_use]
    pub fn error(&self) -> Option<Errors> {
        let mean = self.agreement?.scaled(0.5);
        let rounding = self.oracle.map(|check| Errors {
            rmse: check.rmse,
            ..Errors::default()
        });
        let parts: Vec<Errors> = [Some(mean), self.truncation, rounding]
            .into_iter()
            .flatten()
            .collect();
        Some(Errors::combined(&parts))
    }

    /// The least errors that can be told by it: [`RESOLVED`] times its own.
    #[must_use]
    pub fn limit(&self) -> Errors {
        self.error().unwrap_or_default().scaled(RESOLVED)
    }
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rays {
    /// From the camera.
    pub primary: u64,
    /// To lights.
    pub shadow: u64,
    /// Reflected.
    pub reflection: u64,
    /// Transmitted.
    pub refraction: u64,
}

impl Rays {
    /// Of all kinds.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.reflection + self.refraction
    }
}

/// What does not depend on the machine's mood: taken once a setting, with counters on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Of which setting.
    pub setting: Setting,
    /// Against the reference.
    pub errors: Errors,
    /// What it took.
    pub rays: Rays,
    /// Branches that were dropped for want of room.
    pub dropped: u64,
    /// Of the picture's bits: runs of the same setting have to give the same.
    pub fingerprint: u64,
    /// What the renderer itself said that its error is, if it did.
    pub estimated_rmse: Option<f64>,
}

/// A timed run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Of which setting.
    pub setting: Setting,
    /// Runs of a round were measured one after the other; from 0.
    pub round: u32,
    /// Counted up whenever measuring goes on after an interruption; from 0.
    pub session: u32,
    /// Rendering and reading back, seconds by the clock on the wall.
    pub wall_s: f64,
    /// The same, CPU seconds of all threads; `None` where the system does not say.
    pub cpu_s: Option<f64>,
    /// Layout, upload, pipelines: wall seconds.
    pub prepare_s: f64,
    /// The driver's compiler, with its cache as it is: wall seconds.
    pub compile_s: f64,
}

/// A timed build of a hierarchy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Build {
    /// How.
    pub bvh: Bvh,
    /// As in [`Run::round`].
    pub round: u32,
    /// Wall seconds.
    pub wall_s: f64,
}

/// A line of what is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum Record {
    /// The first one: what the others belong to.
    Subject {
        /// All that decides pictures and times but the setting.
        key: String,
    },
    /// A picture's errors.
    Picture(Picture),
    /// A run's times.
    Run(Run),
    /// A hierarchy's time.
    Build(Build),
}

/// All that was kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journal {
    /// Of the subject, if there is one.
    pub key: Option<String>,
    /// One a setting.
    pub pictures: Vec<Picture>,
    /// In the order in which they were measured.
    pub runs: Vec<Run>,
    /// The same.
    pub builds: Vec<Build>,
}

impl Journal {
    /// Reads what was kept. A last line without an end was cut off by a kill, and is not there.
    ///
    /// # Errors
    /// The number of the first line, from 1, that is none of ours.
    pub fn parse(text: &str) -> Result<Self, usize> {
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let mut journal = Self::default();
        for (number, line) in (1_usize..).zip(whole.lines()) {
            let record = serde_json::from_str(line).map_err(|_| number)?;
            journal.add(record);
        }
        if journal.key.is_none() && !whole.is_empty() {
            return Err(1);
        }
        Ok(journal)
    }

    /// Adds a record.
    pub fn add(&mut self, record: Record) {
        match record {
            Record::Subject { key } => self.key = Some(key),
            Record::Picture(picture) => self.pictures.push(picture),
            Record::Run(run) => self.runs.push(run),
            Record::Build(build) => self.builds.push(build),
        }
    }

    /// A setting's picture, if it is there.
    #[must_use]
    pub fn picture(&self, setting: &Setting) -> Option<&Picture> {
        self.pictures
            .iter()
            .find(|picture| picture.setting == *setting)
    }

    /// Has a setting been timed in this round?
    #[must_use]
    pub fn has_run(&self, setting: &Setting, round: u32) -> bool {
        self.runs
            .iter()
            .any(|run| run.round == round && run.setting == *setting)
    }

    /// Has a hierarchy been built in this round?
    #[must_use]
    pub fn has_build(&self, bvh: Bvh, round: u32) -> bool {
        self.builds
            .iter()
            .any(|build| build.round == round && build.bvh == bvh)
    }

    /// The session that begins now.
    #[must_use]
    pub fn next_session(&self) -> u32 {
        self.runs
            .iter()
            .map(|run| run.session.saturating_add(1))
            .max()
            .unwrap_or_default()
    }
}

/// A record as its line, end included.
///
/// # Errors
/// Never, but for numbers that JSON has no words for.
pub fn line(record: &Record) -> serde_json::Result<String> {
    serde_json::to_string(record).map(|text| text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(value: f64) -> Errors {
        Errors::from_each(|metric| value.powi(metric.power()))
    }

    fn run(round: u32) -> Record {
        Record::Run(Run {
            setting: Setting::default(),
            round,
            session: 3,
            wall_s: 0.1,
            cpu_s: None,
            prepare_s: 0.01,
            compile_s: 0.02,
        })
    }

    #[test]
    fn a_journal_reads_what_was_written_but_half_a_line() {
        let subject = Record::Subject {
            key: "scene".to_owned(),
        };
        let lines: String = [subject, run(0), run(1)]
            .iter()
            .map(|record| line(record).unwrap())
            .collect();
        let journal = Journal::parse(&lines).unwrap();
        assert_eq!(journal.key.as_deref(), Some("scene"));
        assert!(journal.has_run(&Setting::default(), 1));
        assert!(!journal.has_run(&Setting::default(), 2));
        assert_eq!(journal.next_session(), 4);
        let cut = &lines[..lines.len() - 10];
        assert_eq!(Journal::parse(cut).unwrap().runs.len(), 1);
        assert_eq!(Journal::parse("").unwrap(), Journal::default());
    }

    #[test]
    fn what_is_no_journal_is_refused_with_the_line() {
        let text = line(&run(0)).unwrap();
        assert_eq!(Journal::parse(&text), Err(1), "no subject");
        let subject = "{\"record\":\"subject\",\"key\":\"x\"}\n";
        assert_eq!(
            Journal::parse(&format!("{subject}nonsense\n{text}")),
            Err(2)
        );
    }

    #[test]
    fn squares_of_errors_add_up_and_scale() {
        let both = Errors::combined(&[errors(3.0), errors(4.0)]);
        for metric in Metric::ALL {
            let found = both.get(metric);
            assert!(
                (found - errors(5.0).get(metric)).abs() < 1e-9,
                "{metric:?}: {found}"
            );
        }
        assert_eq!(errors(3.0).scaled(0.5).relative_mse, 9.0 / 4.0);
    }

    #[test]
    fn a_reference_is_trusted_as_far_as_it_is_known() {
        let mut reference = Reference {
            shading: Model::Pbr,
            made_by: MadeBy::Ourselves,
            samples: vec![100, 121],
            depth: 32,
            min_weight: 1e-4,
            agreement: Some(errors(0.008)),
            truncation: Some(errors(0.003)),
            oracle: None,
        };
        assert!((reference.error().unwrap().rmse - 0.005).abs() < 1e-12);
        assert!((reference.limit().rmse - 0.015).abs() < 1e-12);
        reference.oracle = Some(OracleCheck {
            share: 0.1,
            rmse: 0.012,
        });
        assert!((reference.error().unwrap().rmse - 0.013).abs() < 1e-12);
        reference.agreement = None;
        assert_eq!(reference.error(), None);
        assert_eq!(reference.limit().rmse, 0.0);
    }
}
