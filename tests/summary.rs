//! The benches' machine-readable summary, from files as criterion writes them.

#[path = "../benches/support/summary.rs"]
#[allow(dead_code, reason = "what only benches use")]
mod summary;

use std::{
    fs::{self, File},
    path::Path,
    time::{Duration, SystemTime},
};

use summary::{Record, Spread, collect, leave, of_criterion};

/// Criterion 0.8.
const BENCHMARK: &str = r#"{"group_id":"render","function_id":"cornell","value_str":null,"throughput":{"Elements":49152},
    "full_id":"render/cornell","directory_name":"render/cornell","title":"render/cornell"}"#;

const ESTIMATES: &str = r#"{
    "mean":{"confidence_interval":{"confidence_level":0.95,"lower_bound":1.0,"upper_bound":9.0},"point_estimate":5.0,"standard_error":2.0},
    "median":{"confidence_interval":{"confidence_level":0.95,"lower_bound":80500000.0,"upper_bound":90250000.0},
        "point_estimate":84000000.0,"standard_error":2000000.0},
    "slope":null}"#;

fn cornell() -> Record {
    Record {
        name: "render/cornell".to_owned(),
        unit: "ms".to_owned(),
        value: 84.0,
        range: "80.500 to 90.250".to_owned(),
        extra: "median; 95 % confidence".to_owned(),
    }
}

/// A bench of criterion's as it lies on disk.
fn lay_out(target: &Path, folder: &str) {
    let folder = target.join("criterion").join(folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("benchmark.json"), BENCHMARK).unwrap();
    fs::write(folder.join("estimates.json"), ESTIMATES).unwrap();
}

#[test]
fn criterion_is_read() {
    assert_eq!(of_criterion(BENCHMARK, ESTIMATES).unwrap(), cornell());
    assert!(of_criterion("{}", ESTIMATES).is_err());
    assert!(of_criterion(BENCHMARK, &ESTIMATES.replace("median", "mode")).is_err());
}

#[test]
fn rounds_become_a_median_and_what_it_lies_between() {
    let spread = Spread::of([3.0, 1.0, 2.0, 9.0, 2.5]);
    let (median, least, most) = (2.5, 1.0, 9.0);
    assert_eq!(
        spread,
        Spread {
            median,
            least,
            most
        }
    );
    let record = spread.record("traversal/terrain/shadow", "x", "median of 5");
    assert_eq!(record.value, 2.5);
    assert_eq!(record.range, "1.000 to 9.000");
}

/// Of which more is better, the summary keeps the inverse; the least of one is the most of the other.
#[test]
fn a_spread_can_be_turned_over_and_told_in_another_unit() {
    let spread = Spread::of([2.0, 4.0, 1.0]);
    let spread_of = |median, least, most| Spread {
        median,
        least,
        most,
    };
    assert_eq!(spread.inverse(), spread_of(0.5, 0.25, 1.0));
    assert_eq!(spread.times(1e3), spread_of(2e3, 1e3, 4e3));
}

#[test]
fn nothing_measured_is_an_empty_summary() {
    let target = tempfile::tempdir().unwrap();
    assert_eq!(collect(target.path()).unwrap(), []);
}

#[test]
fn what_was_measured_last_is_gathered_by_name() {
    let target = tempfile::tempdir().unwrap();
    let ratio = Spread::of([1.5]).record("numerics/all", "x", "");
    lay_out(target.path(), "render/cornell/new");
    lay_out(target.path(), "render/cornell/base");
    leave(target.path(), "numerics", std::slice::from_ref(&ratio)).unwrap();
    assert_eq!(collect(target.path()).unwrap(), [ratio, cornell()]);
}

#[test]
fn an_earlier_run_does_not_count() {
    let target = tempfile::tempdir().unwrap();
    lay_out(target.path(), "render/cornell/new");
    leave(
        target.path(),
        "gone",
        &[Spread::of([1.5]).record("gone", "x", "")],
    )
    .unwrap();
    let two_hours_ago = SystemTime::now() - Duration::from_secs(7200);
    let file = File::options()
        .write(true)
        .open(target.path().join("bench-parts/gone.json"));
    file.unwrap().set_modified(two_hours_ago).unwrap();
    assert_eq!(collect(target.path()).unwrap(), [cornell()]);
}

/// A service takes a list of objects with these names, values being numbers.
#[test]
fn the_form_is_what_services_take() {
    let text = serde_json::to_string(&[cornell()]).unwrap();
    let expected = r#"[{"name":"render/cornell","unit":"ms","value":84.0,"range":"80.500 to 90.250","extra":"median; 95 % confidence"}]"#;
    assert_eq!(text, expected);
}

/// A file that is cut short is no empty result.
#[test]
fn a_broken_file_is_named() {
    let target = tempfile::tempdir().unwrap();
    lay_out(target.path(), "render/cornell/new");
    let path = target
        .path()
        .join("criterion/render/cornell/new/estimates.json");
    fs::write(path, "{").unwrap();
    let error = collect(target.path()).unwrap_err().to_string();
    assert!(error.contains("cornell"), "{error}");
}
