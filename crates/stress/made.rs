//! Small glTF documents made in code, for cases that go through the importer.

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Map, Value, json};

use crate::{documents::Document, scenes::CUBOID_SIDES};

/// A document under construction.
#[derive(Default)]
pub(crate) struct Made {
    buffer: Vec<u8>,
    arrays: Map<String, Value>,
    lights: Vec<Value>,
}

impl Made {
    /// Adds a mesh of flat quadrangles, corners counter-clockwise; its index.
    pub fn mesh(&mut self, quads: &[[[f32; 3]; 4]], material: usize) -> usize {
        let corners = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
        let corners: Vec<[f32; 3]> = corners.collect();
        let bound = |pick: fn(f32, f32) -> f32| {
            let mut corners = corners.iter().copied();
            let first = corners.next().unwrap_or_default();
            corners.fold(first, |bound, corner| {
                std::array::from_fn(|k| pick(bound[k], corner[k]))
            })
        };
        let bytes: &[u8] = bytemuck::cast_slice(&corners);
        let view =
            json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        let view = self.push("bufferViews", view);
        let positions = json!({
            "bufferView": view, "componentType": 5126, "count": corners.len(), "type": "VEC3",
            "min": bound(f32::min), "max": bound(f32::max),
        });
        self.buffer.extend_from_slice(bytes);
        let positions = self.push("accessors", positions);
        let primitive = json!({ "attributes": { "POSITION": positions }, "material": material });
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// The sides of a box, facing outwards.
    pub fn cuboid(min: [f32; 3], max: [f32; 3]) -> [[[f32; 3]; 4]; 6] {
        CUBOID_SIDES.map(|side| {
            side.map(|corner: usize| {
                std::array::from_fn(|k| if corner >> k & 1 == 0 { min[k] } else { max[k] })
            })
        })
    }

    /// Adds a material; its index.
    pub fn material(&mut self, material: Value) -> usize {
        self.push("materials", material)
    }

    /// Adds a node; its index.
    pub fn node(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    /// Adds a node with a perspective camera of this lens (`yfov`, radians); its index.
    pub fn camera(&mut self, eye: DVec3, target: DVec3, lens: Value) -> usize {
        let mut lens = lens;
        lens["znear"] = json!(0.1);
        let camera = json!({ "type": "perspective", "perspective": lens });
        let camera = self.push("cameras", camera);
        self.node(Self::looking(eye, target, camera))
    }

    /// A node at `eye` with this camera, turned towards `target`.
    pub fn looking(eye: DVec3, target: DVec3, camera: usize) -> Value {
        let backward = (eye - target).normalize();
        let right = DVec3::Y.cross(backward).normalize_or(DVec3::X);
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        let rotation = DQuat::from_mat3(&axes).to_array();
        json!({ "camera": camera, "translation": eye.to_array(), "rotation": rotation })
    }

    /// Adds a node with a directional light; its index.
    pub fn sun(&mut self, direction: DVec3, intensity: f64) -> usize {
        let light = json!({ "type": "directional", "intensity": intensity });
        let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction.normalize()).to_array();
        self.light(light, json!({ "rotation": rotation }))
    }

    /// Adds a node with a point light, candela; its index.
    pub fn lamp(&mut self, at: DVec3, intensity: f64) -> usize {
        let light = json!({ "type": "point", "intensity": intensity });
        self.light(light, json!({ "translation": at.to_array() }))
    }

    fn light(&mut self, light: Value, mut node: Value) -> usize {
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": self.lights.len() } });
        self.lights.push(light);
        self.node(node)
    }

    fn push(&mut self, array: &str, element: Value) -> usize {
        let list = self.arrays.entry(array).or_insert_with(|| json!([]));
        list.as_array_mut().map_or(0, |list| {
            list.push(element);
            list.len() - 1
        })
    }

    /// The document, with these nodes as roots of its scene.
    pub fn document(self, name: &str, roots: &[usize]) -> Document {
        let mut json = self.arrays;
        json.insert("asset".to_owned(), json!({ "version": "2.0" }));
        json.insert("scene".to_owned(), json!(0));
        json.insert("scenes".to_owned(), json!([{ "nodes": roots }]));
        let length = self.buffer.len();
        json.insert("buffers".to_owned(), json!([{ "byteLength": length }]));
        json.insert(
            "extensionsUsed".to_owned(),
            json!(["KHR_lights_punctual", "KHR_materials_unlit"]),
        );
        json.insert(
            "extensions".to_owned(),
            json!({ "KHR_lights_punctual": { "lights": self.lights } }),
        );
        Document::new(name, json.into(), self.buffer)
    }
}
