//! `inspect`, `devices`, help.

use serde_json::json;

use crate::harness::{Folder, keys};

#[test]
fn devices_are_listed_by_number() {
    need_device!();
    let folder = Folder::new();
    let devices = folder.json("devices --json")["devices"].clone();
    assert_eq!(keys(&devices[0]), ["index", "name", "driver", "type"]);
    let text = folder.run("devices").succeeded().stdout;
    assert_eq!(text.lines().count(), devices.as_array().unwrap().len());
    assert!(
        text.starts_with("0  ") && text.contains(devices[0]["name"].as_str().unwrap()),
        "{text}"
    );
}

#[test]
fn inspect_shows_what_is_in_a_scene() {
    let folder = Folder::new();
    let text = folder.run("inspect @everything.glb").succeeded().stdout;
    for word in [
        "triangles",
        "'water'",
        "ior 1.33",
        "absorbs",
        "'leaf'  64 x 64",
        "mask at 0.5",
        "orthographic",
        "spot",
        "left out",
        "alpha masks                       a material cuts holes by alpha",
        "unlit materials                   no material is unlit",
        "SPIR-V words",
        "bytes of geometry a triangle",
        "leaf_vertices",
    ] {
        assert!(text.contains(word), "no '{word}' in: {text}");
    }
    let report = folder.json("inspect @everything.glb --json");
    let all = [
        "file",
        "triangles",
        "placed_triangles",
        "repeated_meshes",
        "vertices",
        "uv_sets",
        "vertex_colors",
        "bounds",
        "frame",
        "nodes",
        "materials",
        "textures",
        "images",
        "lights",
        "cameras",
        "features",
        "cost",
        "warnings",
    ];
    assert_eq!(keys(&report), all);
    assert_eq!(report["cameras"][1]["name"], "Above");
    assert_eq!(report["lights"].as_array().unwrap().len(), 3);
    let cost = &report["cost"];
    // Whole rows of a table.
    let needed = 48 * report["triangles"].as_u64().unwrap();
    let taken = cost["buffers"]["leaf_vertices"].as_u64().unwrap();
    assert!(
        (needed..needed + (1 << 17)).contains(&taken),
        "{taken} for {needed}"
    );
    assert_eq!(cost["bindings"], cost["buffers"].as_object().unwrap().len());
    assert!(cost["spirv_words"].as_u64().unwrap() > 1000);

    let report = folder.json("inspect triangle.gltf --json");
    assert_eq!(report["triangles"], 1);
    assert_eq!(
        report["bounds"],
        json!({ "min": [-1.0, -1.0, 0.0], "max": [1.0, 1.0, 0.0] })
    );
    assert_eq!(report["nodes"], json!(["triangle"]));
    // It would be lit by the studio.
    assert!(
        report["features"]["used"]
            .as_array()
            .unwrap()
            .contains(&json!("environment map"))
    );
    assert_eq!(
        folder.run("-q inspect triangle.gltf").succeeded().stderr,
        ""
    );
}

#[test]
fn help_and_version_are_results() {
    let folder = Folder::new();
    for (arguments, word) in [
        ("--help", "Exit codes"),
        ("-h", "inspect"),
        ("help render", "--min-weight"),
        ("render --help", "--env-rotation"),
        ("compare --help", "--max-outliers"),
        ("--version", env!("CARGO_PKG_VERSION")),
    ] {
        let run = folder.run(arguments).succeeded();
        assert!(run.stdout.contains(word), "no '{word}' in: {}", run.stdout);
        assert_eq!(run.stderr, "");
    }
}
