//! What the tests share: the device, the scenes, and where pictures of failures go.
#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(clippy::print_stdout, reason = "a test says what it skips")]

use std::{
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use raytree::{
    Camera, Device, DeviceChoice, DeviceInfo, Film, Preset, RenderSettings, Rendering, Scene,
    WriteOptions,
};

/// What is kept in the repository was blessed on this. The CPU that runs it is no part of it: lavapipe compiles for what it
/// finds, so the last bit of a float may differ.
pub const PINNED_DRIVER: &str = "llvmpipe Mesa 25.0.7";

/// Whether a device's driver is that one.
pub fn is_pinned(device: &DeviceInfo) -> bool {
    // Mesa's version may go on ("25.0.7-2"), but 25.0.70 would be another.
    device
        .driver
        .strip_prefix(PINNED_DRIVER)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// Whether what is kept is to be rewritten: `RAYTREE_BLESS=1`. The test that does so still fails, so that no run that blesses passes for
/// one that tested.
pub fn blessing() -> bool {
    std::env::var_os("RAYTREE_BLESS").is_some_and(|value| value == "1")
}

/// The project's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The device of this process. `None`, with a line that says so, where the machine has none; a failure where
/// `RAYTREE_REQUIRE_DEVICE` is set, as it is in CI.
pub fn device() -> Option<&'static Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE
        .get_or_init(|| {
            let choice = match std::env::var("RAYTREE_DEVICE") {
                Ok(text) => DeviceChoice::from(text.as_str()),
                Err(_) => DeviceChoice::default(),
            };
            match Device::open(&choice) {
                Ok(device) => Some(device),
                Err(error) if std::env::var_os("RAYTREE_REQUIRE_DEVICE").is_some() => {
                    panic!("{error}")
                }
                Err(error) => {
                    println!("skipped: {error}");
                    None
                }
            }
        })
        .as_ref()
}

/// A folder of scenes that nobody here wrote, beside the checkout. `None`, with a line that says so, where it is not there.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = root().join("../shared").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there", path.display());
    None
}

/// Every scene file in a folder and in those in it, in the order of their names.
pub fn scenes_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            scenes_below(&path, found);
        } else if path
            .extension()
            .is_some_and(|ending| ending == "gltf" || ending == "glb")
        {
            found.push(path);
        }
    }
}

/// Our own scenes, in the order of their names.
pub fn own_scenes() -> Vec<PathBuf> {
    let mut scenes: Vec<PathBuf> = fs::read_dir(root().join("assets"))
        .expect("assets/ is part of the project")
        .map(|entry| entry.expect("a readable entry").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|ending| ending == "glb" || ending == "gltf")
        })
        .collect();
    scenes.sort();
    assert!(
        scenes.len() >= 8,
        "assets/ has only {} scenes",
        scenes.len()
    );
    scenes
}

/// A file's name without its ending.
pub fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Imports a scene that has to be right.
pub fn import(path: &Path) -> Scene {
    raytree::import(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The camera that the scene is meant to be seen by.
pub fn camera(scene: &Scene) -> Camera {
    raytree::default_camera(scene)
}

/// Renders with counters on.
pub fn render(device: &Device, scene: &Scene, settings: &RenderSettings) -> Rendering {
    raytree::render(
        device,
        scene,
        Preset::default(),
        settings,
        &mut raytree::unobserved,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

/// Where a failing test leaves its pictures.
pub fn artefact(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pictures");
    fs::create_dir_all(&folder).expect("a writable target folder");
    folder.join(name)
}

/// Writes a film for a person to look at, as it is, without tone mapping.
pub fn write(film: &Film, name: &str) -> PathBuf {
    let path = artefact(name);
    let options = WriteOptions {
        tone: raytree::ToneMap::None,
        ..WriteOptions::default()
    };
    film.write(&path, &options)
        .unwrap_or_else(|error| panic!("{error}"));
    path
}
