//! Small glTF files, made in the test that needs them.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DVec3, Vec3};
use raytree_scene::import::{ImportError, import};
use raytree_scene::model::Scene;
use serde_json::{Value, json};

pub const U8: u32 = 5121;
pub const I8: u32 = 5120;
pub const U16: u32 = 5123;
pub const I16: u32 = 5122;
pub const U32: u32 = 5125;
pub const FLOAT: u32 = 5126;

/// Counter-clockwise seen from +z. Extent 1, so that scene space is world space moved by half.
pub const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A glTF file in the making: its JSON, and the content of buffer 0.
#[derive(Clone)]
pub struct Gltf {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Gltf {
    /// Nothing but the version.
    pub fn empty() -> Self {
        Self {
            json: json!({ "asset": { "version": "2.0" } }),
            binary: Vec::new(),
        }
    }

    /// [`TRIANGLE`] as node 0, mesh 0, without indices or normals; accessor 0 holds the positions.
    pub fn triangle() -> Self {
        let mut file = Self::empty();
        let positions = file.floats(&TRIANGLE);
        file.show(json!({ "attributes": { "POSITION": positions } }));
        file
    }

    /// [`Self::triangle`] with `material` (material 0) on it.
    pub fn with_material(material: Value) -> Self {
        let mut file = Self::triangle();
        file.push("materials", material);
        file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        file
    }

    /// Appends to a top-level array; returns the index.
    pub fn push(&mut self, array: &str, element: Value) -> usize {
        let root = self.json.as_object_mut().unwrap();
        let list = root
            .entry(array)
            .or_insert_with(|| json!([]))
            .as_array_mut()
            .unwrap();
        list.push(element);
        list.len() - 1
    }

    /// A mesh of one primitive and a node that shows it.
    pub fn show(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({ "primitives": [primitive] }));
        self.push("nodes", json!({ "mesh": mesh }))
    }

    /// A buffer view of `bytes`.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.push(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    /// An accessor of its own view.
    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        self.push("accessors", accessor)
    }

    /// An accessor of floats; `N` says whether they are scalars or vectors.
    pub fn floats<const N: usize>(&mut self, elements: &[[f32; N]]) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        self.accessor(
            FLOAT,
            kind,
            elements.len(),
            &float_bytes(elements.as_flattened()),
        )
    }

    /// An accessor of 16-bit indices.
    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices
            .iter()
            .flat_map(|index| index.to_le_bytes())
            .collect();
        self.accessor(U16, "SCALAR", indices.len(), &bytes)
    }

    /// An attribute or another field of the first mesh's first primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The complete JSON, with buffer 0 as a data URI.
    pub fn embedded(&self) -> Value {
        let mut json = self.json.clone();
        if !self.binary.is_empty() && json.get("buffers").is_none() {
            let uri = format!(
                "data:application/octet-stream;base64,{}",
                STANDARD.encode(&self.binary)
            );
            json["buffers"] = json!([{ "byteLength": self.binary.len(), "uri": uri }]);
        }
        json
    }

    /// The file as a GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        let mut text = serde_json::to_vec(&json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut file = b"glTF".to_vec();
        let lengths = [2, 12 + 8 + text.len() + 8 + binary.len(), text.len()];
        lengths
            .into_iter()
            .for_each(|word| file.extend_from_slice(&(word as u32).to_le_bytes()));
        file.extend_from_slice(b"JSON");
        file.extend_from_slice(&text);
        file.extend_from_slice(&(binary.len() as u32).to_le_bytes());
        file.extend_from_slice(b"BIN\0");
        file.extend_from_slice(&binary);
        file
    }

    pub fn try_import(&self) -> Result<Scene, ImportError> {
        import_bytes(&serde_json::to_vec(&self.embedded()).unwrap())
    }

    #[track_caller]
    pub fn import(&self) -> Scene {
        let scene = self.try_import().unwrap_or_else(|error| panic!("{error}"));
        check_scene(&scene);
        scene
    }

    /// The one line that says why the file is refused.
    #[track_caller]
    pub fn error(&self) -> String {
        let message = self
            .try_import()
            .expect_err("the file should be refused")
            .to_string();
        assert!(!message.contains('\n'), "{message}");
        assert!(message.contains("scene.gltf: "), "{message}");
        message
    }
}

pub fn float_bytes(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Imports what `bytes` hold, from a file of that content.
pub fn import_bytes(bytes: &[u8]) -> Result<Scene, ImportError> {
    Folder::new().import(bytes)
}

/// A folder that goes away with its value.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let name = format!(
            "raytree-import-{}-{}",
            std::process::id(),
            NEXT.fetch_add(1, Ordering::Relaxed)
        );
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.0.join(name), bytes).unwrap();
    }

    /// Writes a scene file of that content into the folder and imports it.
    pub fn import(&self, bytes: &[u8]) -> Result<Scene, ImportError> {
        self.write("scene.gltf", bytes);
        import(&self.0.join("scene.gltf"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The corners of triangle `index` in world space.
pub fn world_corners(scene: &Scene, index: usize) -> [DVec3; 3] {
    let corner = |vertex: u32| {
        scene
            .frame
            .to_world(scene.geometry.positions[vertex as usize].as_dvec3())
    };
    scene.geometry.triangles[index].vertices.map(corner)
}

/// All triangles in world space; for coordinates that are multiples of 2^-16, which they become again.
pub fn world_triangles(scene: &Scene) -> Vec<[[f64; 3]; 3]> {
    const GRID: f64 = 65_536.0;
    // Adding zero turns -0 into 0.
    let on_grid = |corner: DVec3| ((corner * GRID).round() / GRID + 0.0).to_array();
    (0..scene.geometry.triangles.len())
        .map(|index| world_corners(scene, index).map(on_grid))
        .collect()
}

pub fn warnings(scene: &Scene) -> Vec<String> {
    scene.warnings.iter().map(ToString::to_string).collect()
}

/// What model.rs promises of every scene.
#[track_caller]
pub fn check_scene(scene: &Scene) {
    let geometry = &scene.geometry;
    let count = geometry.positions.len();
    assert!(
        geometry
            .positions
            .iter()
            .all(|position| position.is_finite() && position.abs().max_element() <= 1.0)
    );
    assert_eq!(geometry.normals.len(), count);
    assert!(
        geometry
            .normals
            .iter()
            .all(|normal| (normal.length() - 1.0).abs() < 1e-5)
    );
    let has_normal_map = scene
        .materials
        .iter()
        .any(|material| material.normal_texture.is_some());
    assert_eq!(
        geometry.tangents.len(),
        if has_normal_map { count } else { 0 }
    );
    for tangent in &geometry.tangents {
        assert!(
            (tangent.truncate().length() - 1.0).abs() < 1e-5 && tangent.w.abs() == 1.0,
            "{tangent}"
        );
    }
    assert!(
        geometry
            .uv_sets
            .iter()
            .all(|set| set.len() == count && set.iter().all(|uv| uv.is_finite()))
    );
    assert!(geometry.colors.is_empty() || geometry.colors.len() == count);
    for triangle in &geometry.triangles {
        let [a, b, c] = triangle
            .vertices
            .map(|vertex| geometry.positions[vertex as usize].as_dvec3());
        assert!((b - a).cross(c - a) != DVec3::ZERO);
        assert!((triangle.material as usize) < scene.materials.len());
        assert!((triangle.node as usize) < scene.nodes.len());
    }
    for texture in scene
        .materials
        .iter()
        .flat_map(|material| material.texture_refs())
    {
        assert!((texture.texture as usize) < scene.textures.len());
        assert!((texture.uv_set as usize) < geometry.uv_sets.len());
    }
    for texture in &scene.textures {
        assert!((texture.image as usize) < scene.images.len());
    }
    for image in &scene.images {
        assert!(
            image.width > 0 && image.texels.len() == image.width as usize * image.height as usize
        );
    }
    for camera in &scene.cameras {
        let axes = [camera.right, camera.up, camera.forward];
        assert!(axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-12));
        assert!((camera.right.cross(camera.up) + camera.forward).length() < 1e-12);
    }
    for warning in &scene.warnings {
        assert!(!warning.to_string().contains('\n'));
    }
}

#[track_caller]
pub fn assert_close(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1e-6, "{a} is not {b}");
}
