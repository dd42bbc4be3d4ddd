//! The stress suite (`raytree stress`), one test a case: each row is judged by an answer on paper or by the f64 oracle, and has to
//! keep its limit. `cargo test --test stress -- watertight` runs one case.
#![allow(clippy::print_stdout, reason = "what a test says is read by people")]

mod support;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use raytree::Device;
use raytree_stress::{CASES, Case, Selection, run};

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

fn judge(device: &Device, case: &Case) -> Result<(), Failed> {
    let report = run(device, &Selection::only([case.name])?, &mut |_| {});
    println!("{}", report.to_text());
    let failed: Vec<&str> = report
        .rows
        .iter()
        .filter(|row| !row.holds())
        .map(|row| row.parameter.as_str())
        .collect();
    if failed.is_empty() && !report.rows.is_empty() {
        Ok(())
    } else {
        let (failed, rows) = (failed.join("; "), report.rows.len());
        Err(format!("of {rows} rows, these do not keep their limit: {failed}").into())
    }
}
