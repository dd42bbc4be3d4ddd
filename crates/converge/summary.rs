//! From what was measured to what is told: medians with spreads, ladders with orders, fronts, times to errors.

use serde::Serialize;

use crate::measurement::{Errors, Journal, Metric, Rays, Reference};
use crate::setting::{Knob, Setting};
use crate::statistics::{Order, Spread, TimeTo, order_of_convergence, pareto_front, time_to_error};
use crate::sweep::Sweep;

/// By which clock runs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Seconds of all threads: what others do on the machine hardly shows.
    Cpu,
    /// Seconds that somebody waits.
    Wall,
}

/// What was rendered, on what.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Subject {
    /// The scene's name, without folder and ending.
    pub scene: String,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// The device's name.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// The command that makes it again.
    pub command: String,
}

/// A setting, and all that was measured of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Which one.
    pub setting: Setting,
    /// Rendering, wall seconds; `None` with fewer than two runs.
    pub wall_s: Option<Spread>,
    /// Rendering, CPU seconds; `None` where the system does not say, too.
    pub cpu_s: Option<Spread>,
    /// Layout, upload, pipelines, wall seconds.
    pub prepare_s: Option<Spread>,
    /// The driver's compiler, wall seconds.
    pub compile_s: Option<Spread>,
    /// Building its hierarchy, wall seconds.
    pub bvh_s: Option<Spread>,
    /// By kind.
    pub rays: Rays,
    /// As measured. What is below the reference's limit is not to be shown: [`Self::shown`].
    #[serde(skip)]
    pub measured: Errors,
    /// The limit.
    #[serde(skip)]
    pub limit: Errors,
    /// What can be told.
    pub errors: ShownErrors,
    /// Branches that were dropped for want of room.
    pub dropped: u64,
    /// The renderer's own estimate.
    pub estimated_rmse: Option<f64>,
    /// The estimate over the true error: above 1 the renderer was careful.
    pub effectivity: Option<f64>,
}

/// [`Errors`] as far as the reference can tell them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShownErrors {
    rmse: Option<f64>,
    relative_mse: Option<f64>,
    mean_abs: Option<f64>,
    p99_abs: Option<f64>,
    max_abs: Option<f64>,
    flip_mean: Option<f64>,
}

impl Point {
    /// An error, unless the reference can't tell it.
    #[must_use]
    pub fn shown(&self, metric: Metric) -> Option<f64> {
        shown(&self.measured, &self.limit, metric)
    }

    /// Seconds by a clock.
    #[must_use]
    pub fn time(&self, clock: Clock) -> Option<Spread> {
        match clock {
            Clock::Cpu => self.cpu_s,
            Clock::Wall => self.wall_s,
        }
    }
}

fn shown(measured: &Errors, limit: &Errors, metric: Metric) -> Option<f64> {
    let value = measured.get(metric);
    (value >= limit.get(metric)).then_some(value)
}

/// A ladder, measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredLadder {
    /// What is turned.
    pub knob: Knob,
    /// What is not.
    pub fixed: String,
    /// Indices of points.
    pub points: Vec<usize>,
    /// RMSE against samples, or against the tolerance; of other knobs no power law is to be expected.
    pub order: Option<Order>,
    /// RMSE against time.
    pub order_in_time: Option<Order>,
}

/// All that shares a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// The reference.
    pub reference: Reference,
    /// What it may be off by itself.
    pub reference_error: Option<Errors>,
    /// Indices of the points that nothing beats in time and RMSE.
    pub front: Vec<usize>,
    /// Time to a few errors along the front.
    pub times: Vec<TimeToError>,
}

/// When the front reaches an RMSE.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeToError {
    /// The RMSE.
    pub rmse: f64,
    /// By the medians.
    pub median: TimeTo,
    /// By the least times.
    pub least: TimeTo,
    /// By the longest.
    pub most: TimeTo,
}

/// All there is to tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Of what.
    pub subject: Subject,
    /// By which clock fronts and times are.
    pub clock: Clock,
    /// How often measuring was begun; runs of different ones were not interleaved.
    pub sessions: u32,
    /// Every setting once.
    pub points: Vec<Point>,
    /// Which belong together.
    pub ladders: Vec<MeasuredLadder>,
    /// One for each shading model.
    pub truths: Vec<Truth>,
}

impl Summary {
    /// Sums up what the journal has of the sweep. CPU time is only compared where every point has it, and more than the kernel's
    /// clock can miss.
    #[must_use]
    pub fn new(
        subject: Subject,
        sweep: &Sweep,
        journal: &Journal,
        references: &[Reference],
        wanted: Clock,
    ) -> Self {
        let points: Vec<Point> = sweep
            .settings()
            .iter()
            .filter_map(|setting| point(setting, journal, references))
            .collect();
        let has_cpu = |point: &Point| point.cpu_s.is_some_and(|cpu| cpu.least > 0.0);
        let all_have_cpu = points.iter().all(has_cpu);
        let clock = if all_have_cpu { wanted } else { Clock::Wall };
        let ladders = sweep.ladders.iter().map(|ladder| {
            let place =
                |setting: &Setting| points.iter().position(|point| point.setting == *setting);
            let indices: Vec<usize> = ladder.settings.iter().filter_map(place).collect();
            let order =
                |x: &dyn Fn(&Point) -> Option<f64>| order(&points, &indices, ladder.knob, x);
            MeasuredLadder {
                knob: ladder.knob,
                fixed: ladder.fixed.clone(),
                order: order(&|point| ladder.knob.fineness(&point.setting)),
                order_in_time: order(&|point| point.time(clock).map(|time| time.median)),
                points: indices,
            }
        });
        let ladders = ladders.collect();
        let truths = references
            .iter()
            .map(|reference| truth(reference, &points, clock))
            .collect();
        Self {
            subject,
            clock,
            sessions: journal.next_session(),
            points,
            ladders,
            truths,
        }
    }
}

fn point(setting: &Setting, journal: &Journal, references: &[Reference]) -> Option<Point> {
    let picture = journal.picture(setting)?;
    let runs = || journal.runs.iter().filter(|run| run.setting == *setting);
    let spread = |values: Vec<f64>| Spread::of(&values);
    let builds = journal
        .builds
        .iter()
        .filter(|build| build.bvh == setting.bvh);
    let limit = references
        .iter()
        .find(|reference| reference.shading == setting.shading)
        .map(Reference::limit)
        .unwrap_or_default();
    let shown = |metric| shown(&picture.errors, &limit, metric);
    let all_cpu: Option<Vec<f64>> = runs().map(|run| run.cpu_s).collect();
    let effectivity = picture
        .estimated_rmse
        .zip(shown(Metric::Rmse))
        .map(|(estimated, rmse)| estimated / rmse);
    Some(Point {
        setting: *setting,
        wall_s: spread(runs().map(|run| run.wall_s).collect()),
        cpu_s: all_cpu.and_then(spread),
        prepare_s: spread(runs().map(|run| run.prepare_s).collect()),
        compile_s: spread(runs().map(|run| run.compile_s).collect()),
        bvh_s: spread(builds.map(|build| build.wall_s).collect()),
        rays: picture.rays,
        measured: picture.errors,
        limit,
        errors: ShownErrors {
            rmse: shown(Metric::Rmse),
            relative_mse: shown(Metric::RelativeMse),
            mean_abs: shown(Metric::MeanAbs),
            p99_abs: shown(Metric::P99Abs),
            max_abs: shown(Metric::MaxAbs),
            flip_mean: shown(Metric::FlipMean),
        },
        dropped: picture.dropped,
        estimated_rmse: picture.estimated_rmse,
        effectivity,
    })
}

/// One sample lies in the middle of the pixel, more follow a filter: they don't converge to one picture, so it is left out.
fn order(
    points: &[Point],
    indices: &[usize],
    knob: Knob,
    x: &dyn Fn(&Point) -> Option<f64>,
) -> Option<Order> {
    if !matches!(knob, Knob::Spp | Knob::Tolerance) {
        return None;
    }
    let pairs: Vec<(f64, f64)> = indices
        .iter()
        .map(|index| &points[*index])
        .filter(|point| point.setting.spp > 1)
        .filter_map(|point| Some((x(point)?, point.shown(Metric::Rmse)?)))
        .collect();
    order_of_convergence(&pairs)
}

fn truth(reference: &Reference, points: &[Point], clock: Clock) -> Truth {
    let mut front_points: Vec<(usize, Spread, f64)> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let same = point.setting.shading == reference.shading;
        let told = point.time(clock).zip(point.shown(Metric::Rmse));
        if let (true, Some((time, rmse))) = (same, told) {
            front_points.push((index, time, rmse));
        }
    }
    let pairs: Vec<(f64, f64)> = front_points
        .iter()
        .map(|(_, time, rmse)| (time.median, *rmse))
        .collect();
    let front: Vec<(usize, Spread, f64)> = pareto_front(&pairs)
        .into_iter()
        .map(|i| front_points[i])
        .collect();
    Truth {
        reference: reference.clone(),
        reference_error: reference.error(),
        times: times(&front),
        front: front.iter().map(|(index, ..)| *index).collect(),
    }
}

/// Errors that are told: 1 and 3 times the powers of ten that lie within the front.
fn times(front: &[(usize, Spread, f64)]) -> Vec<TimeToError> {
    let along = |time: fn(&Spread) -> f64| -> Vec<(f64, f64)> {
        front
            .iter()
            .map(|(_, spread, rmse)| (time(spread), *rmse))
            .collect()
    };
    let medians = along(|spread| spread.median);
    let least = along(|spread| spread.least);
    let most = along(|spread| spread.most);
    let (Some(first), Some(last)) = (medians.first(), medians.last()) else {
        return Vec::new();
    };
    (-12..=3)
        .rev()
        .flat_map(|exponent| [3.0, 1.0].map(|digit: f64| digit * 10.0_f64.powi(exponent)))
        .filter(|rmse| (last.1..=first.1).contains(rmse))
        .map(|rmse| TimeToError {
            rmse,
            median: time_to_error(&medians, rmse),
            least: time_to_error(&least, rmse),
            most: time_to_error(&most, rmse),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Record;
    use crate::test_summary::{journal, reference, summary, sweep};

    #[test]
    fn the_order_is_that_of_the_samples_without_the_first() {
        let summary = summary();
        let order = summary.ladders[0].order.unwrap();
        assert_eq!(order.points, 5);
        // 0.1 exp(-8) stays when the samples have done their part.
        assert!((0.7..0.76).contains(&order.order), "{order:?}");
        assert_eq!(summary.ladders[1].order, None);
        assert_eq!(summary.points.len(), 8);
    }

    #[test]
    fn the_front_leaves_out_what_is_beaten_and_what_cannot_be_told() {
        let found = summary();
        let truth = &found.truths[0];
        assert_eq!(truth.reference_error.unwrap().rmse, 0.001);
        let rmse: Vec<f64> = truth
            .front
            .iter()
            .map(|i| found.points[*i].measured.rmse)
            .collect();
        assert!(rmse.windows(2).all(|pair| pair[1] < pair[0]), "{rmse:?}");
        assert!(rmse.iter().all(|rmse| *rmse >= 0.003));
        assert!(!truth.times.is_empty());

        let mut coarse = reference();
        coarse.agreement = coarse.agreement.map(|errors| errors.scaled(100.0));
        let found = Summary::new(
            Subject::default(),
            &sweep(),
            &journal(),
            &[coarse],
            Clock::Cpu,
        );
        assert!(found.truths[0].front.is_empty());
        assert!(found.ladders[0].order.is_none());
    }

    #[test]
    fn without_cpu_seconds_everywhere_the_walls_clock_counts() {
        let mut journal = journal();
        journal.runs[0].cpu_s = None;
        let found = Summary::new(
            Subject::default(),
            &sweep(),
            &journal,
            &[reference()],
            Clock::Cpu,
        );
        assert_eq!(found.clock, Clock::Wall);
    }

    #[test]
    fn the_estimate_is_held_against_the_truth() {
        let mut journal = journal();
        let mut picture = journal.pictures.remove(0);
        picture.estimated_rmse = Some(2.0 * picture.errors.rmse);
        journal.add(Record::Picture(picture));
        let found = Summary::new(
            Subject::default(),
            &sweep(),
            &journal,
            &[reference()],
            Clock::Cpu,
        );
        assert_eq!(found.points[0].effectivity, Some(2.0));
        assert_eq!(found.points[1].effectivity, None);
    }
}
