//! What goes wrong, and what the exit code says of it.

use std::fs;

use serde_json::json;

use crate::harness::Folder;
use crate::support;

#[test]
fn usage_errors_end_with_2_and_say_what_is_allowed() {
    let folder = Folder::new();
    let refused = |arguments: &str, words: &[&str]| {
        folder.run(arguments).refused(words);
    };
    assert_eq!(folder.run("").code, Some(2));
    refused("nonsense", &["unrecognized subcommand"]);
    refused("triangle.gltf --nonsense", &["--nonsense"]);
    refused("triangle.gltf --size 64", &["--size", "640x480"]);
    refused("triangle.gltf --size 0x48", &["1 to 65536"]);
    refused("triangle.gltf --size 70000x48", &["1 to 65536"]);
    refused("triangle.gltf --depth -1", &["0 to 65536"]);
    refused("triangle.gltf --spp 0", &["1 to 131073"]);
    refused("triangle.gltf --min-weight 1.5", &["0 to 1"]);
    refused("triangle.gltf --exposure NaN", &["-64 to 64"]);
    refused("triangle.gltf --fov 180", &["0.001 to 179.9"]);
    refused("triangle.gltf --eye 1,2", &["three numbers"]);
    refused("triangle.gltf --eye 1,2,inf", &["'inf'"]);
    refused("triangle.gltf --ambient -1", &["0 to 1000000"]);
    refused("triangle.gltf --background #ff80", &["#ff8000"]);
    refused("triangle.gltf --background blue", &["transparent"]);
    refused("triangle.gltf --region 1,2,3", &["100,50,64,48"]);
    refused("triangle.gltf --tonemap filmic", &["neutral"]);
    refused("triangle.gltf --png-bits 12", &["8, 16"]);
    refused(
        "triangle.gltf --eye 1,2,3 --camera auto",
        &["cannot be used with"],
    );
    refused("triangle.gltf --env-strength 2", &["--env"]);
    refused("compare a.png", &["ACTUAL"]);
    refused("compare a.png b.png --max-outliers 0.02", &["0.02:0.001"]);
    refused(
        "compare a.png b.png --no-flip --max-flip 0.1",
        &["cannot be used with"],
    );

    let failed = |arguments: &str, words: &[&str]| {
        folder.run(arguments).failed(2, words);
    };
    failed("triangle.gltf -o a.jpg", &["a.jpg", ".png", ".exr"]);
    failed("triangle.gltf -o -", &[".png", ".exr"]);
    failed("triangle.gltf -o a.png -o a.png", &["a.png", "twice"]);
    failed(
        "triangle.gltf --spp 8193",
        &["--spp", "at most 8192", "--tolerance"],
    );
    failed("triangle.gltf --camera Main", &["'Main'", "--camera auto"]);
    failed("@cornell.glb --camera 7", &["'7'", "0 'Camera'"]);
    failed(
        "triangle.gltf --size 64x48 --region 60,0,5,5",
        &["60,0,5,5", "64x48"],
    );
    failed("triangle.gltf --eye 1,1,1 --target 1,1,1", &["same point"]);
    failed(
        "triangle.gltf --eye 0,5,0 --target 0,0,0 --up 0,1,0",
        &["parallel"],
    );
    folder.write_plain("sky.exr", (16, 8), [1.0; 3]);
    failed(
        "triangle.gltf --env sky.exr -o sky.exr",
        &["sky.exr", "overwritten"],
    );
    assert!(!folder.at("triangle.png").exists());
}

#[test]
fn unreadable_inputs_end_with_4() {
    let folder = Folder::new();
    fs::write(folder.at("empty.glb"), "").unwrap();
    fs::write(folder.at("text.gltf"), "{ no json }").unwrap();
    fs::write(
        folder.at("short.glb"),
        &fs::read(support::root().join("assets/cornell.glb")).unwrap()[..1000],
    )
    .unwrap();
    folder.write_triangle(
        "future.gltf",
        &json!({ "extensionsUsed": ["KHR_future"], "extensionsRequired": ["KHR_future"] }),
    );
    let cases = [
        ("missing.glb", "missing.glb"),
        ("empty.glb", "empty.glb"),
        ("text.gltf", "text.gltf"),
        ("short.glb", "short.glb"),
        ("future.gltf", "KHR_future"),
        ("triangle.gltf --env missing.hdr", "missing.hdr"),
        ("triangle.gltf --env text.gltf", "text.gltf"),
        ("inspect missing.glb", "missing.glb"),
        ("inspect short.glb --json", "short.glb"),
        ("compare missing.png triangle.bin", "missing.png"),
        ("compare triangle.bin triangle.bin", "triangle.bin"),
    ];
    let before = folder.entries();
    for (arguments, word) in cases {
        folder.run(arguments).failed(4, &[word]);
    }
    assert_eq!(
        folder.entries(),
        before,
        "no output where there is no scene"
    );
}

#[test]
fn outputs_that_cannot_be_written_end_with_1_before_anything_is_rendered() {
    let folder = Folder::new();
    fs::create_dir(folder.at("folder.png")).unwrap();
    fs::write(folder.at("locked.png"), "").unwrap();
    let mut permissions = fs::metadata(folder.at("locked.png")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(folder.at("locked.png"), permissions).unwrap();
    for (arguments, words) in [
        ("missing.glb -o none/a.png", ["none/a.png", "folder"]),
        ("missing.glb -o folder.png", ["folder.png", "directory"]),
        ("missing.glb -o locked.png", ["locked.png", "read-only"]),
        (
            "missing.glb -o triangle.bin/a.exr",
            ["triangle.bin/a.exr", "folder"],
        ),
        (
            "compare missing.png missing.png --diff none/a.png",
            ["none/a.png", "folder"],
        ),
    ] {
        folder.run(arguments).failed(1, &words);
    }
}

#[test]
fn without_a_driver_rendering_ends_with_3_and_says_how_to_get_one() {
    let folder = Folder::new();
    folder
        .run_without_driver("triangle.gltf")
        .failed(3, &["Vulkan", "setup.sh", "apt-get install"]);
    folder
        .run_without_driver("devices")
        .failed(3, &["Vulkan", "setup.sh"]);
    folder
        .run_without_driver("devices --json")
        .failed(3, &["setup.sh"]);
    folder
        .run_without_driver("missing.glb")
        .failed(4, &["missing.glb"]);
    assert!(!folder.at("triangle.png").exists());
    folder
        .run_without_driver("inspect triangle.gltf")
        .succeeded();
}

#[test]
fn an_unknown_device_ends_with_3_and_names_those_there_are() {
    need_device!();
    let folder = Folder::new();
    let devices = folder.json("devices --json")["devices"].clone();
    let name = devices[0]["name"].as_str().unwrap();
    folder
        .run("triangle.gltf --device Voodoo")
        .failed(3, &["'Voodoo'", name]);
    folder
        .run("triangle.gltf --device 99")
        .failed(3, &["99", name]);
    folder
        .run("triangle.gltf --size 32x24 --device 0")
        .succeeded();
}
