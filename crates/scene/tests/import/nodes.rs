//! Scenes, node hierarchies, transforms.

use glam::{DVec3, Vec3, Vec4};
use serde_json::json;

use crate::builder::*;

#[test]
fn transforms_compose_from_the_root_down() {
    let mut file = Gltf::triangle();
    let turn = std::f64::consts::FRAC_1_SQRT_2;
    // A quarter turn about z after doubling, then a matrix that moves by (10, 0, 0), column-major.
    file.json["nodes"][0] = json!({ "mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, turn, turn], "translation": [0, 0, 1] });
    file.push(
        "nodes",
        json!({ "children": [0], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 10,0,0,1] }),
    );
    let corners = world_corners(&file.import(), 0);
    let expected = [
        DVec3::new(10.0, 0.0, 1.0),
        DVec3::new(10.0, 2.0, 1.0),
        DVec3::new(8.0, 0.0, 1.0),
    ];
    for (corner, expected) in corners.into_iter().zip(expected) {
        assert!(
            (corner - expected).length() < 1e-6,
            "{corner} is not {expected}"
        );
    }
}

#[test]
fn a_scene_far_from_the_origin_keeps_its_shape() {
    let mut file = Gltf::triangle();
    // In single precision these would be whole multiples of a half.
    file.json["nodes"][0]["translation"] = json!([6_378_137.062_5, -1e7, 0.0]);
    let scene = file.import();
    let middle = DVec3::new(6_378_137.562_5, -9_999_999.5, 0.0);
    assert_eq!(scene.frame.origin, middle.into());
    assert_eq!(
        scene.geometry.positions,
        Gltf::triangle().import().geometry.positions
    );
}

#[test]
fn the_default_scene_else_the_first_else_all_roots() {
    let mut file = Gltf::triangle();
    for x in [10.0, 20.0] {
        file.push(
            "nodes",
            json!({ "mesh": 0, "translation": [x, 0, 0], "name": format!("at {x}") }),
        );
    }
    assert_eq!(file.import().nodes, ["node 0", "at 10", "at 20"]);
    file.json["scenes"] = json!([{ "nodes": [1] }, { "nodes": [2, 0] }]);
    assert_eq!(file.import().nodes, ["at 10"]);
    file.json["scene"] = json!(1);
    // In the order of the file's nodes, not of the scene's list.
    let scene = file.import();
    assert_eq!(scene.nodes, ["node 0", "at 20"]);
    assert_eq!(scene.geometry.triangles[1].node, 1);
    assert_eq!(scene.frame.origin.rounded().x, 10.5);
}

#[test]
fn a_mesh_may_be_shown_often() {
    let mut file = Gltf::triangle();
    file.push("nodes", json!({ "mesh": 0, "translation": [0, 0, 1] }));
    let triangles = world_triangles(&file.import());
    assert_eq!(triangles.len(), 2);
    assert_eq!(triangles[1], triangles[0].map(|[x, y, _]| [x, y, 1.0]));
}

/// The triangle with tangents, shown by a node with `transform`.
fn transformed(transform: serde_json::Value) -> Gltf {
    let mut file = Gltf::with_material(json!({ "normalTexture": { "index": 0 } }));
    crate::materials::add_texture(&mut file);
    let normals = file.floats(&[[0.6, 0.0, 0.8]; 3]);
    let tangents = file.floats(&[[0.8, 0.0, -0.6, 1.0]; 3]);
    let uvs = file.floats(&[[0.0, 0.0]; 3]);
    let attributes = &mut file.primitive()["attributes"];
    attributes["NORMAL"] = json!(normals);
    attributes["TANGENT"] = json!(tangents);
    attributes["TEXCOORD_0"] = json!(uvs);
    file.json["nodes"][0]["scale"] = transform;
    file
}

#[test]
fn mirroring_swaps_the_winding_and_the_bitangents_side() {
    let scene = transformed(json!([-1, 1, 1])).import();
    // Still counter-clockwise seen from +z.
    assert_eq!(
        world_triangles(&scene),
        [[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]]
    );
    assert_close(scene.geometry.normals[0], Vec3::new(-0.6, 0.0, 0.8));
    assert_eq!(scene.geometry.tangents[0].w, -1.0);
    assert_close(
        scene.geometry.tangents[0].truncate(),
        Vec3::new(-0.8, 0.0, -0.6),
    );
    // The bitangent was cross(n, t) = +y, which the mirror leaves alone.
    let bitangent = -scene.geometry.normals[0].cross(scene.geometry.tangents[0].truncate());
    assert_close(bitangent, Vec3::Y);
}

#[test]
fn a_mirrored_flat_triangle_faces_where_it_did() {
    let mut file = Gltf::triangle();
    file.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    assert_eq!(file.import().geometry.normals, [Vec3::Z; 3]);
    file.json["nodes"][0]["scale"] = json!([1, 1, -1]);
    assert_eq!(file.import().geometry.normals, [Vec3::NEG_Z; 3]);
    file.json["nodes"][0]["scale"] = json!([-1, -1, -1]);
    assert_eq!(file.import().geometry.normals, [Vec3::NEG_Z; 3]);
}

#[test]
fn normals_follow_the_inverse_transpose_and_tangents_the_matrix() {
    let scene = transformed(json!([2, 1, 1])).import();
    // (0.6/2, 0, 0.8) = (3, 0, 8)/10; (0.8 * 2, 0, -0.6) = (8, 0, -3)/5.
    let length = 73.0_f32.sqrt();
    assert_close(scene.geometry.normals[0], Vec3::new(3.0, 0.0, 8.0) / length);
    assert_close(
        scene.geometry.tangents[0].truncate(),
        Vec3::new(8.0, 0.0, -3.0) / length,
    );
    assert_eq!(scene.geometry.tangents[0].w, 1.0);
}

#[test]
fn tiny_and_huge_scales_leave_normals_right() {
    for scale in [1e-12, 1e12] {
        let scene = transformed(json!([2.0 * scale, scale, scale])).import();
        assert_close(
            scene.geometry.normals[0],
            Vec3::new(3.0, 0.0, 8.0) / 73.0_f32.sqrt(),
        );
        assert_eq!(scene.geometry.triangles.len(), 1);
    }
}

#[test]
fn a_scale_of_zero_drops_the_triangles() {
    let mut file = transformed(json!([0, 0, 0]));
    let scene = file.import();
    assert!(scene.geometry.triangles.is_empty() && scene.geometry.positions.is_empty());
    assert_eq!(scene.frame, Default::default());
    // Beside others it does not count for the frame either.
    file.json["nodes"][0]["translation"] = json!([1000, 0, 0]);
    file.push("nodes", json!({ "mesh": 0 }));
    let scene = file.import();
    assert_eq!(scene.geometry.triangles.len(), 1);
    assert_eq!(scene.frame.origin, DVec3::new(0.5, 0.5, 0.0).into());
    assert_eq!(
        warnings(&scene),
        ["meshes: 1 triangles have no area and are left out"]
    );
}

#[test]
fn a_flattened_mesh_keeps_what_still_has_area() {
    // Flattened onto its own plane the triangle stays; its normal becomes that of the plane.
    let scene = transformed(json!([1, 1, 0])).import();
    assert_eq!(scene.geometry.triangles.len(), 1);
    assert_eq!(scene.geometry.normals, [Vec3::Z; 3]);
    // Onto a line it has no area.
    assert!(
        transformed(json!([1, 0, 1]))
            .import()
            .geometry
            .triangles
            .is_empty()
    );
}

#[test]
fn deep_chains_do_not_overflow_the_stack() {
    const DEPTH: usize = 100_000;
    let mut file = Gltf::triangle();
    for child in 0..DEPTH {
        file.push(
            "nodes",
            json!({ "children": [child], "translation": [0.5, 0, 0] }),
        );
    }
    let scene = file.import();
    assert_eq!(world_corners(&scene, 0)[0].x, DEPTH as f64 * 0.5);
}

#[test]
fn quaternions_are_normalised() {
    let mut file = Gltf::triangle();
    file.json["nodes"][0]["rotation"] = json!([0, 0, 3, 3]);
    let corners = world_corners(&file.import(), 0);
    assert!((corners[1] - DVec3::Y).length() < 1e-6 && (corners[2] + DVec3::X).length() < 1e-6);
    file.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
    assert!(file.error().contains("node 0: its rotation"));
}

#[test]
fn unused_tangents_are_neutral() {
    let mut file = transformed(json!([1, 1, 1]));
    file.show(json!({ "attributes": { "POSITION": 0 } }));
    let tangents = file.import().geometry.tangents;
    assert_eq!(tangents[3..], [Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
}
