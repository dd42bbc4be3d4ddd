//! The stress suite (`raytree stress`), one test a case: each row is judged by an answer on paper or by the f64 oracle, and has to
//! keep its limit. `cargo test --test stress -- watertight` runs one case.
#![allow(clippy::print_stdout, reason = "what a test says is read by people")]

mod support;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use raytree::Device;
use raytree_stress::{CASES, Case, Row, Selection, run};

fn main() -> ExitCode {
    let mut arguments = Arguments::from_args();
    // A case has the device to itself: two at once would only wait for each other.
    arguments.test_threads.get_or_insert(1);
    let device = support::device();
    let trials = CASES
        .iter()
        .map(|case| {
            let trial = Trial::test(case.name, move || match device {
                Some(device) => judge(device, case),
                None => Ok(()),
            });
            trial.with_ignored_flag(device.is_none())
        })
        .collect();
    libtest_mimic::run(&arguments, trials).exit_code()
}

/// Rows that do not keep their limit yet, with the best figure so far: they may not get worse, and have to leave this list once they
/// hold. `raytree stress` says FAIL of them. STRESS.md says why.
const KNOWN: &[(&str, &str, f64)] = &[];

fn judge(device: &Device, case: &Case) -> Result<(), Failed> {
    let report = run(device, &Selection::only([case.name])?, &mut |_| {});
    println!("{}", report.to_text());
    let faults: Vec<String> = report.rows.iter().filter_map(fault).collect();
    if faults.is_empty() && !report.rows.is_empty() {
        Ok(())
    } else {
        Err(format!("of {} rows: {}", report.rows.len(), faults.join("; ")).into())
    }
}

/// What is wrong with a row, if anything is.
fn fault(row: &Row) -> Option<String> {
    let known = KNOWN
        .iter()
        .find(|known| known.0 == row.case && known.1 == row.parameter);
    match known {
        None if row.holds() => None,
        None => Some(format!("{} does not keep its limit", row.parameter)),
        Some(_) if row.holds() => Some(format!("{} holds: take it off KNOWN", row.parameter)),
        Some(&(_, _, best)) if row.measured <= best => None,
        Some(_) => Some(format!("{} got worse", row.parameter)),
    }
}
