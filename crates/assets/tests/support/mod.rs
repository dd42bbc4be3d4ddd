//! A glTF reader of its own, so that the builder is not judged by itself.

use std::collections::BTreeMap;

use base64::Engine;
use raytree_assets::AssetFile;
use serde_json::Value;

/// A scene's file, parsed, with its buffer and its pictures.
pub struct Parsed {
    pub name: String,
    pub json: Value,
    pub buffer: Vec<u8>,
    pub images: Vec<Vec<u8>>,
}

/// Every scene.
pub fn scenes() -> Vec<Parsed> {
    let files: BTreeMap<String, Vec<u8>> = raytree_assets::files()
        .into_iter()
        .map(|AssetFile { name, bytes }| (name, bytes))
        .collect();
    let scenes: Vec<Parsed> = files
        .iter()
        .filter(|(name, _)| name.ends_with(".glb") || name.ends_with(".gltf"))
        .map(|(name, bytes)| parse(name, bytes, &files))
        .collect();
    assert!(!scenes.is_empty());
    scenes
}

fn parse(name: &str, bytes: &[u8], files: &BTreeMap<String, Vec<u8>>) -> Parsed {
    let (json, chunk) = if name.ends_with(".glb") {
        split_glb(bytes)
    } else {
        (bytes, &[][..])
    };
    let json: Value =
        serde_json::from_slice(json).unwrap_or_else(|error| panic!("{name}: {error}"));
    let load = |uri: &str| match uri.split_once(";base64,") {
        Some((_, data)) => base64::engine::general_purpose::STANDARD
            .decode(data)
            .unwrap(),
        None => files[uri].clone(),
    };
    let mut buffer = json["buffers"][0]["uri"]
        .as_str()
        .map_or(chunk.to_vec(), load);
    // A binary chunk may be padded by up to three bytes.
    let length = size(&json["buffers"][0]["byteLength"]);
    assert!(
        (length..length + 4).contains(&buffer.len()),
        "{name}: buffer"
    );
    buffer.truncate(length);
    let images = list(&json, "images")
        .iter()
        .map(|image| match image["uri"].as_str() {
            Some(uri) => load(uri),
            None => {
                let view = &json["bufferViews"][size(&image["bufferView"])];
                buffer[size(&view["byteOffset"])..][..size(&view["byteLength"])].to_vec()
            }
        })
        .collect();
    Parsed {
        name: name.to_owned(),
        json,
        buffer,
        images,
    }
}

fn split_glb(bytes: &[u8]) -> (&[u8], &[u8]) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(
        (&bytes[..4], word(4), word(8)),
        (&b"glTF"[..], 2, bytes.len())
    );
    let json = &bytes[20..20 + word(12)];
    assert_eq!(&bytes[16..20], b"JSON");
    let rest = &bytes[20 + word(12)..];
    assert_eq!(&rest[4..8], b"BIN\0");
    (json, &rest[8..])
}

/// A list of the file; empty where it is absent.
pub fn list<'a>(json: &'a Value, name: &str) -> &'a [Value] {
    json[name].as_array().map_or(&[], Vec::as_slice)
}

/// An index or a size; 0 where glTF's default is 0.
pub fn size(value: &Value) -> usize {
    value.as_u64().unwrap_or(0) as usize
}

impl Parsed {
    /// All components of all elements, normalised integers decoded, sparse values put in.
    pub fn read(&self, accessor: usize) -> Vec<Vec<f64>> {
        let accessor = &self.json["accessors"][accessor];
        let (component, width) = (size(&accessor["componentType"]), width(accessor));
        let normalized = accessor["normalized"].as_bool().unwrap_or(false);
        let mut rows = self.read_view(
            accessor,
            component,
            width,
            size(&accessor["count"]),
            normalized,
        );
        if let Some(sparse) = accessor.get("sparse") {
            let count = size(&sparse["count"]);
            let indices = self.read_view(
                &sparse["indices"],
                size(&sparse["indices"]["componentType"]),
                1,
                count,
                false,
            );
            let values = self.read_view(&sparse["values"], component, width, count, normalized);
            assert!(
                indices.windows(2).all(|pair| pair[0][0] < pair[1][0]),
                "{}: sparse indices must rise",
                self.name
            );
            for (index, value) in indices.into_iter().zip(values) {
                rows[index[0] as usize] = value;
            }
        }
        rows
    }

    /// Panics where anything lies outside its view, or the view outside the buffer, or is not aligned.
    fn read_view(
        &self,
        place: &Value,
        component: usize,
        width: usize,
        count: usize,
        normalized: bool,
    ) -> Vec<Vec<f64>> {
        let view = &self.json["bufferViews"][size(&place["bufferView"])];
        let (start, length) = (size(&view["byteOffset"]), size(&view["byteLength"]));
        let bytes = &self.buffer[start..start + length];
        let offset = size(&place["byteOffset"]);
        let bytes_each = component_size(component);
        let stride = view["byteStride"]
            .as_u64()
            .map_or(bytes_each * width, |stride| stride as usize);
        assert_eq!(
            (start % 4, offset % bytes_each, stride % bytes_each),
            (0, 0, 0),
            "{}: alignment",
            self.name
        );
        (0..count)
            .map(|row| {
                (0..width)
                    .map(|i| {
                        decode(
                            &bytes[offset + row * stride + i * bytes_each..],
                            component,
                            normalized,
                        )
                    })
                    .collect()
            })
            .collect()
    }
}

/// Components of an element.
pub fn width(accessor: &Value) -> usize {
    match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        other => panic!("unexpected accessor type {other}"),
    }
}

fn component_size(component: usize) -> usize {
    match component {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        other => panic!("unexpected component type {other}"),
    }
}

fn decode(bytes: &[u8], component: usize, normalized: bool) -> f64 {
    let (value, limit) = match component {
        5120 => (f64::from(bytes[0] as i8), 127.0),
        5121 => (f64::from(bytes[0]), 255.0),
        5122 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        5123 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        5125 => (
            f64::from(u32::from_le_bytes(bytes[..4].try_into().unwrap())),
            1.0,
        ),
        _ => (
            f64::from(f32::from_le_bytes(bytes[..4].try_into().unwrap())),
            1.0,
        ),
    };
    if normalized {
        (value / limit).max(-1.0)
    } else {
        value
    }
}
