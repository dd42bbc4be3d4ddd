//! No bench: gathers what the benches before it have left under `target/` into `target/bench-summary.json`, for services that plot
//! history. Cargo runs benches by name, so this is the last.
#![allow(clippy::print_stdout, reason = "a bench is a program for people")]

mod support;

use support::summary;

fn main() {
    let target = support::target();
    let records = summary::collect(target).unwrap_or_else(|error| panic!("{error}"));
    let path = target.join("bench-summary.json");
    let text = serde_json::to_string_pretty(&records).unwrap_or_else(|error| panic!("{error}"));
    std::fs::write(&path, text + "\n")
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    println!("{} figures in {}", records.len(), path.display());
}
