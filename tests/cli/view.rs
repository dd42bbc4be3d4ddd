//! Cameras, light and backgrounds from the command line.

use serde_json::{Value, json};

use crate::harness::Folder;

#[test]
fn cameras_by_name_number_and_from_the_command_line() {
    need_device!();
    let folder = Folder::new();
    let render = |name: &str, camera: &str| {
        folder.json(&format!(
            "@cornell.glb --size 64x48 --json -o {name} {camera}"
        ))["settings"]["camera"]
            .clone()
    };
    let camera = render("default.exr", "");
    render(
        "name.exr",
        &format!("--camera {}", camera["name"].as_str().unwrap()),
    );
    render("number.exr", "--camera 0");
    assert_eq!(folder.read("name.exr"), folder.read("default.exr"));
    assert_eq!(folder.read("number.exr"), folder.read("default.exr"));

    let vector = |key: &str| -> [f64; 3] { serde_json::from_value(camera[key].clone()).unwrap() };
    let (position, forward, up) = (vector("position"), vector("forward"), vector("up"));
    let target = [0, 1, 2].map(|i| position[i] + 2.0 * forward[i]);
    let spell = |v: [f64; 3]| v.map(|x| x.to_string()).join(",");
    let (eye, target, up) = (spell(position), spell(target), spell(up));
    let fov = &camera["projection"]["yfov_degrees"];
    render(
        "own.exr",
        &format!("--eye {eye} --target {target} --up {up} --fov {fov}"),
    );
    let report = folder.json("compare default.exr own.exr --json --no-flip");
    assert!(
        report["mean_abs"].as_f64().unwrap() < 1e-4,
        "the same camera, spelled out: {report}"
    );

    render("auto.exr", "--camera auto");
    render("wide.exr", "--fov 80");
    for other in ["auto.exr", "wide.exr"] {
        let report = folder.json(&format!("compare default.exr {other} --json --no-flip"));
        assert!(
            report["mean_abs"].as_f64().unwrap() > 1e-2,
            "{other} is another view: {report}"
        );
    }
}

#[test]
fn a_camera_from_the_command_line_speaks_of_world_space() {
    need_device!();
    let folder = Folder::new();
    let far =
        json!({ "nodes": [{ "mesh": 0, "translation": [1000, -200, 50], "scale": [8, 8, 8] }] });
    folder.write_triangle("far.gltf", &far);
    folder
        .run("triangle.gltf --size 64x48 --eye 0,0,3 --target 0,0,0 -o near.exr")
        .succeeded();
    folder
        .run("far.gltf --size 64x48 --eye 1000,-200,74 --target 1000,-200,50 -o far.exr")
        .succeeded();
    let near = folder.picture("near.exr");
    assert_ne!(
        near.rgb[24 * 64 + 32],
        near.rgb[0],
        "the triangle is in the middle"
    );
    let report = folder.json("compare near.exr far.exr --json --no-flip");
    assert!(report["max_abs"].as_f64().unwrap() < 1e-4, "{report}");
}

#[test]
fn scenes_without_light_get_a_studio_unless_told_otherwise() {
    need_device!();
    let folder = Folder::new();
    let render = |more: &str| {
        let report = folder.json(&format!(
            "triangle.gltf --size 64x48 --json -o a.exr {more}"
        ));
        let middle = folder.picture("a.exr").rgb[24 * 64 + 32];
        (report["settings"]["environment"].clone(), middle)
    };
    let (environment, middle) = render("");
    assert_eq!(environment, "studio");
    assert!(middle[0] > 0.1, "{middle:?}");
    assert_eq!(render("--no-studio"), (Value::Null, [0.0; 3]));

    let (environment, middle) = render("--ambient 1,0.5,0 --background 0,0,0");
    assert_eq!(environment, Value::Null);
    assert!(
        middle[0] > 0.4 && (middle[1] / middle[0] - 0.5).abs() < 1e-3 && middle[2] == 0.0,
        "{middle:?}"
    );
    assert_eq!(render("--studio --ambient 1").0, "studio");
    assert_eq!(
        folder.json("@cornell.glb --size 32x24 --json")["settings"]["environment"],
        Value::Null
    );
}

#[test]
fn environments_light_the_scene_by_strength() {
    need_device!();
    let folder = Folder::new();
    folder.write_plain("sky.exr", (16, 8), [0.25, 0.5, 1.0]);
    let render = |more: &str| {
        folder
            .run(&format!(
                "triangle.gltf --size 64x48 -o a.exr --env sky.exr {more}"
            ))
            .succeeded();
        let picture = folder.picture("a.exr");
        (picture.rgb[0], picture.rgb[24 * 64 + 32])
    };
    let (sky, middle) = render("");
    assert_eq!(sky, [0.25, 0.5, 1.0]);
    assert!(
        middle[2] > 0.3 && (middle[0] / middle[2] - 0.25).abs() < 0.01,
        "{middle:?}"
    );
    let (sky, brighter) = render("--env-strength 2 --env-rotation -90");
    assert_eq!(sky, [0.5, 1.0, 2.0]);
    assert!((brighter[2] / middle[2] - 2.0).abs() < 0.01, "{brighter:?}");
    let (background, lit) = render("--background 0,0,0");
    assert_eq!((background, lit), ([0.0; 3], middle));
}

#[test]
fn backgrounds_are_colours_or_nothing() {
    need_device!();
    let folder = Folder::new();
    let render = |background: &str| {
        let outputs = "-o a.png -o a.exr --tonemap none";
        let arguments = format!("triangle.gltf --size 64x48 {outputs} --background {background}");
        folder.run(&arguments).succeeded();
        (folder.picture("a.png"), folder.picture("a.exr").rgb[0])
    };
    let (png, color) = render("#ff8000");
    assert!(
        color[0] == 1.0 && (color[1] - 0.215_86).abs() < 1e-4 && color[2] == 0.0,
        "{color:?}"
    );
    assert!(png.alpha.is_none(), "a background hides what is behind it");
    assert_eq!(render("0.5,2,0").1, [0.5, 2.0, 0.0]);
    let (png, color) = render("transparent");
    let alpha = png.alpha.expect("an alpha channel");
    assert_eq!((color, alpha[0], alpha[24 * 64 + 32]), ([0.0; 3], 0.0, 1.0));
}
