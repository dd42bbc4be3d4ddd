//! A glTF 2.0 builder: shapes, materials, pictures, nodes, lights and cameras in; a `.glb`, or a `.gltf` with its files, out.
//!
//! Things are added one after another and referred to by the ids that come back. What repeats (the same vertices under
//! another material, the same sampler) is stored once. Numbers are rounded to f32, which is all that a reader keeps.

mod accessor;
mod container;
mod material;
mod node;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

pub use accessor::Layout;
pub use container::Container;
pub use material::Material;
pub use node::Node;

use crate::pixels::Pixels;
use crate::shapes::{Orientation, Shape};

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name(pub(crate) usize);
    )*};
}

ids!(
    /// A mesh of a [`Gltf`].
    MeshId,
    /// A material of a [`Gltf`].
    MaterialId,
    /// A texture (picture and sampler) of a [`Gltf`].
    TextureId,
    /// A node of a [`Gltf`].
    NodeId
);

/// A glTF asset with one scene.
#[derive(Debug, Default)]
pub struct Gltf {
    name: String,
    buffer: Vec<u8>,
    buffer_views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    samplers: Vec<Value>,
    images: Vec<EncodedImage>,
    textures: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    nodes: Vec<Value>,
    required: BTreeSet<&'static str>,
    /// Accessors by what they hold, so that equal data is stored once.
    known_accessors: BTreeMap<accessor::Key, usize>,
}

#[derive(Debug)]
struct EncodedImage {
    name: String,
    png: Vec<u8>,
}

/// How a texture is read beyond [0, 1]: glTF's numbers.
#[derive(Clone, Copy, Debug)]
pub enum Wrap {
    /// Again and again.
    Repeat = 10497,
    /// Again and again, every other time mirrored.
    Mirror = 33648,
    /// The edge texel goes on.
    Clamp = 33071,
}

/// How a texture is read between texel centres: glTF's numbers.
#[derive(Clone, Copy, Debug)]
pub enum Filter {
    /// The texel that the point lies in.
    Nearest = 9728,
    /// Between the four nearest texel centres.
    Linear = 9729,
}

impl Gltf {
    /// An empty asset; `name` becomes the stem of its files.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..Self::default()
        }
    }

    /// Adds a material.
    pub fn material(&mut self, material: Material) -> MaterialId {
        MaterialId(push(&mut self.materials, material.into_json()))
    }

    /// Adds a mesh of one shape, each attribute in a buffer view of its own.
    pub fn mesh(&mut self, name: &str, shape: &Shape, material: MaterialId) -> MeshId {
        self.mesh_as(name, &[(shape, material)], Layout::Separate)
    }

    /// Adds a mesh of several primitives. `Layout::Quantized` needs positions within [-1, 1] and uv within [0, 1].
    pub fn mesh_as(
        &mut self,
        name: &str,
        parts: &[(&Shape, MaterialId)],
        layout: Layout,
    ) -> MeshId {
        let primitives: Vec<Value> = parts
            .iter()
            .map(|(shape, material)| {
                let attributes = self.attributes(shape, layout);
                self.primitive(attributes, shape, *material)
            })
            .collect();
        self.push_mesh(name, primitives, parts)
    }

    /// Adds a mesh that shares the positions of `base` apart from those that `changed` has elsewhere: these few come from
    /// a sparse accessor. Both shapes must have the same number of vertices.
    pub fn sparse_mesh(
        &mut self,
        name: &str,
        base: &Shape,
        changed: &Shape,
        material: MaterialId,
    ) -> MeshId {
        let mut attributes = self.attributes(changed, Layout::WithoutPositions);
        attributes["POSITION"] = json!(self.sparse_positions(base, changed));
        let primitive = self.primitive(attributes, changed, material);
        self.push_mesh(name, vec![primitive], &[(changed, material)])
    }

    fn primitive(&mut self, attributes: Value, shape: &Shape, material: MaterialId) -> Value {
        json!({ "attributes": attributes, "indices": self.indices(shape), "material": material.0 })
    }

    /// `extras.closed` says of solids which way their surfaces face; the tests hold the file to it.
    fn push_mesh(
        &mut self,
        name: &str,
        primitives: Vec<Value>,
        parts: &[(&Shape, MaterialId)],
    ) -> MeshId {
        let mut mesh = json!({ "name": name, "primitives": primitives });
        let mut closed = parts.iter().map(|(shape, _)| shape.closed);
        if let Some(Some(orientation)) = closed.next()
            && closed.all(|other| other == Some(orientation))
        {
            let side = match orientation {
                Orientation::Outward => "outward",
                Orientation::Inward => "inward",
            };
            mesh["extras"] = json!({ "closed": side });
        }
        MeshId(push(&mut self.meshes, mesh))
    }

    /// Adds a picture and how it is read.
    pub fn texture(
        &mut self,
        name: &str,
        pixels: &Pixels,
        filter: Filter,
        wrap: Wrap,
    ) -> TextureId {
        let png = pixels.to_png();
        let image = self
            .images
            .iter()
            .position(|image| image.png == png)
            .unwrap_or_else(|| {
                self.images.push(EncodedImage {
                    name: name.to_owned(),
                    png,
                });
                self.images.len() - 1
            });
        let (filter, wrap) = (filter as u32, wrap as u32);
        let sampler =
            json!({ "magFilter": filter, "minFilter": filter, "wrapS": wrap, "wrapT": wrap });
        let sampler = push_once(&mut self.samplers, sampler);
        TextureId(push_once(
            &mut self.textures,
            json!({ "sampler": sampler, "source": image }),
        ))
    }

    /// Says that a reader that does not know the extension can't read the file.
    pub fn require(&mut self, extension: &'static str) {
        self.required.insert(extension);
    }
}

/// Adds to a list of the file; the index that glTF knows the element by.
fn push(list: &mut Vec<Value>, value: Value) -> usize {
    list.push(value);
    list.len() - 1
}

/// Like [`push`], but an equal element that is there already serves again.
fn push_once(list: &mut Vec<Value>, value: Value) -> usize {
    list.iter()
        .position(|other| *other == value)
        .unwrap_or_else(|| push(list, value))
}

/// A number as f32 with the fewest digits that name it.
pub(crate) fn number(x: f64) -> Value {
    let shortest = (x as f32 + 0.0).to_string();
    json!(shortest.parse::<f64>().unwrap_or(x))
}

/// A list of numbers, each as [`number`] has it.
pub(crate) fn numbers(xs: &[f64]) -> Value {
    xs.iter().map(|&x| number(x)).collect()
}
