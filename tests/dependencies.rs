//! What the rooms may not see of each other (ARCHITECTURE.md), judged by cargo's own tree of dependencies. The oracle is a
//! judge only as long as it shares nothing with what it judges.

mod support;

use std::{collections::BTreeSet, process::Command};

/// A room, and the packages that must not be among its dependencies, direct or not, in tests or not.
const FORBIDDEN: &[(&str, &[&str])] = &[
    (
        "raytree-oracle",
        &["wgpu", "naga", "obvhs", "raytree-bvh", "raytree-gpu"],
    ),
    ("raytree-scene", &["wgpu", "naga", "obvhs"]),
    ("raytree-bvh", &["wgpu", "naga", "raytree-scene"]),
    ("raytree-film", &["wgpu", "naga", "raytree-scene"]),
    (
        "raytree-control",
        &["wgpu", "naga", "raytree-scene", "raytree-gpu"],
    ),
    ("raytree-assets", &["wgpu", "naga", "raytree-scene"]),
    (
        "raytree-converge",
        &["wgpu", "naga", "raytree-scene", "raytree-gpu"],
    ),
];

/// The names of everything that `package` depends on, and its own.
fn seen_by(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--offline",
            "--edges",
            "normal,build,dev",
            "--prefix",
            "none",
            "--format",
            "{p}",
        ])
        .args(["--package", package])
        .current_dir(support::root())
        .output()
        .expect("cargo runs this test, so it is there");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let lines = String::from_utf8(output.stdout).expect("names of packages are ASCII");
    lines
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

/// Those of `forbidden` that `package` sees.
fn trespasses(package: &str, forbidden: &[&str]) -> Vec<String> {
    let seen = seen_by(package);
    assert!(
        seen.contains(package),
        "cargo's tree of {package} does not name it"
    );
    forbidden
        .iter()
        .filter(|name| seen.contains(**name))
        .map(|name| format!("{package} sees {name}"))
        .collect()
}

#[test]
fn rooms_see_only_what_they_may() {
    let found: Vec<String> = FORBIDDEN
        .iter()
        .flat_map(|(package, forbidden)| trespasses(package, forbidden))
        .collect();
    assert!(found.is_empty(), "{}", found.join(", "));
}

/// The check has to be able to fail: directly, and through another package.
#[test]
fn a_trespass_is_noticed() {
    assert_eq!(
        trespasses("raytree-gpu", &["wgpu", "obvhs", "raytree-oracle"]),
        ["raytree-gpu sees wgpu", "raytree-gpu sees obvhs"]
    );
}

/// A crate that is not judged can see anything.
#[test]
fn every_room_is_judged_but_those_that_see_all() {
    let rooms =
        std::fs::read_dir(support::root().join("crates")).expect("crates/ is part of the project");
    let manifests = rooms
        .map(|room| room.expect("a readable entry").path().join("Cargo.toml"))
        .filter(|path| path.exists());
    let judged: BTreeSet<String> = FORBIDDEN
        .iter()
        .map(|(package, _)| (*package).to_owned())
        .collect();
    for manifest in manifests {
        let name = format!(
            "raytree-{}",
            support::stem(manifest.parent().expect("a folder"))
        );
        assert!(
            judged.contains(&name) || name == "raytree-gpu" || name == "raytree-stress",
            "{name} has no line in FORBIDDEN"
        );
    }
}
