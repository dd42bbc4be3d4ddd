//! A sampler with pictures that are functions of the place, so that all is known of them.

use raytree_film::progressive_pattern;

use super::*;
use crate::report::ErrorReport;

const SIDE: u32 = 48;
const MOST: u32 = 1025;

/// Radiance at a place, pixels from the upper left corner, and rays that it takes.
type Scene = fn(f64, f64) -> f32;

fn flat(_: f64, _: f64) -> f32 {
    0.5
}

fn gradient(x: f64, y: f64) -> f32 {
    (0.01 * x + 0.004 * y) as f32
}

fn edge(x: f64, y: f64) -> f32 {
    if (x - 20.3).hypot(y - 22.7) < 17.2 {
        1.0
    } else {
        0.1
    }
}

fn checkers(x: f64, y: f64) -> f32 {
    let distance = y + 6.0;
    let (u, v) = ((x - 24.0) * 12.0 / distance, 240.0 / distance);
    if (u.floor() + v.floor()) as i64 & 1 == 0 {
        0.9
    } else {
        0.2
    }
}

fn dots(x: f64, y: f64) -> f32 {
    let (u, v) = (x % 5.3 - 2.0, y % 4.7 - 2.0);
    if u * u + v * v < 0.8 { 4.0 } else { 0.25 }
}

struct Outcome {
    radiance: Vec<[f32; 3]>,
    alpha: Vec<f32>,
    report: ErrorReport,
    orders: u64,
}

/// Takes orders in portions of `at_once`, and at most `limit` of them all.
fn run(sampler: Sampler, scene: Scene, at_once: usize, limit: u64) -> Outcome {
    run_painted(
        sampler,
        scene,
        |value| [value, value, value, 1.0],
        at_once,
        limit,
    )
}

/// .. of what `paint` makes of the scene's values.
fn run_painted(
    mut sampler: Sampler,
    scene: Scene,
    paint: fn(f32) -> [f32; 4],
    at_once: usize,
    limit: u64,
) -> Outcome {
    let pattern = progressive_pattern(MOST);
    let mut orders_taken = 0;
    let sampled = |pixel: u32, sample: u32| {
        let [dx, dy] = pattern[sample as usize].map(f64::from);
        let (x, y) = (f64::from(pixel % SIDE), f64::from(pixel / SIDE));
        let value = scene(x + 0.5 + dx, y + 0.5 + dy);
        Sampled {
            radiance: paint(value),
            lost: 0.0,
            rays: 1,
        }
    };
    loop {
        sampler.decide();
        if sampler.takes_all().is_some() {
            let mut first = sampler.first_samples();
            (0..SIDE * SIDE).for_each(|pixel| first.take(pixel as usize, sampled(pixel, 0)));
            orders_taken += u64::from(SIDE * SIDE);
            continue;
        }
        let orders = sampler.next_orders(at_once);
        if orders.is_empty() || orders_taken >= limit {
            break;
        }
        for order in &orders {
            sampler.take(order, sampled(order.pixel, order.sample));
            orders_taken += 1;
        }
    }
    let Finished {
        radiance,
        alpha,
        report,
        ..
    } = sampler.finish();
    Outcome {
        radiance,
        alpha,
        report,
        orders: orders_taken,
    }
}

fn sampler(tolerance: f32, most: u32) -> Sampler {
    sampler_of(Tolerance::absolute(tolerance), most, false)
}

fn sampler_of(tolerance: Tolerance, most: u32, alpha_counts: bool) -> Sampler {
    let all = || (0..SIDE * SIDE).collect();
    Sampler::new((SIDE, SIDE), tolerance, most, 0.0, alpha_counts, all)
}

fn true_rmse(scene: Scene, picture: &[[f32; 3]]) -> f64 {
    let pattern = raytree_film::sample_pattern(2025);
    let errors = picture.iter().zip(0..).map(|(found, index)| {
        let (x, y) = (f64::from(index % SIDE), f64::from(index / SIDE));
        let value = |&[dx, dy]: &[f32; 2]| {
            f64::from(scene(x + 0.5 + f64::from(dx), y + 0.5 + f64::from(dy)))
        };
        let mean = pattern.iter().map(value).sum::<f64>() / pattern.len() as f64;
        (mean - f64::from(found[0])) as f32
    });
    root_mean_square(errors)
}

#[test]
fn the_tolerance_is_kept_and_the_estimate_is_above_the_error() {
    // Of dots that are smaller than a pixel and four times as bright as white, 1,025 samples don't give 0.01.
    let cases: [(_, Scene, &[f32]); 3] = [
        ("edge", edge, &[0.1, 0.03, 0.01]),
        ("checkers", checkers, &[0.1, 0.03, 0.01]),
        ("dots", dots, &[0.1, 0.03]),
    ];
    for (name, scene, tolerances) in cases {
        for &tolerance in tolerances {
            let Outcome {
                radiance, report, ..
            } = run(sampler(tolerance, MOST), scene, 1000, u64::MAX);
            let error = true_rmse(scene, &radiance);
            assert!(report.keeps_tolerance(), "{name} {tolerance}: {report:?}");
            assert!(error <= f64::from(tolerance), "{name} {tolerance}: {error}");
            let effectivity = report.estimated_rmse / error;
            assert!(
                (1.0..8.0).contains(&effectivity),
                "{name} {tolerance}: {effectivity}"
            );
        }
    }
}

#[test]
fn what_is_smooth_takes_a_sample_a_pixel() {
    for scene in [flat as Scene, gradient] {
        let report = run(sampler(0.01, MOST), scene, 1000, u64::MAX).report;
        assert_eq!(report.samples, u64::from(SIDE * SIDE), "{report:?}");
        assert_eq!(report.most_samples, 1);
    }
}

#[test]
fn samples_go_where_the_edge_is() {
    let outcome = run(sampler(0.01, MOST), edge, 1000, u64::MAX);
    let even = f64::from(SIDE * SIDE) * f64::from(outcome.report.most_samples);
    assert!(
        (outcome.report.samples as f64) < 0.2 * even,
        "{:?}",
        outcome.report
    );
}

/// What is black before a transparent background has its edges in alpha alone, and they count where alpha is seen.
#[test]
fn edges_of_alpha_are_edges() {
    let paint = |value: f32| [0.0, 0.0, 0.0, value];
    let run = |tolerance, alpha_counts| {
        let sampler = sampler_of(tolerance, MOST, alpha_counts);
        let outcome = run_painted(sampler, edge, paint, 1000, u64::MAX);
        let alpha: Vec<_> = outcome.alpha.iter().map(|&alpha| [alpha; 3]).collect();
        (true_rmse(edge, &alpha), outcome.report)
    };
    // Of what is opaque one percent is 0.01, however dark it is.
    for tolerance in [Tolerance::absolute(0.01), Tolerance::relative(0.01)] {
        let (error, report) = run(tolerance, true);
        assert!(report.keeps_tolerance(), "{tolerance:?} {report:?}");
        assert!(report.most_samples > 5, "{report:?}");
        assert!(
            error <= 0.01 && error <= report.estimated_rmse,
            "{error} {report:?}"
        );
    }
    let (error, report) = run(Tolerance::absolute(0.01), false);
    assert_eq!((report.most_samples, report.estimated_rmse), (1, 0.0));
    assert!(error > 0.01);
}

/// As much is decided, to the bit, whatever is taken at once.
#[test]
fn the_picture_does_not_depend_on_portions() {
    let all = run(sampler(0.02, MOST), checkers, usize::MAX, u64::MAX);
    for at_once in [1, 7, 640] {
        let portions = run(sampler(0.02, MOST), checkers, at_once, u64::MAX);
        // Thousands of numbers are no message.
        assert!(
            portions.radiance == all.radiance && portions.alpha == all.alpha,
            "portions of {at_once}"
        );
        assert_eq!(portions.report, all.report);
        assert_eq!(portions.orders, all.orders);
    }
}

#[test]
fn who_may_not_take_enough_samples_says_so() {
    let report = run(sampler(0.001, 5), checkers, 1000, u64::MAX).report;
    assert!(!report.keeps_tolerance(), "{report:?}");
    assert_eq!(report.most_samples, 5);
    assert!(report.estimated_rmse > 0.001);
}

/// Half a sample a pixel: all pixels show something, and what is not known is not said to be known.
#[test]
fn there_is_a_picture_however_early_it_ends() {
    for limit in [0, 10, 200, 1200] {
        let Outcome {
            radiance,
            alpha,
            report,
            ..
        } = run(sampler(1e-6, MOST).stepwise(), edge, 10, limit);
        assert_eq!(
            report.unsampled,
            u64::from(SIDE * SIDE) - report.samples.min(u64::from(SIDE * SIDE))
        );
        assert!(!report.keeps_tolerance());
        if limit >= 200 {
            assert!(alpha.iter().all(|&alpha| alpha == 1.0), "{limit}");
            let error = true_rmse(edge, &radiance);
            assert!(
                error < 0.35 && report.estimated_rmse > 0.5 * error,
                "{limit}: {error}, {report:?}"
            );
        }
    }
}

/// The longer, the better.
#[test]
fn steps_lead_to_the_tolerance() {
    let errors = [3000, 12_000, 50_000].map(|limit| {
        let outcome = run(sampler(1e-3, MOST).stepwise(), checkers, 500, limit);
        true_rmse(checkers, &outcome.radiance)
    });
    assert!(
        errors[0] > 1.5 * errors[1] && errors[1] > 1.5 * errors[2],
        "{errors:?}"
    );
}

/// Samples that lose half of what they are allowed, of branches that bring a fifth of the most that they could, or nothing.
#[test]
fn what_branches_bring_is_found_out() {
    let all = || (0..SIDE * SIDE).collect();
    let tolerance = Tolerance::absolute(0.1);
    let mut sampler = Sampler::new((SIDE, SIDE), tolerance, MOST, 1.0, false, all);
    let sampled = |sampler: &Sampler, pixel: u32, negligible: Negligible| {
        let lost = 2.0 * negligible.radiance();
        // What is said is relative to the scale.
        let share = if pixel.is_multiple_of(3) { 0.2 } else { 0.0 };
        let left_out = lost / sampler.branch_scale();
        let brought = 0.5 - (share - sampler.branch_mean()) * left_out;
        Sampled {
            radiance: [brought, brought, brought, 1.0],
            lost,
            rays: 1,
        }
    };
    let mut tried = 0;
    loop {
        sampler.decide();
        if let Some(negligible) = sampler.takes_all() {
            let come: Vec<_> = (0..SIDE * SIDE)
                .map(|pixel| sampled(&sampler, pixel, negligible))
                .collect();
            let mut first = sampler.first_samples();
            come.into_iter()
                .enumerate()
                .for_each(|(k, come)| first.take(k, come));
            continue;
        }
        let orders = sampler.next_orders(100);
        if orders.is_empty() {
            break;
        }
        tried += usize::from(sampler.is_trying()) * orders.len();
        for order in &orders {
            let come = sampled(&sampler, order.pixel, order.negligible);
            sampler.take(order, come);
        }
    }
    assert_eq!(tried, 2 * 12 * 12);
    let (scale, mean) = (sampler.branch_scale(), sampler.branch_mean());
    // A third brings 0.2, so in the mean they bring 0.067, and differ from that by 0.094.
    assert!((mean - 0.067).abs() < 0.01, "{mean}");
    assert!((scale - 2.0 * 0.094).abs() < 0.02, "{scale}");
    let finished = sampler.finish();
    let report = finished.report;
    assert!(report.keeps_tolerance(), "{report:?}");
    // Pilots are as all others: nothing is left of what was tried.
    assert!(
        finished
            .rays
            .iter()
            .zip(&finished.estimates.samples)
            .all(|(rays, samples)| rays == samples)
    );
    let errors = finished.radiance.iter().map(|radiance| radiance[0] - 0.5);
    let error = root_mean_square(errors);
    assert!(
        error > 0.0 && error <= report.lost_rmse && report.lost_rmse < 3.0 * error,
        "{error} {report:?}"
    );
}
