//! Pictures, reports, and what is said meanwhile.

use std::fs;

use serde_json::{Value, json};

use crate::harness::{Folder, Run, keys};

#[test]
fn a_scene_alone_renders_to_its_name_in_the_current_folder() {
    need_device!();
    let folder = Folder::new();
    let run = folder.run("@cornell.glb").succeeded();
    let picture = folder.picture("cornell.png");
    assert_eq!((picture.width, picture.height), (960, 720));
    assert!(
        picture.rgb.iter().flatten().sum::<f32>() > 1e4,
        "the picture is black"
    );
    assert_eq!(run.stdout, "");
    assert!(
        run.stderr
            .starts_with("cornell.png: 960x720, 1 sample a pixel, "),
        "{}",
        run.stderr
    );
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
}

#[test]
fn pipes_hear_nothing_of_progress_and_quiet_is_quiet() {
    need_device!();
    let device = crate::support::device().expect("it is needed");
    let folder = Folder::new();
    let run = folder.run("@cornell.glb --size 64x48 --spp 16").succeeded();
    assert!(!run.stderr.contains(['\r', '\x1b']), "{:?}", run.stderr);
    let run = folder.run("-q @cornell.glb --size 64x48").succeeded();
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
    let run = folder
        .run("render -v @cornell.glb --size 64x48 --counters")
        .succeeded();
    run.mentions(&[
        "import",
        "compile",
        "iteration",
        "punctual lights",
        "left out",
        &device.info().name,
        "primary 3072",
    ]);
}

#[test]
fn every_output_is_written_in_its_format() {
    need_device!();
    let folder = Folder::new();
    folder
        .run("render @cornell.glb --size 32x24 -o a.png -o b.exr -o c.EXR --png-bits 16")
        .succeeded();
    assert_eq!(folder.read("a.png")[24], 16, "bit depth");
    assert_eq!(folder.read("b.exr"), folder.read("c.EXR"));
    let header = String::from_utf8_lossy(&folder.read("b.exr")[..2000]).into_owned();
    for layer in [
        "albedo.R",
        "Position.X",
        "Ng.X",
        "N.X",
        "MaterialId",
        "NodeId",
        "rays",
        "Z",
    ] {
        assert!(header.contains(layer), "no layer {layer}");
    }
    assert!(!folder.at("cornell.png").exists());
}

#[test]
fn exposure_and_tone_map_shape_the_png_and_never_the_exr() {
    need_device!();
    let folder = Folder::new();
    folder
        .run("@cornell.glb --size 32x24 -o a.png -o a.exr --tonemap none")
        .succeeded();
    folder
        .run("@cornell.glb --size 32x24 -o b.png -o b.exr --tonemap none --exposure -1")
        .succeeded();
    folder
        .run("@cornell.glb --size 32x24 -o c.png --tonemap aces")
        .succeeded();
    assert_eq!(folder.read("a.exr"), folder.read("b.exr"));
    assert_ne!(folder.read("a.png"), folder.read("c.png"));
    let (as_is, darker) = (folder.picture("a.png"), folder.picture("b.png"));
    for (a, b) in as_is.rgb.iter().flatten().zip(darker.rgb.iter().flatten()) {
        // Half, to a step of 8-bit sRGB.
        assert!(*a >= 1.0 || (0.5 * a - b).abs() < 0.01, "{a} became {b}");
    }
}

#[test]
fn json_has_the_documented_keys() {
    need_device!();
    let folder = Folder::new();
    let report = folder.json("@critical-prism.glb --size 64x48 --spp 2 --json --counters -o a.png");
    let all = [
        "scene",
        "device",
        "settings",
        "features",
        "time_ms",
        "compile_ms",
        "counters",
        "dropped",
        "error",
        "outputs",
        "warnings",
    ];
    assert_eq!(keys(&report), all);
    assert_eq!(
        keys(&report["scene"]),
        ["file", "triangles", "materials", "textures", "lights"]
    );
    assert_eq!(keys(&report["device"]), ["name", "driver"]);
    assert_eq!(keys(&report["features"]), ["used", "left_out"]);
    assert_eq!(
        keys(&report["time_ms"]),
        [
            "import", "assemble", "bvh", "device", "layout", "program", "compile", "render",
            "write", "other", "total"
        ]
    );
    assert_eq!(
        keys(&report["compile_ms"]),
        ["camera_rays", "trace_rays", "shade_hits"]
    );
    let counters = &report["counters"];
    assert_eq!(
        keys(counters),
        ["rays", "node_visits", "triangle_tests", "ended"]
    );
    assert_eq!(
        keys(&counters["rays"]),
        ["primary", "shadow", "reflection", "refraction"]
    );
    assert_eq!(
        keys(&counters["ended"]),
        ["miss", "depth", "weight", "tolerance", "storage", "budget"]
    );

    assert!(report["scene"]["triangles"].as_u64() > Some(10));
    assert_eq!(counters["rays"]["primary"], 64 * 48 * 2);
    assert!(counters["rays"]["refraction"].as_u64() > Some(100));
    assert_eq!(counters["ended"]["storage"], 0);
    assert_eq!(report["dropped"], json!({ "storage": 0, "budget": 0 }));
    assert!(
        report["features"]["used"]
            .as_array()
            .unwrap()
            .contains(&json!("refraction in solids"))
    );
    assert!(
        report["features"]["left_out"]
            .as_array()
            .unwrap()
            .contains(&json!("alpha masks"))
    );
    assert_eq!(report["settings"]["depth"], 8);
    assert_eq!(report["settings"]["region"], json!([0, 0, 64, 48]));
    assert_eq!(report["outputs"], json!(["a.png"]));
    let times = report["time_ms"].as_object().unwrap();
    let parts: f64 = times
        .iter()
        .filter(|(name, _)| *name != "total")
        .map(|(_, time)| time.as_f64().unwrap())
        .sum();
    // Each is rounded to a microsecond.
    let total = times["total"].as_f64().unwrap();
    assert!(parts > 0.0 && (parts - total).abs() < 0.02, "{times:?}");
}

#[test]
fn json_without_counters_has_null_there() {
    need_device!();
    let folder = Folder::new();
    let run = folder
        .run("-q triangle.gltf --size 64x48 --json")
        .succeeded();
    assert_eq!(run.json()["counters"], Value::Null);
    assert_eq!(
        run.json()["settings"]["layers"],
        false,
        "a PNG carries none"
    );
    assert_eq!(run.stderr, "");
}

#[test]
fn warnings_of_the_import_are_passed_on() {
    need_device!();
    let folder = Folder::new();
    folder.write_triangle(
        "odd.gltf",
        &json!({ "extensionsUsed": ["VENDOR_unheard_of"] }),
    );
    let run = folder.run("odd.gltf --size 32x24 --json").succeeded();
    let warnings = run.json()["warnings"].clone();
    assert!(
        warnings[0].as_str().unwrap().contains("VENDOR_unheard_of"),
        "{warnings}"
    );
    run.mentions(&["warning: ", "VENDOR_unheard_of"]);
    assert_eq!(
        folder.run("odd.gltf --size 32x24 -q").succeeded().stderr,
        ""
    );
}

#[test]
fn names_that_are_odd_are_still_names() {
    need_device!();
    let folder = Folder::new();
    fs::create_dir(folder.at("sub.folder")).unwrap();
    for name in ["sub.folder/a.b.gltf", "sub.folder/plain"] {
        folder.write_triangle(name, &json!({}));
        fs::copy(
            folder.at("triangle.bin"),
            folder.at("sub.folder/triangle.bin"),
        )
        .unwrap();
        folder.run(&format!("{name} --size 32x24")).succeeded();
    }
    assert!(folder.at("a.b.png").exists() && folder.at("plain.png").exists());
}

#[test]
fn the_log_is_there_for_those_who_ask() {
    need_device!();
    let folder = Folder::new();
    folder
        .run("-vv triangle.gltf --size 32x24")
        .succeeded()
        .mentions(&["DEBUG", "device opened"]);
    let with_log = |filter: &str| {
        Run::of(
            folder
                .command("-q triangle.gltf --size 32x24")
                .env("RAYTREE_LOG", filter)
                .output()
                .unwrap(),
        )
    };
    with_log("raytree=debug")
        .succeeded()
        .mentions(&["device opened"]);
    assert_eq!(with_log("off").succeeded().stderr, "");
    with_log("raytree=loud").failed(2, &["RAYTREE_LOG"]);
}

#[test]
fn a_picture_that_lacks_branches_says_so() {
    need_device!();
    let folder = Folder::new();
    let arguments =
        "@glass-in-water.glb --size 32x24 --min-weight 0 --depth 64 --max-rays 40 --json";
    let run = folder.run(arguments).succeeded();
    let report = run.json();
    assert_eq!(report["settings"]["max_rays"], 40);
    assert!(report["dropped"]["budget"].as_u64() > Some(100), "{report}");
    assert_eq!(report["dropped"]["storage"], 0);
    run.mentions(&["warning: ", "branches were dropped", "--max-rays"]);
    assert_eq!(
        folder.run(&format!("-q {arguments}")).succeeded().stderr,
        ""
    );
    let run = folder
        .run("@facing-mirrors.glb --size 32x24 --depth 1000 --min-weight 0")
        .succeeded();
    assert!(!run.stderr.contains("warning"), "{}", run.stderr);
    folder
        .run("@cornell.glb --max-rays 0")
        .refused(&["--max-rays"]);
}
