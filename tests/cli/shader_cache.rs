//! Compiled programs are kept in a folder of our own.
#![allow(clippy::print_stdout, reason = "a test says what it skips")]

use std::fs;

use crate::harness::{Folder, Run};

/// Does the device compile as lavapipe does, and keep it?
fn keeps_programs() -> bool {
    let device = crate::support::device().expect("it is needed");
    let keeps = device.info().name.contains("llvmpipe");
    if !keeps {
        println!("skipped: {} has no such cache", device.info().name);
    }
    keeps
}

/// The bytes of a picture that was rendered with these variables, each a path below the folder.
fn rendered(folder: &Folder, picture: &str, variables: &[(&str, &str)]) -> Vec<u8> {
    let mut command = folder.command(&format!("render triangle.gltf --size 8x8 -o {picture}"));
    command.env_remove("MESA_SHADER_CACHE_DIR");
    command.env_remove("MESA_SHADER_CACHE_DISABLE");
    for (name, below) in variables {
        command.env(name, folder.at(below));
    }
    Run::of(command.output().unwrap()).succeeded();
    fs::read(folder.at(picture)).unwrap()
}

/// Where Mesa's cache lies, seen from the folder, after a picture was rendered with these variables.
fn caches(variables: &[(&str, &str)]) -> Vec<String> {
    let folder = Folder::new();
    rendered(&folder, "a.png", variables);
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

/// A mark in the cache says that the largest kernel lies there. It may be wrong: Mesa throws away what is old.
#[test]
fn what_is_compiled_is_marked_and_a_mark_may_be_wrong() {
    need_device!();
    if !keeps_programs() {
        return;
    }
    let folder = Folder::new();
    let render = |picture| rendered(&folder, picture, &[("XDG_CACHE_HOME", "cache")]);
    let kept = || {
        let entries = fs::read_dir(folder.at("cache/raytree/shaders")).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let is_mark = |path: &std::path::PathBuf| {
            let name = path.file_name().unwrap_or_default();
            name.to_string_lossy().starts_with("raytree-compiled-")
        };
        paths.partition::<Vec<_>, _>(is_mark)
    };
    let first = render("a.png");
    let (marks, programs) = kept();
    assert_eq!(marks.len(), 1);
    assert!(!programs.is_empty());
    for program in programs {
        fs::remove_dir_all(&program)
            .or_else(|_| fs::remove_file(&program))
            .unwrap();
    }
    assert_eq!(render("b.png"), first);
    assert_eq!(kept().0, marks);
    assert!(!kept().1.is_empty(), "compiled again, and kept");
}

#[test]
fn programs_are_kept_in_a_folder_of_our_own() {
    need_device!();
    if !keeps_programs() {
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
