//! Small glTF files of raw numbers: what exporters' libraries, ours among them, would refuse to write.

use std::fs;

use raytree_scene::{import::import, model::Scene};
use serde_json::{Value, json};

use crate::stage::StressError;

/// A file in the making: one buffer, one scene that shows every node.
pub(super) struct File {
    json: Value,
    binary: Vec<u8>,
}

impl File {
    pub(super) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_unlit"],
            "extensions": { "KHR_lights_punctual": { "lights": [] } },
            "bufferViews": [], "accessors": [], "materials": [], "meshes": [], "nodes": [],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    /// Adds to a top-level array; the index.
    pub(super) fn push(&mut self, array: &str, element: Value) -> usize {
        let list = self.json[array].as_array_mut();
        list.map_or(0, |list| {
            list.push(element);
            list.len() - 1
        })
    }

    /// An accessor of vectors.
    pub(super) fn vectors(&mut self, vectors: &[[f32; 3]]) -> usize {
        let offset = self.binary.len();
        let bytes = vectors.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        self.binary.extend(bytes);
        let length = self.binary.len() - offset;
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        let view = self.push("bufferViews", view);
        let (count, float) = (vectors.len(), 5126);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": float, "type": "VEC3", "count": count }),
        )
    }

    /// A mesh of triangles that share no vertices, shown by a node with these members.
    pub(super) fn triangles(&mut self, corners: &[[f32; 3]], material: usize, mut node: Value) {
        let positions = self.vectors(corners);
        let primitive = json!({ "attributes": { "POSITION": positions }, "material": material });
        let mesh = self.push("meshes", json!({ "primitives": [primitive] }));
        node["mesh"] = json!(mesh);
        self.push("nodes", node);
    }

    /// A point light, candela.
    pub(super) fn light(&mut self, at: [f64; 3], intensity: f64) {
        let lights = &mut self.json["extensions"]["KHR_lights_punctual"]["lights"];
        if let Some(lights) = lights.as_array_mut() {
            lights.push(json!({ "type": "point", "intensity": intensity }));
            let light = json!({ "KHR_lights_punctual": { "light": lights.len() - 1 } });
            self.push("nodes", json!({ "translation": at, "extensions": light }));
        }
    }

    /// What the importer makes of it.
    pub(super) fn import(&self) -> Result<Scene, StressError> {
        let folder = tempfile::tempdir()?;
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "uri": "scene.bin", "byteLength": self.binary.len() }]);
        let nodes = self.json["nodes"].as_array().map_or(0, Vec::len);
        json["scenes"] = json!([{ "nodes": (0..nodes).collect::<Vec<_>>() }]);
        fs::write(folder.path().join("scene.bin"), &self.binary)?;
        let path = folder.path().join("scene.gltf");
        fs::write(&path, json.to_string())?;
        Ok(import(&path)?)
    }
}
