//! The scenes: ours, and some that nobody here wrote.

use std::{
    fs,
    path::{Path, PathBuf},
};

use raytree::{
    Bvh, Device, Prepared, Preset, ProgramFeatures, RenderSettings, Scene, SceneFeatures,
};

use crate::support::{self, Effort, frames::prepared};

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

/// A scene with its hierarchy.
pub struct Subject {
    pub name: String,
    pub is_ours: bool,
    pub scene: Scene,
    bvh: Bvh,
}

impl Subject {
    pub fn read(name: String, path: &Path, is_ours: bool) -> Self {
        let mut scene = raytree::import(path).unwrap_or_else(|error| panic!("{error}"));
        raytree::light_if_dark(&mut scene);
        let bvh =
            raytree::build_bvh(&scene, Preset::default()).unwrap_or_else(|error| panic!("{error}"));
        Self {
            name,
            is_ours,
            scene,
            bvh,
        }
    }

    pub fn features(&self, settings: &RenderSettings) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(&self.scene), settings)
    }

    /// Uploaded and compiled.
    pub fn prepared<'p>(
        &'p self,
        device: &'p Device,
        settings: &'p RenderSettings,
    ) -> Prepared<'p> {
        let features = self.features(settings);
        prepared(device, (&self.scene, &self.bvh), settings, features)
    }
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
