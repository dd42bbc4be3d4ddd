//! Which nodes share their mesh, and that a shared mesh is seen where copies of it would be.

use raytree_scene::import::{ImportOptions, Sharing, import_with};
use raytree_scene::instances::WhyCopied;
use raytree_scene::model::Scene;
use serde_json::{Value, json};

use super::builder::{Folder, Gltf};

/// A pyramid with a base, of vertices that share normals, tangents and colours, so that all is there that a place may change; a
/// normal map reads its tangents.
fn pyramid() -> Gltf {
    let mut file = Gltf::empty();
    let corners = [
        [-1.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [1.0, 0.0, 1.5],
        [-1.0, 0.0, 1.0],
        [0.2, 2.0, 0.1],
    ];
    let positions = file.floats(&corners);
    let normals = file.floats(&[
        [-0.6, 0.0, -0.8],
        [0.8, 0.0, -0.6],
        [0.6, 0.8, 0.0],
        [0.0, 0.6, 0.8],
        [0.0, 1.0, 0.0],
    ]);
    let tangents = file.floats(&[
        [0.8, 0.0, -0.6, 1.0],
        [0.6, 0.0, 0.8, -1.0],
        [0.0, 0.0, 1.0, 1.0],
        [1.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, -1.0],
    ]);
    let uvs = file.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]]);
    let indices = file.indices(&[0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0, 0, 1, 2, 0, 2, 3]);
    let image = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGNoaPgPAAODAgAApfuJAAAAAElFTkSuQmCC";
    file.push("images", json!({ "uri": image }));
    file.push("textures", json!({ "source": 0 }));
    file.push("materials", json!({ "normalTexture": { "index": 0 } }));
    file.push(
        "meshes",
        json!({ "name": "pyramid", "primitives": [{
            "attributes": { "POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs },
            "indices": indices,
            "material": 0,
        }] }),
    );
    file
}

fn shown(mut file: Gltf, nodes: &[Value]) -> Gltf {
    for node in nodes {
        let mut node = node.clone();
        node["mesh"] = json!(0);
        file.push("nodes", node);
    }
    file
}

fn import(file: &Gltf, sharing: Sharing) -> Scene {
    let folder = Folder::new();
    folder.write("scene.glb", &file.glb());
    let options = ImportOptions {
        sharing,
        ..ImportOptions::default()
    };
    import_with(&folder.0.join("scene.glb"), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Turned, stretched, sheared, mirrored, far away, tiny.
fn places() -> Vec<Value> {
    vec![
        json!({ "name": "plain" }),
        json!({ "rotation": [0.1, 0.7, -0.2, 0.6], "translation": [5, 1, -2], "scale": [2, 2, 2] }),
        json!({ "scale": [1, 3, 0.5], "translation": [-4, 0, 0] }),
        json!({ "scale": [-1, 1, 1], "rotation": [0.3, 0.1, 0.2, 0.9], "translation": [0, 0, 9] }),
        json!({ "matrix": [1, 0.4, 0, 0, 0.3, 1, 0, 0, 0, -0.6, 1.2, 0, 2, 7, 3, 1] }),
        json!({ "scale": [-2, -3, -1], "translation": [1e3, 20, 3] }),
        json!({ "scale": [1e-4, 1e-4, 1e-4], "translation": [3, 3, 3] }),
    ]
}

/// Every list of the shared scene's copy is that of the scene with copies; positions and directions but for rounding.
#[test]
fn shared_meshes_are_seen_where_copies_are() {
    let file = shown(pyramid(), &places());
    let shared = import(&file, Sharing::Always);
    let expected = import(&file, Sharing::Never);
    assert_eq!((shared.meshes.len(), shared.instances.len()), (1, 7));
    assert_eq!(shared.geometry.triangles.len(), 6, "once");
    assert_eq!(expected.geometry.triangles.len(), 7 * 6);
    assert_eq!(shared.frame, expected.frame);
    assert_eq!(shared.nodes, expected.nodes);
    let copied = shared.copied();
    let (found, expected) = (&copied.geometry, &expected.geometry);
    assert_eq!(found.triangles, expected.triangles);
    assert_eq!(found.uv_sets, expected.uv_sets);
    for (a, b) in found.positions.iter().zip(&expected.positions) {
        assert!(
            a.distance(*b) <= 1.5e-7 * b.length().max(1e-3),
            "{a}, not {b}"
        );
    }
    for (a, b) in found.normals.iter().zip(&expected.normals) {
        assert!(a.distance(*b) < 1e-6, "{a}, not {b}");
    }
    assert_eq!(found.tangents.len(), 35);
    for (a, b) in found.tangents.iter().zip(&expected.tangents) {
        assert!(a.distance(*b) < 1e-6, "{a}, not {b}");
    }
    let (low, high) = shared.bounds().unwrap();
    let (min, max) = expected.bounds().unwrap();
    assert!(low.distance(min) < 1e-6 && high.distance(max) < 1e-6);
}

#[test]
fn what_a_node_flattens_or_stretches_too_far_is_copied() {
    let mut nodes = places();
    nodes.push(json!({ "scale": [1, 0, 1], "translation": [20, 0, 0] }));
    nodes.push(json!({ "scale": [1, 1, 20], "translation": [0, 0, 60] }));
    let scene = import(&shown(pyramid(), &nodes), Sharing::Always);
    assert_eq!((scene.instances.len(), scene.own_triangles()), (7, 12));
    assert_eq!(scene.placed_triangles(), 12 + 7 * 6);
    let repeated = &scene.repeated[0];
    assert_eq!((repeated.nodes, repeated.sharing), (9, 7));
    assert_eq!(repeated.copied, Some(WhyCopied::Placement));
    assert_eq!(repeated.name, "pyramid");
    // The copies belong to their own nodes.
    assert_eq!(scene.geometry.triangles[0].node, 7);
    assert_eq!(scene.instances[6].node, 6);
}

#[test]
fn what_is_seen_through_is_copied() {
    for (material, shared) in [
        (json!({}), true),
        (json!({ "alphaMode": "BLEND" }), false),
        (json!({ "alphaMode": "MASK" }), false),
        (
            json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 } } }),
            false,
        ),
        (
            json!({ "extras": { "whitted": { "kt": [0.1, 0, 0] } } }),
            false,
        ),
    ] {
        let mut file = shown(pyramid(), &places());
        file.json["materials"][0] = material.clone();
        file.json["extensionsUsed"] = json!(["KHR_materials_transmission"]);
        let scene = import(&file, Sharing::Always);
        assert_eq!(!scene.instances.is_empty(), shared, "{material}");
        let why = (!shared).then_some(WhyCopied::SeenThrough);
        assert_eq!(scene.repeated[0].copied, why, "{material}");
    }
}

/// Few triangles are copied unless sharing is asked for, and never where it is not.
#[test]
fn small_meshes_are_copied() {
    let file = shown(pyramid(), &places());
    for (sharing, why) in [
        (Sharing::WhereItPays, Some(WhyCopied::Small)),
        (Sharing::Never, Some(WhyCopied::Asked)),
        (Sharing::Always, None),
    ] {
        let scene = import(&file, sharing);
        assert_eq!(scene.repeated[0].copied, why);
        assert_eq!(scene.instances.is_empty(), why.is_some());
    }
    let once = shown(pyramid(), &places()[..1]);
    assert!(import(&once, Sharing::Always).repeated.is_empty());
}

/// What is stored counts against the limit, not what is seen.
#[test]
fn the_limit_is_of_what_is_stored() {
    let file = shown(pyramid(), &places());
    let folder = Folder::new();
    folder.write("scene.glb", &file.glb());
    let import = |sharing, max_triangles| {
        let options = ImportOptions {
            sharing,
            max_triangles,
            ..ImportOptions::default()
        };
        import_with(&folder.0.join("scene.glb"), &options)
    };
    assert!(import(Sharing::Always, 7).is_ok());
    assert!(import(Sharing::Never, 42).is_ok());
    for (sharing, limit) in [
        (Sharing::Always, 5),
        (Sharing::Never, 41),
        (Sharing::WhereItPays, 41),
    ] {
        let error = import(sharing, limit).unwrap_err().to_string();
        assert!(
            error.contains(&format!("more than {limit} triangles")),
            "{error}"
        );
    }
}
