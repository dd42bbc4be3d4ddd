//! `raytree stress`: the suite of stiff and extreme cases, as a table.

use anyhow::bail;
use raytree::Device;
use raytree_stress::{BOOK_TOLERANCE, CASES, Report, Row, Selection, UnknownCase};

use crate::args::StressArgs;
use crate::console::{Console, print, print_json};
use crate::failure::Usage;

pub fn run(args: &StressArgs, console: Console) -> anyhow::Result<()> {
    if args.list {
        return Ok(print(&list())?);
    }
    let selection = selection(args).map_err(|error| Usage(error.to_string()))?;
    let device = Device::open(&args.device.as_str().into())?;
    let observer = &mut |row: &Row| console.say(progress(row));
    let report = match args.beside_book {
        Some(tolerance) => {
            let tolerance = tolerance.map_or(BOOK_TOLERANCE, |given| given as f32);
            raytree_stress::run_beside_book(&device, &selection, tolerance, observer)
        }
        None => raytree_stress::run(&device, &selection, observer),
    };
    show(args, &report)?;
    if !report.passed() {
        bail!("the stress suite found what must not be: see the rows that say FAIL");
    }
    Ok(())
}

fn selection(args: &StressArgs) -> Result<Selection, UnknownCase> {
    if args.only.is_empty() {
        Ok(Selection::all())
    } else {
        Selection::only(args.only.iter().map(String::as_str))
    }
}

fn list() -> String {
    CASES
        .iter()
        .map(|case| format!("{:<12} {}\n", case.name, case.about))
        .collect()
}

/// For people who wait: the suite takes minutes.
fn progress(row: &Row) -> String {
    let Row {
        case,
        parameter,
        seconds,
        ..
    } = row;
    format!("{} {case}: {parameter} ({seconds:.1} s)", row.verdict())
}

fn show(args: &StressArgs, report: &Report) -> std::io::Result<()> {
    if args.json {
        print_json(&report.to_json())
    } else if args.markdown {
        print(&report.to_markdown())
    } else {
        print(&report.to_text())
    }
}
