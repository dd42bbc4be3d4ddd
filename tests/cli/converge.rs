//! `converge`: what it writes, what it goes on from, what it refuses.

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::harness::{Folder, Run, keys};

/// A few settings of a small picture, references of few samples.
const SMALL: &str = "converge triangle.gltf --size 40x30 --repeat 2 --reference-spp 16 -o out";

/// Runs with references kept in the folder, not in the user's cache.
fn run(folder: &Folder, arguments: &str) -> Run {
    let mut command = folder.command(arguments);
    // The driver's compiled programs may well be the user's.
    if let Some(home) = std::env::var_os("HOME") {
        command.env(
            "MESA_SHADER_CACHE_DIR",
            std::path::Path::new(&home).join(".cache/raytree/shaders"),
        );
    }
    command.env("XDG_CACHE_HOME", folder.at("cache"));
    Run::of(command.output().unwrap())
}

fn lines(folder: &Folder, name: &str) -> Vec<String> {
    let text = String::from_utf8(folder.read(name)).unwrap();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn a_sweep_is_written_in_every_form_and_gone_on_from() {
    need_device!();
    let folder = Folder::new();
    let sweep = format!("{SMALL} --errors --sweep spp=1,2,4,8 --sweep depth=1,2");
    let first = run(&folder, &sweep).succeeded();
    assert!(first.stdout.contains("(depth 2)"), "{}", first.stdout);
    assert!(first.stdout.contains("(95 %: "), "{}", first.stdout);
    assert!(
        first.stdout.contains("the two differ by RMSE"),
        "{}",
        first.stdout
    );

    let object: Value = serde_json::from_slice(&folder.read("out/converge.json")).unwrap();
    assert_eq!(
        keys(&object),
        [
            "subject", "clock", "sessions", "points", "ladders", "truths"
        ]
    );
    let points = object["points"].as_array().unwrap();
    assert_eq!(points.len(), 8);
    let rows = lines(&folder, "out/converge.csv");
    assert_eq!(rows.len(), 9);
    for (point, row) in points.iter().zip(&rows[1..]) {
        assert_eq!(point["wall_s"]["runs"], 2);
        assert_eq!(
            point["rays"]["primary"].as_u64().unwrap(),
            40 * 30 * point["setting"]["spp"].as_u64().unwrap()
        );
        assert!(
            row.starts_with(&format!("{},none,", point["setting"]["spp"])),
            "{row}"
        );
    }
    let order = &object["ladders"][0]["order"];
    assert!(order["low"].as_f64() <= order["order"].as_f64(), "{order}");
    assert_eq!(
        object["truths"][0]["reference"]["samples"],
        serde_json::json!([16, 25])
    );

    let svg = String::from_utf8(folder.read("out/converge.svg")).unwrap();
    assert!(svg.contains("triangle: error against run time"));
    assert_eq!(folder.picture("out/converge.png").width, 1800);
    assert_eq!(fs::read_dir(folder.at("out/errors")).unwrap().count(), 8);

    // Nothing is measured a second time.
    let measured = folder.read("out/measurements.jsonl");
    let csv = folder.read("out/converge.csv");
    run(&folder, &sweep).succeeded().mentions(&[
        "16 of 16 runs are there already",
        "as kept from an earlier run",
    ]);
    assert!(folder.read("out/measurements.jsonl") == measured);
    assert_eq!(folder.read("out/converge.csv"), csv);

    // A cache that was damaged is made again, with a warning.
    for entry in fs::read_dir(folder.at("cache/raytree/references")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "exr") {
            fs::write(path, "no picture").unwrap();
        }
    }
    run(&folder, &sweep)
        .succeeded()
        .mentions(&["warning: the kept reference is made again"]);
    assert_eq!(folder.read("out/converge.csv"), csv);

    // Another view is another subject.
    let other = sweep.replace("40x30", "20x15");
    run(&folder, &other).failed(2, &["measurements.jsonl", "--fresh"]);
    run(&folder, &format!("{other} --fresh")).succeeded();
}

#[test]
fn a_reference_can_be_given() {
    need_device!();
    let folder = Folder::new();
    folder.write_plain("small.exr", (20, 15), [0.1; 3]);
    folder.write_plain("other.exr", (20, 15), [0.1, 0.1, 0.2]);
    let given = "converge triangle.gltf --repeat 2 -o out --sweep spp=1,2";
    run(
        &folder,
        &format!("{given} --size 40x30 --reference small.exr"),
    )
    .failed(2, &["small.exr", "20x15", "40x30", "--size 20x15"]);
    let one = run(&folder, &format!("{given} --reference small.exr")).succeeded();
    assert!(
        one.stdout.contains("its own error is not known"),
        "{}",
        one.stdout
    );
    // Two that differ much tell little: every error is within three times their own.
    let two = run(
        &folder,
        &format!("{given} --fresh --reference small.exr --reference other.exr --json"),
    )
    .succeeded();
    let object = two.json();
    let agreement = object["truths"][0]["reference"]["agreement"]["rmse"]
        .as_f64()
        .unwrap();
    assert!(
        (agreement - (0.01_f64 / 3.0).sqrt()).abs() < 1e-6,
        "{agreement}"
    );
    run(&folder, &format!("{given} --reference missing.exr")).failed(4, &["missing.exr"]);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new();
    let with = |more: &str| run(&folder, &format!("converge triangle.gltf {more}"));
    with("--sweep colour=red").refused(&["colour", "min-weight"]);
    with("--sweep spp=0").refused(&["spp", "1 to 8192"]);
    with("--sweep spp").refused(&["spp=1,4,16"]);
    with("--repeat 1").refused(&["2 to 1000"]);
    with("--sweep spp=1 --sweep spp=2").failed(2, &["spp", "twice"]);
    with("--sweep shading=pbr,whitted --reference a.exr").failed(2, &["--reference", "shading"]);
    folder.write_plain("a.exr", (4, 4), [0.5; 3]);
    with("--reference a.exr --reference a.exr --reference a.exr").failed(2, &["twice"]);
    assert_eq!(run(&folder, "converge missing.glb").code, Some(4));
    fs::write(folder.at("file"), "").unwrap();
    with("-o file").failed(1, &["file", "--output"]);
}

#[test]
fn an_interrupted_sweep_keeps_what_it_has() {
    need_device!();
    let folder = Folder::new();
    let sweep = format!("{SMALL} --oracle never --sweep spp=1,2,4 --repeat 1000");
    let mut command = folder.command(&sweep.replace("--repeat 2 ", ""));
    let child = command
        .env("XDG_CACHE_HOME", folder.at("cache"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let has_runs = |at_least: usize| {
        let text = fs::read_to_string(folder.at("out/measurements.jsonl")).unwrap_or_default();
        text.matches("\"record\":\"run\"").count() >= at_least
    };
    let started = Instant::now();
    while !has_runs(5) {
        assert!(
            started.elapsed() < Duration::from_secs(120),
            "no run came in"
        );
        thread::sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    let ended = Run::of(child.wait_with_output().unwrap());
    assert_eq!(ended.code, Some(130), "{}", ended.stderr);
    ended.mentions(&["runs are kept", "interrupted"]);
    assert!(has_runs(5));
    run(
        &folder,
        &format!("{SMALL} --oracle never --sweep spp=1,2,4"),
    )
    .succeeded()
    .mentions(&["runs are there already"]);
}
