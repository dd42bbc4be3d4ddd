//! The scenes: ours, and some that nobody here wrote.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::support::{self, Effort, frames::Subject};

const OWN: [&str; 10] = [
    "book.glb",
    "cards.gltf",
    "cornell.glb",
    "critical-prism.glb",
    "everything.glb",
    "facing-mirrors.glb",
    "glass-in-water.glb",
    "materials.gltf",
    "ten-lights.glb",
    "whitted-1980.glb",
];

/// Those that a quick run takes.
const FEW: [&str; 3] = ["book.glb", "cornell.glb", "whitted-1980.glb"];

/// Of `../shared/gltf`.
const OTHERS: [&str; 10] = [
    "AlphaBlendModeTest",
    "Avocado",
    "BoxVertexColors",
    "EmissiveStrengthTest",
    "MetalRoughSpheresNoTextures",
    "NegativeScaleTest",
    "NormalTangentTest",
    "OrientationTest",
    "SpecularTest",
    "TransmissionTest",
];

/// A scene as its first camera shows it, for pictures of any size.
pub fn read(name: String, path: &Path) -> Subject {
    let mut scene = raytree::import(path).unwrap_or_else(|error| panic!("{error}"));
    raytree::light_if_dark(&mut scene);
    let camera = raytree::default_camera(&scene);
    Subject::new(name, (scene, camera), 1)
}

/// Name, file, and whether it is ours.
pub fn files(effort: Effort) -> Vec<(String, PathBuf, bool)> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let own: &[&str] = match effort {
        Effort::Test => &FEW[1..2],
        Effort::Quick => &FEW,
        Effort::Full => &OWN,
    };
    let own = own.iter().map(|file| {
        let name = support::stem(file).to_owned();
        (name, root.join("assets").join(file), true)
    });
    let mut scenes: Vec<_> = own.collect();
    if effort == Effort::Full {
        for name in OTHERS {
            let folder = root.join("../shared/gltf").join(name);
            match scene_file(folder) {
                Some(file) => scenes.push((name.to_owned(), file, false)),
                None => println!("skipped: ../shared/gltf/{name} is not there"),
            }
        }
    }
    scenes
}

/// The first scene file below a folder.
fn scene_file(folder: PathBuf) -> Option<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    entries.sort();
    let is_scene = |path: &PathBuf| {
        path.extension()
            .is_some_and(|end| end == "glb" || end == "gltf")
    };
    let found = entries.iter().find(|path| is_scene(path)).cloned();
    found.or_else(|| {
        entries
            .into_iter()
            .filter(|path| path.is_dir())
            .find_map(scene_file)
    })
}
