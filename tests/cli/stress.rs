//! `raytree stress`: which cases run, what is printed, how it ends. What a failed row does to the verdict is a unit test of
//! `crates/stress/report.rs`; no case that passes can be made to fail from outside.

use crate::harness::{Folder, keys};

/// A case that takes little time.
const CASE: &str = "geometry";

#[test]
fn list_names_every_case_and_needs_no_device() {
    let run = Folder::new()
        .run_without_driver("stress --list")
        .succeeded();
    let listed: Vec<&str> = run
        .stdout
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    let cases: Vec<&str> = raytree_stress::CASES.iter().map(|case| case.name).collect();
    assert_eq!(listed, cases);
    assert!(
        run.stdout.lines().all(|line| line.len() > 20),
        "{}",
        run.stdout
    );
}

#[test]
fn an_unknown_case_is_wrong_usage_and_says_which_there_are() {
    let folder = Folder::new();
    folder
        .run_without_driver("stress --only nonsense")
        .failed(2, &["no stress case \"nonsense\"", CASE]);
    folder
        .run_without_driver(&format!("stress --only {CASE},nonsense --json"))
        .failed(2, &["nonsense"]);
    folder
        .run("stress --json --markdown")
        .refused(&["--json", "--markdown"]);
}

#[test]
fn without_a_device_nothing_is_measured() {
    Folder::new()
        .run_without_driver(&format!("stress --only {CASE}"))
        .failed(3, &[]);
}

#[test]
fn a_case_is_a_table_of_rows() {
    need_device!();
    let folder = Folder::new();
    let run = folder.run(&format!("stress --only {CASE}")).succeeded();
    let lines: Vec<&str> = run.stdout.lines().collect();
    let (heading, summary) = (lines[0], lines[lines.len() - 1]);
    for word in ["case", "parameter", "measured", "limit", "rays", "verdict"] {
        assert!(heading.contains(word), "{heading}");
    }
    let rows = lines.iter().filter(|line| line.ends_with("pass")).count();
    assert!(rows > 0, "{}", run.stdout);
    assert!(
        summary.starts_with(&format!("{rows} of {rows} rows hold, ")),
        "{summary}"
    );
    assert_eq!(run.stderr.lines().count(), rows, "progress: {}", run.stderr);

    let run = folder
        .run(&format!("-q stress --only {CASE} --json"))
        .succeeded();
    let report = run.json();
    assert_eq!(run.stderr, "");
    assert_eq!(report["passed"], true);
    let objects = report["rows"].as_array().unwrap();
    assert_eq!(objects.len(), rows);
    for row in objects {
        assert_eq!((&row["case"], &row["holds"]), (&CASE.into(), &true.into()));
        for key in ["parameter", "measured", "limit", "rays", "seconds"] {
            assert!(keys(row).contains(&key), "{row}");
        }
    }

    let run = folder
        .run(&format!("-q stress --only {CASE} --markdown"))
        .succeeded();
    let table = run.stdout.lines().filter(|line| line.starts_with("| "));
    assert_eq!(table.count(), rows + 1, "{}", run.stdout);
}
