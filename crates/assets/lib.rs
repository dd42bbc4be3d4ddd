//! The scenes of `assets/`, made by program: a small glTF builder, shapes and pictures to feed it, and one function a
//! scene. What each scene is for, and what a right picture of it shows, is in `assets/README.md`.
//!
//! The same code gives the same bytes: no clock, no random numbers, no hash order; lengths are computed in f64 and
//! rounded to f32 once, so that the last digit of a platform's sine does not matter.
//!
//! ```
//! let files = raytree_assets::files();
//! assert!(files.iter().any(|file| file.name == "cornell.glb"));
//! ```

use std::path::PathBuf;

pub mod gltf;
pub mod pixels;
pub mod scenes;
pub mod shapes;

/// A file of `assets/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetFile {
    /// Its name in `assets/`, "cornell.glb".
    pub name: String,
    /// All of its contents.
    pub bytes: Vec<u8>,
}

/// Every file that belongs in `assets/` (apart from its README), made anew; scene by scene, each scene's `.glb` or
/// `.gltf` first.
#[must_use]
pub fn files() -> Vec<AssetFile> {
    scenes::all()
        .into_iter()
        .flat_map(|(scene, container)| scene.files(container))
        .collect()
}

/// Where the files are committed: `assets/` of this source tree.
#[must_use]
pub fn directory() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}
