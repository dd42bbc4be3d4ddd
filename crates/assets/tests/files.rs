//! The scenes, read back: valid glTF as far as our own rules go, and solids that are closed.

mod support;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use support::{Parsed, list, scenes, size, width};

#[test]
fn accessors_lie_within_the_buffer_and_tell_their_bounds() {
    for scene in scenes() {
        for (index, accessor) in list(&scene.json, "accessors").iter().enumerate() {
            let rows = scene.read(index);
            assert!(
                !rows.is_empty() && rows.iter().flatten().all(|x| x.is_finite()),
                "{} accessor {index}",
                scene.name
            );
            if accessor.get("min").is_some() {
                for i in 0..width(accessor) {
                    let limit = |name: &str| f64::from(accessor[name][i].as_f64().unwrap() as f32);
                    let column = rows.iter().map(|row| row[i]);
                    // Bounds of normalised integers speak of the integers.
                    let unit = if accessor["normalized"] == true {
                        32767.0
                    } else {
                        1.0
                    };
                    let (min, max) = (
                        column.clone().fold(f64::MAX, f64::min),
                        column.fold(f64::MIN, f64::max),
                    );
                    assert!(
                        (min * unit - limit("min")).abs() < 1e-9
                            && (max * unit - limit("max")).abs() < 1e-9
                    );
                }
            }
        }
    }
}

#[test]
fn primitives_have_what_they_need() {
    for scene in scenes() {
        for primitive in primitives(&scene) {
            let attributes = primitive["attributes"].as_object().unwrap();
            let lengths: BTreeMap<&str, usize> = attributes
                .iter()
                .map(|(name, index)| (name.as_str(), scene.read(size(index)).len()))
                .collect();
            let count = lengths["POSITION"];
            assert!(
                lengths.values().all(|&length| length == count),
                "{}: {lengths:?}",
                scene.name
            );
            assert!(scene.json["accessors"][size(&attributes["POSITION"])]["min"].is_array());
            let normals = scene.read(size(&attributes["NORMAL"]));
            // Eight bits leave a normal that much short of 1.
            assert!(
                normals
                    .iter()
                    .all(|n| (n.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() < 0.01)
            );
            let indices = scene.read(size(&primitive["indices"]));
            assert!(
                indices.len().is_multiple_of(3) && indices.iter().all(|i| (i[0] as usize) < count)
            );

            let material = &scene.json["materials"][size(&primitive["material"])];
            for set in uv_sets(material) {
                assert!(
                    attributes.contains_key(&format!("TEXCOORD_{set}")),
                    "{}: {}",
                    scene.name,
                    material["name"]
                );
            }
        }
    }
}

#[test]
fn indices_into_lists_exist_and_every_node_has_at_most_one_parent() {
    for Parsed { name, json, .. } in scenes() {
        let within =
            |value: &Value, of: &str| value.is_null() || size(value) < list(&json, of).len();
        let mut parents = BTreeMap::new();
        for node in list(&json, "nodes") {
            assert!(
                within(&node["mesh"], "meshes") && within(&node["camera"], "cameras"),
                "{name}: {node}"
            );
            for child in list(node, "children") {
                *parents.entry(size(child)).or_insert(0) += 1;
            }
        }
        for root in list(&json["scenes"][0], "nodes") {
            *parents.entry(size(root)).or_insert(0) += 1;
        }
        assert_eq!(
            parents.len(),
            list(&json, "nodes").len(),
            "{name}: every node is reached"
        );
        assert!(parents.values().all(|&count| count == 1), "{name}");
        for texture in list(&json, "textures") {
            assert!(
                within(&texture["source"], "images") && within(&texture["sampler"], "samplers"),
                "{name}"
            );
        }
        for mesh in list(&json, "meshes")
            .iter()
            .flat_map(|mesh| list(mesh, "primitives"))
        {
            assert!(within(&mesh["material"], "materials"), "{name}");
        }
    }
}

#[test]
fn extensions_are_declared() {
    for scene in scenes() {
        let mut found = BTreeSet::new();
        collect_extensions(&scene.json, &mut found);
        found.extend(
            list(&scene.json, "extensionsRequired")
                .iter()
                .map(|name| name.as_str().unwrap().to_owned()),
        );
        let used: BTreeSet<String> = list(&scene.json, "extensionsUsed")
            .iter()
            .map(|name| name.as_str().unwrap().to_owned())
            .collect();
        assert_eq!(found, used, "{}", scene.name);
    }
}

#[test]
fn every_scene_has_a_camera_and_lights() {
    for Parsed { name, json, .. } in scenes() {
        let node = list(&json, "nodes")
            .iter()
            .find(|node| node["name"] == "Camera")
            .unwrap();
        let camera = &list(&json, "cameras")[size(&node["camera"])];
        assert!(
            (camera["perspective"]["aspectRatio"].as_f64().unwrap() - 4.0 / 3.0).abs() < 1e-12,
            "{name}"
        );
        assert!(
            !list(&json["extensions"]["KHR_lights_punctual"], "lights").is_empty(),
            "{name}"
        );
    }
}

#[test]
fn pictures_decode() {
    for scene in scenes() {
        for bytes in &scene.images {
            let picture = image::load_from_memory(bytes).unwrap();
            assert!(
                picture.width() > 0 && picture.width() <= 256,
                "{}",
                scene.name
            );
        }
    }
}

#[test]
fn declared_solids_are_watertight_and_face_their_side() {
    let mut solids = 0;
    for scene in scenes() {
        for mesh in list(&scene.json, "meshes") {
            let Some(side) = mesh["extras"]["closed"].as_str() else {
                continue;
            };
            solids += 1;
            let triangles = triangles(&scene, mesh);
            assert_eq!(
                unmatched_edges(&triangles),
                0,
                "{}: {}",
                scene.name,
                mesh["name"]
            );
            let volume = volume(&triangles);
            let right = if side == "outward" {
                volume > 0.0
            } else {
                volume < 0.0
            };
            assert!(
                right,
                "{}: {} is to face {side}, volume {volume}",
                scene.name, mesh["name"]
            );
        }
    }
    assert!(solids > 20);
}

#[test]
fn what_refracts_is_a_declared_solid() {
    for scene in scenes() {
        for mesh in list(&scene.json, "meshes") {
            let material = &scene.json["materials"][size(&mesh["primitives"][0]["material"])];
            if material["extensions"]["KHR_materials_volume"].is_object() {
                assert!(
                    mesh["extras"]["closed"].is_string(),
                    "{}: {}",
                    scene.name,
                    mesh["name"]
                );
            }
        }
    }
}

#[test]
fn a_hole_and_a_turned_triangle_are_noticed() {
    let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut tetrahedron = vec![[a, c, b], [a, b, d], [b, c, d], [a, d, c]];
    assert_eq!(unmatched_edges(&tetrahedron), 0);
    assert!(volume(&tetrahedron) > 0.0);
    tetrahedron[0].swap(1, 2);
    assert!(unmatched_edges(&tetrahedron) > 0);
    tetrahedron.remove(0);
    assert_eq!(unmatched_edges(&tetrahedron), 3);
}

type Triangle = [[f64; 3]; 3];

fn triangles(scene: &Parsed, mesh: &Value) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for primitive in list(mesh, "primitives") {
        let positions = scene.read(size(&primitive["attributes"]["POSITION"]));
        let indices = scene.read(size(&primitive["indices"]));
        let corner =
            |i: &Vec<f64>| <[f64; 3]>::try_from(positions[i[0] as usize].as_slice()).unwrap();
        triangles.extend(
            indices
                .chunks(3)
                .map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]),
        );
    }
    triangles
}

/// Edges (by position) that are not run along once in each direction.
fn unmatched_edges(triangles: &[Triangle]) -> usize {
    let place = |p: [f64; 3]| p.map(|x| (x + 0.0).to_bits());
    let mut runs: BTreeMap<_, [u32; 2]> = BTreeMap::new();
    for t in triangles {
        for i in 0..3 {
            let (from, to) = (place(t[i]), place(t[(i + 1) % 3]));
            assert_ne!(from, to, "a triangle without area");
            let entry = runs.entry((from.min(to), from.max(to))).or_default();
            entry[usize::from(from > to)] += 1;
        }
    }
    runs.values().filter(|&&run| run != [1, 1]).count()
}

fn volume(triangles: &[Triangle]) -> f64 {
    let determinant = |[a, b, c]: &Triangle| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    triangles.iter().map(determinant).sum::<f64>() / 6.0
}

fn primitives(scene: &Parsed) -> impl Iterator<Item = &Value> {
    list(&scene.json, "meshes")
        .iter()
        .flat_map(|mesh| list(mesh, "primitives"))
}

/// The uv sets that a material's textures read.
fn uv_sets(value: &Value) -> BTreeSet<usize> {
    match value {
        Value::Object(object) => object
            .iter()
            .flat_map(|(key, child)| {
                let here = key.ends_with("Texture").then(|| size(&child["texCoord"]));
                uv_sets(child).into_iter().chain(here)
            })
            .collect(),
        _ => BTreeSet::new(),
    }
}

fn collect_extensions(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            if let Some(Value::Object(extensions)) = object.get("extensions") {
                found.extend(extensions.keys().cloned());
            }
            object
                .values()
                .for_each(|child| collect_extensions(child, found));
        }
        Value::Array(list) => list
            .iter()
            .for_each(|child| collect_extensions(child, found)),
        _ => {}
    }
}
