//! Vertex attributes and indices: encoded, packed into buffer views, described by accessors.

use serde_json::{Map, Value, json};

use super::{Gltf, push};
use crate::shapes::Shape;

/// How a mesh's vertices lie in the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// f32, a buffer view for each attribute.
    Separate,
    /// f32, all attributes of a vertex side by side.
    Interleaved,
    /// Normalised integers (KHR_mesh_quantization), a buffer view for each attribute.
    Quantized,
    /// As `Separate`; the caller brings the positions.
    WithoutPositions,
}

/// How a component is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Encoding {
    Float,
    Snorm8,
    Snorm16,
    Unorm8,
    Unorm16,
}

impl Encoding {
    fn component_type(self) -> u32 {
        match self {
            Self::Snorm8 => 5120,
            Self::Unorm8 => 5121,
            Self::Snorm16 => 5122,
            Self::Unorm16 => 5123,
            Self::Float => 5126,
        }
    }

    /// Appends `x` to `bytes`; the stored number, which is what an accessor's bounds speak of.
    fn write(self, x: f64, bytes: &mut Vec<u8>) -> f64 {
        let scaled = |limit: f64| (x * limit).round();
        match self {
            // Adding zero turns -0 into 0: equal positions have equal bytes.
            Self::Float => {
                let x = x as f32 + 0.0;
                bytes.extend(x.to_le_bytes());
                f64::from(x)
            }
            Self::Snorm8 => {
                bytes.extend((scaled(127.0) as i8).to_le_bytes());
                scaled(127.0)
            }
            Self::Snorm16 => {
                bytes.extend((scaled(32767.0) as i16).to_le_bytes());
                scaled(32767.0)
            }
            Self::Unorm8 => {
                bytes.push(scaled(255.0) as u8);
                scaled(255.0)
            }
            Self::Unorm16 => {
                bytes.extend((scaled(65535.0) as u16).to_le_bytes());
                scaled(65535.0)
            }
        }
    }
}

/// One attribute of all vertices. Its elements are padded to four bytes, as glTF asks of vertex attributes.
#[derive(Debug)]
struct Column {
    semantic: &'static str,
    encoding: Encoding,
    kind: &'static str,
    bytes: Vec<u8>,
    count: usize,
    bounds: Option<(Vec<f64>, Vec<f64>)>,
}

impl Column {
    fn new<const N: usize>(
        semantic: &'static str,
        encoding: Encoding,
        rows: impl IntoIterator<Item = [f64; N]>,
    ) -> Self {
        let (mut bytes, mut count) = (Vec::new(), 0);
        let (mut min, mut max) = (vec![f64::INFINITY; N], vec![f64::NEG_INFINITY; N]);
        for row in rows {
            for (i, x) in row.into_iter().enumerate() {
                let stored = encoding.write(x, &mut bytes);
                min[i] = min[i].min(stored);
                max[i] = max[i].max(stored);
            }
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            count += 1;
        }
        let bounds = (semantic == "POSITION" && count > 0).then_some((min, max));
        Self {
            semantic,
            encoding,
            kind: ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1],
            bytes,
            count,
            bounds,
        }
    }

    fn stride(&self) -> usize {
        self.bytes.len() / self.count.max(1)
    }

    /// The accessor's description; the caller adds where the data lies.
    fn describe(&self) -> Value {
        let mut accessor = json!({ "componentType": self.encoding.component_type(), "count": self.count, "type": self.kind });
        if self.encoding != Encoding::Float {
            accessor["normalized"] = json!(true);
        }
        if let Some((min, max)) = &self.bounds {
            accessor["min"] = super::numbers(min);
            accessor["max"] = super::numbers(max);
        }
        accessor
    }
}

/// What makes two accessors the same: where their data is used, their type, their bytes.
pub(super) type Key = (u32, &'static str, Encoded, Vec<u8>);

/// An accessor's component type and whether it is normalised.
pub(super) type Encoded = (u32, bool);

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

impl Gltf {
    /// Stores a shape's vertices; the `attributes` of a primitive.
    pub(super) fn attributes(&mut self, shape: &Shape, layout: Layout) -> Value {
        let columns = columns(shape, layout);
        if layout == Layout::Quantized {
            self.require("KHR_mesh_quantization");
        }
        if layout == Layout::Interleaved {
            return self.interleave(&columns);
        }
        columns
            .iter()
            .map(|column| {
                (
                    column.semantic.to_owned(),
                    json!(self.vertex_accessor(column)),
                )
            })
            .collect()
    }

    /// Stores a shape's triangles; the accessor's index. 16 bits where they do.
    pub(super) fn indices(&mut self, shape: &Shape) -> usize {
        let indices = shape.triangles.iter().flatten();
        let short = shape.positions.len() <= usize::from(u16::MAX);
        let (component_type, bytes): (u32, Vec<u8>) = if short {
            (
                5123,
                indices.flat_map(|&i| (i as u16).to_le_bytes()).collect(),
            )
        } else {
            (5125, indices.flat_map(|&i| i.to_le_bytes()).collect())
        };
        let accessor = json!({ "componentType": component_type, "count": 3 * shape.triangles.len(), "type": "SCALAR" });
        self.accessor(
            accessor,
            (INDICES, "SCALAR", (component_type, false), bytes),
            None,
        )
    }

    /// Stores where `changed` has other positions than `base`; the index of an accessor that puts them over `base`'s.
    pub(super) fn sparse_positions(&mut self, base: &Shape, changed: &Shape) -> usize {
        let base_accessor = self.vertex_accessor(&positions(base, Encoding::Float));
        let moved: Vec<usize> = (0..base.positions.len())
            .filter(|&i| base.positions[i] != changed.positions[i])
            .collect();
        let values = Column::new(
            "",
            Encoding::Float,
            moved.iter().map(|&i| changed.positions[i].to_array()),
        );
        let indices: Vec<u8> = moved
            .iter()
            .flat_map(|&i| (i as u32).to_le_bytes())
            .collect();

        let mut accessor = positions(changed, Encoding::Float).describe();
        accessor["bufferView"] = self.accessors[base_accessor]["bufferView"].clone();
        accessor["sparse"] = json!({
            "count": moved.len(),
            "indices": { "bufferView": self.view(&indices, None, None), "componentType": 5125 },
            "values": { "bufferView": self.view(&values.bytes, None, None) },
        });
        push(&mut self.accessors, accessor)
    }

    fn interleave(&mut self, columns: &[Column]) -> Value {
        let stride: usize = columns.iter().map(Column::stride).sum();
        let count = columns.first().map_or(0, |column| column.count);
        let mut bytes = Vec::with_capacity(stride * count);
        for vertex in 0..count {
            for column in columns {
                bytes.extend(&column.bytes[vertex * column.stride()..][..column.stride()]);
            }
        }
        let view = self.view(&bytes, Some(VERTICES), Some(stride));
        let mut attributes = Map::new();
        let mut offset = 0;
        for column in columns {
            let mut accessor = column.describe();
            accessor["bufferView"] = json!(view);
            accessor["byteOffset"] = json!(offset);
            offset += column.stride();
            attributes.insert(
                column.semantic.to_owned(),
                json!(push(&mut self.accessors, accessor)),
            );
        }
        Value::Object(attributes)
    }

    fn vertex_accessor(&mut self, column: &Column) -> usize {
        let encoded = (
            column.encoding.component_type(),
            column.encoding != Encoding::Float,
        );
        let key = (VERTICES, column.kind, encoded, column.bytes.clone());
        self.accessor(column.describe(), key, Some(column.stride()))
    }

    /// The accessor with these contents: one that is there already if nothing but its bounds could tell them apart
    /// (a reader may have bounds that the attribute does not need).
    fn accessor(&mut self, mut accessor: Value, key: Key, stride: Option<usize>) -> usize {
        if let Some(&known) = self.known_accessors.get(&key)
            && (accessor.get("min").is_none() || self.accessors[known].get("min").is_some())
        {
            return known;
        }
        accessor["bufferView"] = json!(self.view(&key.3, Some(key.0), stride));
        let index = push(&mut self.accessors, accessor);
        self.known_accessors.insert(key, index);
        index
    }

    /// Appends to the buffer, four-byte aligned; the buffer view's index.
    pub(super) fn view(
        &mut self,
        bytes: &[u8],
        target: Option<u32>,
        stride: Option<usize>,
    ) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.buffer.extend(bytes);
        push(&mut self.buffer_views, view)
    }
}

fn positions(shape: &Shape, encoding: Encoding) -> Column {
    Column::new(
        "POSITION",
        encoding,
        shape.positions.iter().map(|p| p.to_array()),
    )
}

fn columns(shape: &Shape, layout: Layout) -> Vec<Column> {
    let quantized = layout == Layout::Quantized;
    let pick = |encoding: Encoding| if quantized { encoding } else { Encoding::Float };
    let all = [
        positions(shape, pick(Encoding::Snorm16)),
        Column::new(
            "NORMAL",
            pick(Encoding::Snorm8),
            shape.normals.iter().map(|n| n.to_array()),
        ),
        Column::new(
            "TANGENT",
            pick(Encoding::Snorm8),
            shape.tangents.iter().map(|t| t.to_array()),
        ),
        Column::new(
            "TEXCOORD_0",
            pick(Encoding::Unorm16),
            shape.uvs[0].iter().map(|uv| uv.to_array()),
        ),
        Column::new(
            "TEXCOORD_1",
            pick(Encoding::Unorm16),
            shape.uvs[1].iter().map(|uv| uv.to_array()),
        ),
        Column::new(
            "COLOR_0",
            pick(Encoding::Unorm8),
            shape.colors.iter().map(|c| c.to_array()),
        ),
    ];
    let skipped = usize::from(layout == Layout::WithoutPositions);
    all.into_iter()
        .skip(skipped)
        .filter(|column| column.count > 0)
        .collect()
}
