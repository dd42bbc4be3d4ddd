//! Every scene of `../shared` through the program, as a user would: the valid ones render or are refused by the name of an
//! extension that they require; the invalid ones, whole or cut short, end with exit code 4, a message, and no picture.

mod support;

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

/// The only file of the corpus that requires what we do not support.
const REFUSED: [(&str, &str); 1] = [("glTF-Draco", "KHR_draco_mesh_compression")];

fn raytree(scene: &Path, output: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_raytree"))
        .args(["render", "-q", "--size", "24x18", "--depth", "4", "-o"])
        .args([output, scene])
        .output()
        .unwrap()
}

/// What is wrong with a run that should have been refused: exit code 4, one line on stderr, no panic, no picture.
fn refusal_fault(run: &Output, output: &Path) -> Option<String> {
    let message = String::from_utf8_lossy(&run.stderr);
    if run.status.code() != Some(4) {
        return Some(format!("exit {:?}: {message}", run.status.code()));
    }
    if message.contains("panicked") || message.trim().lines().count() != 1 {
        return Some(format!("not one line: {message}"));
    }
    output.exists().then(|| "left a picture".to_owned())
}

#[test]
fn valid_files_render_or_name_what_they_require() {
    let Some(folder) = support::shared("gltf") else {
        return;
    };
    if support::device().is_none() {
        return;
    }
    let output = support::artefact("corpus.png");
    let mut scenes = Vec::new();
    support::scenes_below(&folder, &mut scenes);
    assert!(scenes.len() > 100, "{} scenes", scenes.len());
    let mut faults = Vec::new();
    for scene in &scenes {
        let _ = fs::remove_file(&output);
        let run = raytree(scene, &output);
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        let refused = REFUSED
            .iter()
            .find(|(part, _)| scene.to_string_lossy().contains(part));
        let fault = match refused {
            Some((_, extension)) if !message.contains(extension) => {
                Some(format!("does not name {extension}: {message}"))
            }
            Some(_) => refusal_fault(&run, &output),
            None if run.status.success() && output.exists() => None,
            None => Some(format!("exit {:?}: {message}", run.status.code())),
        };
        faults.extend(fault.map(|fault| format!("{}: {fault}", scene.display())));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn invalid_files_are_refused_whole_or_cut_short() {
    let Some(folder) = support::shared("gltf-invalid") else {
        return;
    };
    let cut = support::artefact("cut-short");
    let mut scenes = Vec::new();
    support::scenes_below(&folder, &mut scenes);
    assert_eq!(scenes.len(), 12);
    let mut faults = Vec::new();
    for scene in &scenes {
        let output = support::artefact("invalid.png");
        // Infinite vertices cost their triangles, with a warning; the rest is rendered.
        if !scene.ends_with("BoxWithInfinites.glb") {
            let run = raytree(scene, &output);
            faults.extend(
                refusal_fault(&run, &output).map(|fault| format!("{}: {fault}", scene.display())),
            );
        }

        let bytes = fs::read(scene).unwrap();
        let ending = scene.extension().unwrap();
        for step in 0..24 {
            let length = bytes.len() * step / 24;
            let path = cut.with_extension(ending);
            fs::write(&path, &bytes[..length]).unwrap();
            let run = raytree(&path, &output);
            let fault = refusal_fault(&run, &output);
            faults
                .extend(fault.map(|fault| format!("{} cut at {length}: {fault}", scene.display())));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The check has to be able to fail: a good scene is no refusal.
#[test]
fn a_rendered_scene_is_no_refusal() {
    let output = support::artefact("not-refused.png");
    if support::device().is_none() {
        return;
    }
    let run = raytree(&support::root().join("assets/cornell.glb"), &output);
    assert!(refusal_fault(&run, &output).is_some());
}
