//! The JSON of a file: parsed, its cross references checked, its arrays read into the `gltf` crate's types.
//!
//! The crate lets indices out of range through and panics on some of them, so every index is checked on the JSON before the
//! crate's types see it. Nodes, cameras and lights stay JSON: the crate would round their numbers to f32.

use gltf::json;
use serde::Deserialize;
use serde_json::Value;

use super::error::{Fault, Outcome};

/// Every index in a file that we follow, and the array that it points into. `[]`: each element, `*`: each member.
const REFERENCES: &[(&str, &str)] = &[
    ("scene", "scenes"),
    ("scenes[].nodes[]", "nodes"),
    ("nodes[].children[]", "nodes"),
    ("nodes[].mesh", "meshes"),
    ("nodes[].camera", "cameras"),
    ("nodes[].skin", "skins"),
    ("meshes[].primitives[].attributes.*", "accessors"),
    ("meshes[].primitives[].indices", "accessors"),
    ("meshes[].primitives[].material", "materials"),
    ("accessors[].bufferView", "bufferViews"),
    ("accessors[].sparse.indices.bufferView", "bufferViews"),
    ("accessors[].sparse.values.bufferView", "bufferViews"),
    ("bufferViews[].buffer", "buffers"),
    ("images[].bufferView", "bufferViews"),
    ("textures[].sampler", "samplers"),
    ("textures[].source", "images"),
    (
        "materials[].pbrMetallicRoughness.baseColorTexture.index",
        "textures",
    ),
    (
        "materials[].pbrMetallicRoughness.metallicRoughnessTexture.index",
        "textures",
    ),
    ("materials[].normalTexture.index", "textures"),
    ("materials[].occlusionTexture.index", "textures"),
    ("materials[].emissiveTexture.index", "textures"),
    (
        "materials[].extensions.KHR_materials_transmission.transmissionTexture.index",
        "textures",
    ),
    (
        "materials[].extensions.KHR_materials_volume.thicknessTexture.index",
        "textures",
    ),
    (
        "materials[].extensions.KHR_materials_specular.specularTexture.index",
        "textures",
    ),
    (
        "materials[].extensions.KHR_materials_specular.specularColorTexture.index",
        "textures",
    ),
];

/// The arrays of a file that we read or point into.
const ARRAYS: &[&str] = &[
    "accessors",
    "animations",
    "bufferViews",
    "buffers",
    "cameras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scenes",
    "skins",
    "textures",
];

/// A file's JSON. All indices named in [`REFERENCES`] are in range.
pub(super) struct Document {
    json: Value,
    pub(super) accessors: Vec<json::Accessor>,
    pub(super) buffer_views: Vec<json::buffer::View>,
    pub(super) buffers: Vec<json::Buffer>,
    pub(super) images: Vec<json::Image>,
    pub(super) materials: Vec<json::Material>,
    pub(super) meshes: Vec<json::Mesh>,
    pub(super) samplers: Vec<json::texture::Sampler>,
    pub(super) textures: Vec<json::Texture>,
}

impl Document {
    pub(super) fn parse(text: &[u8]) -> Outcome<Self> {
        let json: Value =
            serde_json::from_slice(text).map_err(|error| Fault::invalid("JSON", error))?;
        check_arrays(&json)?;
        for (pattern, target) in REFERENCES {
            let length = elements(&json, target).len() as u64;
            let steps: Vec<&str> = pattern.split('.').collect();
            check_references(
                &json,
                &steps,
                String::new(),
                &mut |value, place| match value.as_u64() {
                    Some(index) if index < length => Ok(()),
                    Some(index) => Err(Fault::invalid(
                        place,
                        format!("{target}[{index}] is not there, there are {length}"),
                    )),
                    None => Err(Fault::invalid(place, format!("not an index into {target}"))),
                },
            )?;
        }
        Ok(Self {
            accessors: typed(&json, "accessors")?,
            buffer_views: typed(&json, "bufferViews")?,
            buffers: typed(&json, "buffers")?,
            images: typed(&json, "images")?,
            materials: typed(&json, "materials")?,
            meshes: typed(&json, "meshes")?,
            samplers: typed(&json, "samplers")?,
            textures: typed(&json, "textures")?,
            json,
        })
    }

    pub(super) fn json(&self) -> &Value {
        &self.json
    }

    /// The elements of a top-level array; none if the file lacks it.
    pub(super) fn elements(&self, array: &str) -> &[Value] {
        elements(&self.json, array)
    }

    /// The file's name for an element, if it has one that is not empty.
    pub(super) fn name(&self, array: &str, index: usize) -> Option<&str> {
        self.elements(array)
            .get(index)?
            .get("name")?
            .as_str()
            .filter(|name| !name.is_empty())
    }

    /// For messages and scene objects without a name of their own: "node 7".
    pub(super) fn number(&self, array: &str, index: usize) -> String {
        let singular = if array == "meshes" {
            "mesh"
        } else {
            array.strip_suffix('s').unwrap_or(array)
        };
        format!("{singular} {index}")
    }

    /// For messages: "node 7 'wheel'".
    pub(super) fn place(&self, array: &str, index: usize) -> String {
        let number = self.number(array, index);
        self.name(array, index)
            .map_or_else(|| number.clone(), |name| format!("{number} '{name}'"))
    }
}

fn elements<'a>(json: &'a Value, array: &str) -> &'a [Value] {
    json.get(array)
        .and_then(Value::as_array)
        .map_or(&[], Vec::as_slice)
}

fn check_arrays(json: &Value) -> Outcome<()> {
    if !json.is_object() {
        return Err(Fault::invalid("JSON", "not an object"));
    }
    for &array in ARRAYS {
        match json.get(array) {
            None => {}
            Some(Value::Array(elements)) => {
                if let Some(index) = elements.iter().position(|element| !element.is_object()) {
                    return Err(Fault::invalid(format!("{array}[{index}]"), "not an object"));
                }
            }
            Some(_) => return Err(Fault::invalid(array, "not a list")),
        }
    }
    Ok(())
}

/// Calls `check` with each value that `steps` lead to. What is absent, or of another shape, is not our concern here.
fn check_references(
    value: &Value,
    steps: &[&str],
    place: String,
    check: &mut impl FnMut(&Value, &str) -> Outcome<()>,
) -> Outcome<()> {
    let Some((&step, rest)) = steps.split_first() else {
        return check(value, &place);
    };
    let field = |name: &str| {
        if place.is_empty() {
            name.to_owned()
        } else {
            format!("{place}.{name}")
        }
    };
    if step == "*" {
        for (name, member) in value.as_object().into_iter().flatten() {
            check_references(member, rest, field(name), check)?;
        }
    } else if let Some(name) = step.strip_suffix("[]") {
        for (index, element) in elements(value, name).iter().enumerate() {
            check_references(element, rest, format!("{}[{index}]", field(name)), check)?;
        }
    } else if let Some(member) = value.get(step).filter(|member| !member.is_null()) {
        check_references(member, rest, field(step), check)?;
    }
    Ok(())
}

fn typed<'a, T: Deserialize<'a>>(json: &'a Value, array: &str) -> Outcome<Vec<T>> {
    elements(json, array)
        .iter()
        .enumerate()
        .map(|(index, element)| {
            T::deserialize(element)
                .map_err(|error| Fault::invalid(format!("{array}[{index}]"), error))
        })
        .collect()
}

/// A number of a JSON object, if it is there. JSON has no infinities, but an exponent may overflow.
pub(super) fn number(object: &Value, field: &str, place: &str) -> Outcome<Option<f64>> {
    match object.get(field) {
        None => Ok(None),
        Some(json) => match json.as_f64() {
            Some(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(Fault::invalid(
                place,
                format!("{field} is not a finite number"),
            )),
        },
    }
}

/// `N` numbers of a JSON object, if they are there.
pub(super) fn numbers<const N: usize>(
    object: &Value,
    field: &str,
    place: &str,
) -> Outcome<Option<[f64; N]>> {
    let Some(json) = object.get(field) else {
        return Ok(None);
    };
    json.as_array()
        .and_then(|list| list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>())
        .filter(|numbers| numbers.iter().all(|number| number.is_finite()))
        .and_then(|numbers| numbers.try_into().ok())
        .map(Some)
        .ok_or_else(|| {
            Fault::invalid(
                place,
                format!("{field} is not a list of {N} finite numbers"),
            )
        })
}

/// An index that is known to be in range, if it is there.
pub(super) fn index(object: &Value, field: &str) -> Option<usize> {
    object.get(field)?.as_u64()?.try_into().ok()
}
