//! glTF files as documents that a case changes and puts through the whole program: our own scenes, and small ones made here.

use std::path::Path;

use raytree_assets::AssetFile;
use raytree_scene::{
    default_view::frame_scene,
    import::import,
    model::{Camera, Scene},
    studio::add_studio,
};
use serde_json::{Value, json};

use crate::stage::StressError;

/// A glTF file, its JSON open to changes.
#[derive(Clone)]
pub(crate) struct Document {
    /// The scene's name, "cornell".
    pub name: String,
    /// All of the file but its buffer.
    pub json: Value,
    /// The binary chunk of a `.glb`.
    pub binary: Vec<u8>,
    /// What lies beside it.
    beside: Vec<AssetFile>,
}

impl Document {
    /// A document of this JSON, its buffer `binary`.
    pub fn new(name: &str, json: Value, binary: Vec<u8>) -> Self {
        Self {
            name: name.to_owned(),
            json,
            binary,
            beside: Vec::new(),
        }
    }

    /// Our own scenes, as `assets/` has them.
    pub fn own_scenes() -> Vec<Self> {
        let mut documents: Vec<Self> = Vec::new();
        for file in raytree_assets::files() {
            match (Self::of_file(&file), documents.last_mut()) {
                (Some(document), _) => documents.push(document),
                (None, Some(last)) => last.beside.push(file),
                (None, None) => {}
            }
        }
        documents
    }

    fn of_file(file: &AssetFile) -> Option<Self> {
        let (name, ending) = file.name.rsplit_once('.')?;
        let (json, binary) = match ending {
            "glb" => glb_chunks(&file.bytes)?,
            "gltf" => (file.bytes.as_slice(), [].as_slice()),
            _ => return None,
        };
        let json = serde_json::from_slice(json).ok()?;
        Some(Self::new(name, json, binary.to_vec()))
    }

    /// The elements of a top-level array; none if there is no such array.
    pub fn elements(&mut self, array: &str) -> &mut [Value] {
        self.json
            .get_mut(array)
            .and_then(Value::as_array_mut)
            .map_or(&mut [], Vec::as_mut_slice)
    }

    /// Hangs all roots of the scene under a new node with this transform.
    pub fn hang_under(&mut self, mut parent: Value) {
        let scene = self.json.get("scene").and_then(Value::as_u64).unwrap_or(0) as usize;
        let nodes = self.elements("nodes").len();
        let roots = self.json["scenes"][scene]["nodes"].take();
        parent["children"] = roots;
        if let Some(list) = self.json["nodes"].as_array_mut() {
            list.push(parent);
        }
        self.json["scenes"][scene]["nodes"] = json!([nodes]);
    }

    /// Imports the document from a folder of its own; a scene that is dark gets the studio, as the program gives it.
    ///
    /// # Errors
    /// [`StressError::Io`], [`StressError::Import`].
    pub fn import(&self) -> Result<Scene, StressError> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join(self.file_name());
        self.write(&path)?;
        let mut scene = import(&path)?;
        if scene.lights.is_empty() {
            add_studio(&mut scene);
        }
        Ok(scene)
    }

    fn file_name(&self) -> &'static str {
        if self.binary.is_empty() {
            "scene.gltf"
        } else {
            "scene.glb"
        }
    }

    fn write(&self, path: &Path) -> std::io::Result<()> {
        let json = self.json.to_string().into_bytes();
        let file = if self.binary.is_empty() {
            json
        } else {
            glb(json, self.binary.clone())
        };
        std::fs::write(path, file)?;
        for file in &self.beside {
            std::fs::write(path.with_file_name(&file.name), &file.bytes)?;
        }
        Ok(())
    }
}

/// The camera that the program takes: the file's first, else a view of the whole scene.
pub(crate) fn default_camera(scene: &Scene) -> Camera {
    scene.cameras.first().cloned().unwrap_or_else(|| {
        let (min, max) = scene.bounds().unwrap_or_default();
        frame_scene(min, max, 4.0 / 3.0)
    })
}

const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";

/// The JSON and the buffer of a `.glb` (glTF 2.0, 4.4).
fn glb_chunks(file: &[u8]) -> Option<(&[u8], &[u8])> {
    let (json, rest) = chunk(file.get(12..)?, JSON_CHUNK)?;
    let (binary, _) = chunk(rest, BINARY_CHUNK)?;
    Some((json, binary))
}

fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let rest = rest.strip_prefix(kind)?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

fn glb(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    let total = 28 + json.len() + binary.len();
    [
        b"glTF".as_slice(),
        &2_u32.to_le_bytes(),
        &(total as u32).to_le_bytes(),
        &length(&json),
        JSON_CHUNK,
        &json,
        &length(&binary),
        BINARY_CHUNK,
        &binary,
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_taken_apart_is_the_same_scene() {
        let all = Document::own_scenes();
        assert_eq!(all.len(), 10);
        for document in &all {
            let scene = document.import().unwrap();
            let path = raytree_assets::directory();
            let file = ["glb", "gltf"]
                .map(|ending| path.join(format!("{}.{ending}", document.name)))
                .into_iter()
                .find(|path| path.exists())
                .unwrap();
            let original = import(&file).unwrap();
            assert_eq!(scene.geometry.positions, original.geometry.positions);
            assert_eq!(scene.images, original.images);
            assert_eq!(scene.cameras, original.cameras);
        }
    }

    #[test]
    fn a_parent_stands_above_all_roots() {
        let json = json!({ "scenes": [{ "nodes": [1, 0] }], "nodes": [{}, { "name": "b" }] });
        let mut document = Document::new("two", json, Vec::new());
        document.hang_under(json!({ "scale": [2, 2, 2] }));
        assert_eq!(document.json["scenes"][0]["nodes"], json!([2]));
        assert_eq!(
            document.json["nodes"][2],
            json!({ "scale": [2, 2, 2], "children": [1, 0] })
        );
    }
}
