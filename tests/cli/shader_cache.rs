//! Compiled programs are kept in a folder of our own.
#![allow(clippy::print_stdout, reason = "a test says what it skips")]

use std::fs;

use crate::harness::{Folder, Run};

/// Where Mesa's cache lies, seen from the folder, after a picture was rendered with these variables.
fn caches(variables: &[(&str, &str)]) -> Vec<String> {
    let folder = Folder::new();
    let mut command = folder.command("render triangle.gltf --size 8x8 -o a.png");
    command.env_remove("MESA_SHADER_CACHE_DIR");
    command.env_remove("MESA_SHADER_CACHE_DISABLE");
    for (name, below) in variables {
        command.env(name, folder.at(below));
    }
    Run::of(command.output().unwrap()).succeeded();
    let holds_files = |name: &&str| {
        let entries = fs::read_dir(folder.at(name)).into_iter().flatten();
        entries.count() > 0
    };
    ["cache/raytree/shaders", "cache/mesa_shader_cache", "chosen"]
        .into_iter()
        .filter(holds_files)
        .map(str::to_owned)
        .collect()
}

#[test]
fn programs_are_kept_in_a_folder_of_our_own() {
    need_device!();
    let device = crate::support::device().expect("it is needed");
    if !device.info().name.contains("llvmpipe") {
        println!("skipped: {} has no such cache", device.info().name);
        return;
    }
    let own = caches(&[("XDG_CACHE_HOME", "cache")]);
    assert_eq!(own, ["cache/raytree/shaders"]);
    let chosen = caches(&[
        ("XDG_CACHE_HOME", "cache"),
        ("MESA_SHADER_CACHE_DIR", "chosen"),
    ]);
    assert_eq!(chosen, ["chosen"]);
}
