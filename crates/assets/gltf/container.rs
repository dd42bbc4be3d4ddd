//! The asset as files: `.glb`, `.gltf` with files beside it, or `.gltf` with everything inside.

use std::collections::BTreeSet;

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use serde_json::{Map, Value, json};

use super::Gltf;
use crate::AssetFile;

/// Which files an asset becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// One binary file.
    Glb,
    /// `.gltf`, `.bin` and a `.png` for each picture.
    Separate,
    /// One `.gltf`, the rest in data URIs.
    Embedded,
}

impl Gltf {
    /// The asset's files, the `.glb` or `.gltf` first.
    #[must_use]
    pub fn files(mut self, container: Container) -> Vec<AssetFile> {
        let images = std::mem::take(&mut self.images);
        let mut beside = Vec::new();
        let mut described = Vec::new();
        for image in images {
            described.push(match container {
                Container::Glb => {
                    let view = self.view(&image.png, None, None);
                    json!({ "name": image.name, "mimeType": "image/png", "bufferView": view })
                }
                Container::Separate => {
                    let name = format!("{}-{}.png", self.name, image.name);
                    beside.push(AssetFile {
                        name: name.clone(),
                        bytes: image.png,
                    });
                    json!({ "name": image.name, "uri": name })
                }
                Container::Embedded => {
                    json!({ "name": image.name, "uri": data_uri("image/png", &image.png) })
                }
            });
        }
        let buffer = std::mem::take(&mut self.buffer);
        let mut description = json!({ "byteLength": buffer.len() });
        match container {
            Container::Glb => {}
            Container::Separate => description["uri"] = json!(format!("{}.bin", self.name)),
            Container::Embedded => {
                description["uri"] = json!(data_uri("application/octet-stream", &buffer))
            }
        }

        let name = self.name.clone();
        let json = self.into_json(described, description);
        let file = |ending: &str, bytes| AssetFile {
            name: format!("{name}.{ending}"),
            bytes,
        };
        let mut files = match container {
            Container::Glb => vec![file("glb", glb(json.to_string().into_bytes(), buffer))],
            Container::Separate => vec![
                file("gltf", format!("{json:#}\n").into_bytes()),
                file("bin", buffer),
            ],
            Container::Embedded => vec![file("gltf", format!("{json:#}\n").into_bytes())],
        };
        files.extend(beside);
        files
    }

    fn into_json(self, images: Vec<Value>, buffer: Value) -> Value {
        let roots = self.roots();
        let mut root = Map::new();
        root.insert(
            "asset".to_owned(),
            json!({ "version": "2.0", "generator": "raytree-assets", "copyright": "MIT OR Apache-2.0" }),
        );
        root.insert("scene".to_owned(), json!(0));
        root.insert(
            "scenes".to_owned(),
            json!([{ "name": self.name, "nodes": roots }]),
        );
        let lists = [
            ("nodes", self.nodes),
            ("cameras", self.cameras),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("textures", self.textures),
            ("images", images),
            ("samplers", self.samplers),
            ("accessors", self.accessors),
            ("bufferViews", self.buffer_views),
            ("buffers", vec![buffer]),
        ];
        // glTF forbids empty lists.
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root.insert(name.to_owned(), Value::Array(list));
        }
        if !self.lights.is_empty() {
            root.insert(
                "extensions".to_owned(),
                json!({ "KHR_lights_punctual": { "lights": self.lights } }),
            );
        }

        let mut json = Value::Object(root);
        let mut used: BTreeSet<String> =
            self.required.iter().map(|&name| name.to_owned()).collect();
        collect_extensions(&json, &mut used);
        if !used.is_empty() {
            json["extensionsUsed"] = json!(used);
        }
        if !self.required.is_empty() {
            json["extensionsRequired"] = json!(self.required);
        }
        json
    }
}

/// The names of all extensions that some part of the file carries.
fn collect_extensions(value: &Value, used: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            if let Some(Value::Object(extensions)) = object.get("extensions") {
                used.extend(extensions.keys().cloned());
            }
            object
                .values()
                .for_each(|child| collect_extensions(child, used));
        }
        Value::Array(list) => list
            .iter()
            .for_each(|child| collect_extensions(child, used)),
        _ => {}
    }
}

fn data_uri(mime: &str, bytes: &[u8]) -> String {
    format!("data:{mime};base64,{}", BASE64.encode(bytes))
}

/// glTF 2.0 chapter 4: header, JSON chunk padded with spaces, binary chunk padded with zeros.
fn glb(mut json: Vec<u8>, mut buffer: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut file = Vec::new();
    let word = |file: &mut Vec<u8>, x: usize| file.extend((x as u32).to_le_bytes());
    file.extend(b"glTF");
    word(&mut file, 2);
    word(&mut file, 12 + 8 + json.len() + 8 + buffer.len());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        word(&mut file, chunk.len());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}
