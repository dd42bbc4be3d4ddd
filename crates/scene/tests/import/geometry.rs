//! Accessors, primitives, vertex attributes.

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::json;

use crate::builder::*;

/// Five points of a zigzag; as a strip three triangles, all counter-clockwise seen from +z.
const ZIGZAG: [[f32; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 2.0, 0.0],
];

fn corners(of: [usize; 3], points: &[[f32; 3]]) -> [[f64; 3]; 3] {
    of.map(|point| points[point].map(f64::from))
}

fn zigzag(mode: u32) -> Gltf {
    let mut file = Gltf::empty();
    let positions = file.floats(&ZIGZAG);
    file.show(json!({ "mode": mode, "attributes": { "POSITION": positions } }));
    file
}

#[test]
fn a_bare_triangle_gets_all_defaults() {
    let scene = Gltf::triangle().import();
    assert_eq!(world_triangles(&scene), [corners([0, 1, 2], &TRIANGLE)]);
    assert_eq!(scene.geometry.normals, [Vec3::Z; 3]);
    assert!(
        scene.geometry.tangents.is_empty()
            && scene.geometry.uv_sets.is_empty()
            && scene.geometry.colors.is_empty()
    );
    assert_eq!(scene.materials, [raytree_scene::model::Material::default()]);
    assert_eq!(scene.nodes, ["node 0"]);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn scene_space_has_extent_one_around_its_origin() {
    let mut file = Gltf::empty();
    let positions = file.floats(&[[10.0, 20.0, 30.0], [13.0, 20.0, 30.0], [10.0, 21.0, 30.0]]);
    file.show(json!({ "attributes": { "POSITION": positions } }));
    let scene = file.import();
    assert_eq!(scene.frame.origin, DVec3::new(11.5, 20.5, 30.0).into());
    // The longest side is 3.
    assert_eq!(scene.frame.scale, 1.0 / 3.0);
    let sixth = 1.0 / 6.0;
    let expected = [
        Vec3::new(-0.5, -sixth, 0.0),
        Vec3::new(0.5, -sixth, 0.0),
        Vec3::new(-0.5, sixth, 0.0),
    ];
    assert_eq!(scene.geometry.positions, expected);
}

#[test]
fn strips_keep_every_second_triangle_in_order() {
    let scene = zigzag(5).import();
    let expected = [[0, 1, 2], [1, 3, 2], [2, 3, 4]].map(|of| corners(of, &ZIGZAG));
    assert_eq!(world_triangles(&scene), expected);
    assert!(
        scene
            .geometry
            .normals
            .iter()
            .all(|&normal| normal == Vec3::Z)
    );
}

#[test]
fn fans_turn_around_their_first_vertex() {
    let rim = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let mut file = Gltf::empty();
    let positions = file.floats(&rim);
    file.show(json!({ "mode": 6, "attributes": { "POSITION": positions } }));
    let scene = file.import();
    assert_eq!(
        world_triangles(&scene),
        [[1, 2, 0], [2, 3, 0]].map(|of| corners(of, &rim))
    );
    assert!(
        scene
            .geometry
            .normals
            .iter()
            .all(|&normal| normal == Vec3::Z)
    );
}

#[test]
fn points_and_lines_are_skipped_with_a_warning() {
    for mode in 0..4 {
        let scene = zigzag(mode).import();
        assert!(
            scene.geometry.triangles.is_empty()
                && scene.materials.is_empty()
                && scene.nodes.is_empty()
        );
        assert_eq!(scene.frame, Default::default());
        let kind = if mode == 0 { "points" } else { "lines" };
        assert_eq!(
            warnings(&scene),
            [
                format!("mesh 0, primitive 0: {kind} are not drawn"),
                "the scene: has no triangles".to_owned()
            ]
        );
    }
    assert!(zigzag(7).error().contains("mesh 0, primitive 0: its mode"));
}

#[test]
fn an_incomplete_last_triangle_is_left_out() {
    let scene = zigzag(4).import();
    assert_eq!(world_triangles(&scene), [corners([0, 1, 2], &ZIGZAG)]);
    assert!(warnings(&scene)[0].contains("only 2 vertices"));
}

#[test]
fn indices_of_every_width() {
    let order = [2_u8, 3, 4, 0, 1, 2];
    let wide: Vec<u8> = order
        .iter()
        .flat_map(|&index| u16::from(index).to_le_bytes())
        .collect();
    let widest: Vec<u8> = order
        .iter()
        .flat_map(|&index| u32::from(index).to_le_bytes())
        .collect();
    for (component, bytes) in [(U8, order.to_vec()), (U16, wide), (U32, widest)] {
        let mut file = zigzag(4);
        let indices = file.accessor(component, "SCALAR", 6, &bytes);
        file.primitive()["indices"] = json!(indices);
        let expected = [[2, 3, 4], [0, 1, 2]].map(|of| corners(of, &ZIGZAG));
        assert_eq!(
            world_triangles(&file.import()),
            expected,
            "component type {component}"
        );
    }
}

#[test]
fn shared_vertices_stay_shared_and_unused_ones_go() {
    let mut file = zigzag(4);
    let indices = file.indices(&[1, 3, 2, 2, 3, 4]);
    let normals = file.floats(&[[0.0, 0.0, 1.0]; 5]);
    file.primitive()["indices"] = json!(indices);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    let scene = file.import();
    assert_eq!(scene.geometry.positions.len(), 4);
    let order: Vec<_> = scene
        .geometry
        .triangles
        .iter()
        .map(|triangle| triangle.vertices)
        .collect();
    assert_eq!(order, [[0, 2, 1], [1, 2, 3]]);
    assert_eq!(
        world_triangles(&scene),
        [[1, 3, 2], [2, 3, 4]].map(|of| corners(of, &ZIGZAG))
    );
}

#[test]
fn unused_vertices_do_not_count_for_the_frame() {
    let mut file = Gltf::empty();
    let mut points = TRIANGLE.to_vec();
    points.push([1000.0, 0.0, 0.0]);
    let positions = file.floats(&points);
    let indices = file.indices(&[0, 1, 2, 0, 3, 3]);
    file.show(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let scene = file.import();
    assert_eq!(scene.frame.origin, DVec3::new(0.5, 0.5, 0.0).into());
    assert_eq!(
        warnings(&scene),
        ["meshes: 1 triangles have no area and are left out"]
    );
}

#[test]
fn missing_normals_are_flat_and_unshare_vertices() {
    // Two triangles at a right angle along the y axis.
    let points = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
    ];
    let mut file = Gltf::empty();
    let positions = file.floats(&points);
    let indices = file.indices(&[0, 1, 2, 0, 3, 1]);
    file.show(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let scene = file.import();
    assert_eq!(scene.geometry.positions.len(), 6);
    assert_eq!(
        world_triangles(&scene),
        [[0, 1, 2], [0, 3, 1]].map(|of| corners(of, &points))
    );
    let normals = &scene.geometry.normals;
    // (0,1,0) x (-1,0,0) = (0,0,1); (0,0,-1) x (0,1,0) = (1,0,0).
    assert_eq!(
        normals[..],
        [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::X, Vec3::X, Vec3::X]
    );
}

#[test]
fn a_zero_normal_becomes_the_triangles_own() {
    let mut file = Gltf::triangle();
    let normals = file.floats(&[[0.0, 0.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, 2.0]]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    let scene = file.import();
    assert_eq!(scene.geometry.normals[0], Vec3::Z);
    assert_close(scene.geometry.normals[1], Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(scene.geometry.normals[2], Vec3::Z);
}

#[test]
fn degenerate_triangles_are_dropped_and_counted_once() {
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [2.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
    ];
    let mut file = Gltf::empty();
    let positions = file.floats(&points);
    // In order: fine, a repeated index, three points on a line, two vertices at one place.
    let indices = file.indices(&[0, 1, 2, 1, 1, 2, 0, 1, 3, 1, 4, 2]);
    file.show(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let scene = file.import();
    assert_eq!(world_triangles(&scene), [corners([0, 1, 2], &points)]);
    assert_eq!(
        warnings(&scene),
        ["meshes: 3 triangles have no area and are left out"]
    );
}

#[test]
fn interleaved_accessors_step_by_the_stride() {
    let mut file = Gltf::empty();
    // Position and normal, with four bytes in front and in between.
    let mut bytes = Vec::new();
    for point in TRIANGLE {
        bytes.extend(float_bytes(&[f32::NAN]));
        bytes.extend(float_bytes(&point));
        bytes.extend(float_bytes(&[f32::NAN, 0.0, 0.6, 0.8]));
    }
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = json!(32);
    let accessor = |offset: usize| json!({ "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "type": "VEC3", "count": 3 });
    let positions = file.push("accessors", accessor(4));
    let normals = file.push("accessors", accessor(20));
    file.show(json!({ "attributes": { "POSITION": positions, "NORMAL": normals } }));
    let scene = file.import();
    assert_eq!(world_triangles(&scene), [corners([0, 1, 2], &TRIANGLE)]);
    scene
        .geometry
        .normals
        .iter()
        .for_each(|&normal| assert_close(normal, Vec3::new(0.0, 0.6, 0.8)));
}

fn sparse(
    file: &mut Gltf,
    component: u32,
    indices: &[u8],
    values: &[[f32; 3]],
) -> serde_json::Value {
    let (indices, values_view) = (
        file.view(indices),
        file.view(&float_bytes(values.as_flattened())),
    );
    json!({
        "count": values.len(),
        "indices": { "bufferView": indices, "componentType": component },
        "values": { "bufferView": values_view },
    })
}

#[test]
fn sparse_values_replace_those_of_the_view() {
    let mut file = zigzag(4);
    file.json["accessors"][0]["sparse"] =
        sparse(&mut file, U8, &[0, 2], &[[-1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
    let expected = [[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]];
    assert_eq!(world_triangles(&file.import()), expected);
}

#[test]
fn without_a_view_what_is_not_sparse_is_zero() {
    let mut file = Gltf::empty();
    let sparse = sparse(
        &mut file,
        U16,
        &[1, 0, 2, 0],
        &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    );
    let positions = file.push(
        "accessors",
        json!({ "componentType": FLOAT, "type": "VEC3", "count": 3, "sparse": sparse }),
    );
    file.show(json!({ "attributes": { "POSITION": positions } }));
    assert_eq!(
        world_triangles(&file.import()),
        [corners([0, 1, 2], &TRIANGLE)]
    );
}

#[test]
fn quantised_positions_and_normals() {
    let mut file = Gltf::empty();
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let words: Vec<u8> = [0_u16, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0, 0]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    let positions = file.accessor(U16, "VEC3", 3, &words);
    file.json["accessors"][positions]["normalized"] = json!(true);
    // -128 and -127 are both -1.
    let normals = file.accessor(I8, "VEC3", 3, &[0, 0, 127, 0, 0, 0x80, 0, 0, 0, 0x81, 0, 0]);
    file.json["accessors"][normals]["normalized"] = json!(true);
    for accessor in [positions, normals] {
        let view = file.json["accessors"][accessor]["bufferView"]
            .as_u64()
            .unwrap() as usize;
        file.json["bufferViews"][view]["byteStride"] =
            json!(if accessor == positions { 8 } else { 4 });
    }
    file.show(json!({ "attributes": { "POSITION": positions, "NORMAL": normals } }));
    let scene = file.import();
    assert_eq!(world_triangles(&scene), [corners([0, 1, 2], &TRIANGLE)]);
    assert_eq!(scene.geometry.normals, [Vec3::Z, Vec3::NEG_Y, Vec3::NEG_Y]);

    // Not normalised they are whole numbers.
    file.json["accessors"][positions]["normalized"] = json!(false);
    assert_eq!(world_triangles(&file.import())[0][1], [65535.0, 0.0, 0.0]);

    file.json
        .as_object_mut()
        .unwrap()
        .retain(|key, _| !key.starts_with("extensions"));
    assert!(
        file.error().contains(
            "accessors[0]: Vec3 of U16 can't be a Position without KHR_mesh_quantization"
        )
    );
}

#[test]
fn signed_words_as_positions() {
    let mut file = Gltf::empty();
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    let words: Vec<u8> = [-3_i16, 0, 0, 0, 5, 0, 0, 0, 0, 2, 0, 0]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    let positions = file.accessor(I16, "VEC3", 3, &words);
    file.json["bufferViews"][0]["byteStride"] = json!(8);
    file.show(json!({ "attributes": { "POSITION": positions } }));
    assert_eq!(
        world_triangles(&file.import()),
        [[[-3.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 2.0, 0.0]]]
    );
}

#[test]
fn vertex_colours_of_every_type() {
    let colors = |component: u32, kind: &str, bytes: &[u8]| {
        let mut file = Gltf::triangle();
        let accessor = file.accessor(component, kind, 3, bytes);
        file.json["accessors"][accessor]["normalized"] = json!(component != FLOAT);
        file.primitive()["attributes"]["COLOR_0"] = json!(accessor);
        file.import().geometry.colors
    };
    let three = [Vec4::new(1.0, 0.5, 0.25, 1.0); 3];
    let four = [Vec4::new(1.0, 0.5, 0.25, 0.125); 3];
    assert_eq!(
        colors(FLOAT, "VEC3", &float_bytes(&[1.0, 0.5, 0.25].repeat(3))),
        three
    );
    assert_eq!(
        colors(
            FLOAT,
            "VEC4",
            &float_bytes(&[1.0, 0.5, 0.25, 0.125].repeat(3))
        ),
        four
    );
    // 51 / 255 = 0.2 and 13107 / 65535 = 0.2.
    assert_eq!(
        colors(U8, "VEC4", &[255, 51, 0, 51].repeat(3)),
        [Vec4::new(1.0, 0.2, 0.0, 0.2); 3]
    );
    assert_eq!(
        colors(U8, "VEC3", &[255, 51, 0].repeat(3)),
        [Vec4::new(1.0, 0.2, 0.0, 1.0); 3]
    );
    let words: Vec<u8> = [65535_u16, 13107, 0]
        .repeat(3)
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    assert_eq!(
        colors(U16, "VEC3", &words),
        [Vec4::new(1.0, 0.2, 0.0, 1.0); 3]
    );
}

#[test]
fn meshes_without_colours_are_white_beside_coloured_ones() {
    let mut file = Gltf::triangle();
    let colors = file.floats(&[[0.5, 0.5, 0.5]; 3]);
    file.primitive()["attributes"]["COLOR_0"] = json!(colors);
    file.show(json!({ "attributes": { "POSITION": 0 } }));
    let expected = [[Vec4::new(0.5, 0.5, 0.5, 1.0); 3], [Vec4::ONE; 3]].concat();
    assert_eq!(file.import().geometry.colors, expected);
}

#[test]
fn only_uv_sets_that_a_texture_reads_are_kept() {
    let mut file = Gltf::with_material(json!({
        "emissiveTexture": { "index": 0, "texCoord": 3 },
        "occlusionTexture": { "index": 0, "texCoord": 1 },
    }));
    crate::materials::add_texture(&mut file);
    for (set, u) in [(0, 0.25), (1, 0.5), (2, 0.75)] {
        let uvs = file.floats(&[[u, 0.0]; 3]);
        file.primitive()["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
    }
    // Normalised bytes: 255 is 1.
    let uvs = file.accessor(U8, "VEC2", 3, &[255, 0, 0, 0, 0, 255, 0, 0, 0, 0, 0, 0]);
    file.json["accessors"][uvs]["normalized"] = json!(true);
    let view = file.json["accessors"][uvs]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    file.primitive()["attributes"]["TEXCOORD_3"] = json!(uvs);
    let scene = file.import();
    let expected = [
        vec![Vec2::new(0.5, 0.0); 3],
        vec![Vec2::X, Vec2::Y, Vec2::ZERO],
    ];
    assert_eq!(scene.geometry.uv_sets, expected);
    assert_eq!(scene.materials[0].occlusion_texture.unwrap().uv_set, 0);
    assert_eq!(scene.materials[0].emissive_texture.unwrap().uv_set, 1);
    assert!(scene.warnings.is_empty());
}

#[test]
fn a_uv_set_that_is_missing_is_zero_with_a_warning() {
    let mut file = Gltf::with_material(json!({ "emissiveTexture": { "index": 0, "texCoord": 1 } }));
    crate::materials::add_texture(&mut file);
    let scene = file.import();
    assert_eq!(scene.geometry.uv_sets, [vec![Vec2::ZERO; 3]]);
    assert!(warnings(&scene)[0].starts_with("mesh 0, primitive 0: has no TEXCOORD_1"));
}

/// A quad in the xy plane, facing +z, that shows an image upright: v runs down.
fn upright_quad() -> Gltf {
    let mut file = Gltf::empty();
    let positions = file.floats(&[
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ]);
    let normals = file.floats(&[[0.0, 0.0, 1.0]; 4]);
    let uvs = file.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
    file.push("materials", json!({ "normalTexture": { "index": 0 } }));
    crate::materials::add_texture(&mut file);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs });
    file.show(json!({ "attributes": attributes, "indices": indices, "material": 0 }));
    file
}

#[test]
fn made_tangents_point_right_and_bitangents_up_in_the_image() {
    let scene = upright_quad().import();
    assert_eq!(scene.geometry.positions.len(), 4);
    // cross(z, x) = y is up already: w = 1.
    assert_eq!(scene.geometry.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
}

#[test]
fn made_tangents_split_a_vertex_where_the_image_is_mirrored() {
    let mut file = upright_quad();
    // The second triangle shows the image mirrored left to right; its vertices 0 and 2 are shared with the first.
    let uvs = file.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [2.0, 0.0]]);
    file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    let scene = file.import();
    let tangents = |triangle: usize| {
        scene.geometry.triangles[triangle]
            .vertices
            .map(|vertex| scene.geometry.tangents[vertex as usize])
    };
    // The first is upright as before; the second is the other way round, so its bitangents are on the other side.
    assert!(tangents(0).iter().all(|tangent| tangent.w == 1.0));
    assert!(tangents(1).iter().all(|tangent| tangent.w == -1.0));
    assert_eq!(scene.geometry.positions.len(), 6);
}

#[test]
fn made_tangents_turn_with_the_texture_transform() {
    let mut file = upright_quad();
    // A quarter turn: u' = v, so u' rises downwards, and v' = -u falls to the right: right is up in the image.
    file.json["materials"][0]["normalTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "rotation": std::f64::consts::FRAC_PI_2 } });
    let scene = file.import();
    for tangent in &scene.geometry.tangents {
        assert_close(tangent.truncate(), Vec3::NEG_Y);
        assert_close(tangent.w * Vec3::Z.cross(tangent.truncate()), Vec3::X);
    }
}

#[test]
fn tangents_of_the_file_are_kept_where_a_normal_map_reads_them() {
    let mut file = upright_quad();
    let tangents = file.floats(&[[0.0, 1.0, 0.0, -1.0]; 4]);
    file.primitive()["attributes"]["TANGENT"] = json!(tangents);
    assert_eq!(
        file.import().geometry.tangents,
        [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]
    );
    // Without normals they are to be ignored: flat normals, made tangents.
    file.primitive()["attributes"]
        .as_object_mut()
        .unwrap()
        .remove("NORMAL");
    let scene = file.import();
    assert_eq!(scene.geometry.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 6]);
    // Nothing reads them.
    file.json["materials"][0] = json!({});
    assert!(file.import().geometry.tangents.is_empty());
}

#[test]
fn texture_coordinates_without_area_still_give_unit_tangents() {
    let mut file = upright_quad();
    file.primitive()["attributes"]
        .as_object_mut()
        .unwrap()
        .remove("TEXCOORD_0");
    let scene = file.import();
    assert!(warnings(&scene)[0].contains("has no TEXCOORD_0"));
    for (tangent, normal) in scene.geometry.tangents.iter().zip(&scene.geometry.normals) {
        assert!(tangent.truncate().dot(*normal).abs() < 1e-6);
    }
}
