//! Broken files: refused with one line that names the place; never a panic, however they are broken.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use raytree_scene::import::{ImportError, ImportOptions, import, import_with};
use serde_json::{Value, json};

use crate::builder::*;

/// A triangle with indices, normals, a texture, a camera and a light: something of everything to break.
fn complete() -> Gltf {
    let mut file = Gltf::with_material(
        json!({ "normalTexture": { "index": 0 }, "emissiveTexture": { "index": 0 } }),
    );
    crate::materials::add_texture(&mut file);
    let indices = file.indices(&[0, 1, 2]);
    let normals = file.floats(&[[0.0, 0.0, 1.0]; 3]);
    let uvs = file.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let primitive = file.primitive();
    primitive["indices"] = json!(indices);
    primitive["attributes"]["NORMAL"] = json!(normals);
    primitive["attributes"]["TEXCOORD_0"] = json!(uvs);
    file.push("samplers", json!({ "magFilter": 9728 }));
    file.json["textures"][0]["sampler"] = json!(0);
    file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }),
    );
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    file.push(
        "nodes",
        json!({ "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
    );
    file.push("nodes", json!({ "children": [0, 1] }));
    file.json["scenes"] = json!([{ "nodes": [2] }]);
    file.json["scene"] = json!(0);
    file
}

#[test]
fn the_file_to_be_broken_is_whole() {
    let scene = complete().import();
    assert_eq!(
        (
            scene.geometry.triangles.len(),
            scene.cameras.len(),
            scene.lights.len()
        ),
        (1, 1, 1)
    );
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn one_broken_value_each() {
    // What is set (null: removed), and what the message must say.
    let cases: &[(&str, Value, &str)] = &[
        ("/asset", Value::Null, "asset.version: missing"),
        ("/asset/version", json!("1.0"), "glTF 1.0 is not supported"),
        ("/asset/version", json!("3.0"), "glTF 3.0 is not supported"),
        ("/asset/version", json!(2.0), "asset.version: not a version"),
        (
            "/asset/version",
            json!("two"),
            "asset.version: not a version",
        ),
        (
            "/asset/minVersion",
            json!("2.1"),
            "asset.minVersion: glTF 2.1 is not supported",
        ),
        (
            "/scene",
            json!(1),
            "scene: scenes[1] is not there, there are 1",
        ),
        ("/scene", json!(-1), "scene: not an index into scenes"),
        (
            "/scene",
            json!(4_294_967_296_u64),
            "scene: scenes[4294967296] is not there",
        ),
        (
            "/scenes/0/nodes/0",
            json!(3),
            "scenes[0].nodes[0]: nodes[3]",
        ),
        ("/scenes/0/nodes/0", json!(0), "node 0: is listed as a root"),
        ("/scenes/0/nodes", json!([2, 2]), "node 2: is listed twice"),
        ("/nodes", json!({}), "nodes: not a list"),
        ("/nodes/1", json!(7), "nodes[1]: not an object"),
        (
            "/nodes/2/children/0",
            json!("0"),
            "nodes[2].children[0]: not an index",
        ),
        (
            "/nodes/2/children",
            json!([0, 1, 0]),
            "node 0: is a child of node 2 and again of node 2",
        ),
        (
            "/nodes/1/children",
            json!([0]),
            "node 0: is a child of node 1 and again of node 2",
        ),
        (
            "/nodes/0/children",
            json!([2]),
            "node 0: is among its own descendants",
        ),
        (
            "/nodes/0/children",
            json!([0]),
            "node 0: is a child of node 0 and again of node 2",
        ),
        ("/nodes/0/mesh", json!(1), "nodes[0].mesh: meshes[1]"),
        ("/nodes/1/camera", json!(1), "nodes[1].camera: cameras[1]"),
        ("/nodes/0/skin", json!(0), "nodes[0].skin: skins[0]"),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0]),
            "node 0: matrix is not a list of 16",
        ),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            "node 0: the last row",
        ),
        (
            "/nodes/0/scale",
            json!([1e200, 1, 1]),
            "node 0: its place in the world",
        ),
        (
            "/nodes/0/translation",
            json!([1, 2, "3"]),
            "node 0: translation is not a list of 3",
        ),
        (
            "/nodes/0/scale",
            json!([1e20, 1e20, 1e20]),
            "the scene: it is 1e20 m large",
        ),
        (
            "/nodes/0/scale",
            json!([1e-20, 1e-20, 1e-20]),
            "the scene: it is",
        ),
        (
            "/meshes/0/primitives",
            Value::Null,
            "meshes[0]: missing field `primitives`",
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            "meshes[0].primitives[0].attributes.POSITION: accessors[9]",
        ),
        (
            "/meshes/0/primitives/0/attributes/_MINE",
            json!(9),
            "attributes._MINE: accessors[9]",
        ),
        (
            "/meshes/0/primitives/0/attributes/NORMAL",
            json!(3),
            "accessors[3]: Vec2 of F32 can't be a Normal",
        ),
        (
            "/meshes/0/primitives/0/attributes/COLOR_0",
            json!(3),
            "accessors[3]: Vec2 of F32 can't be a Color",
        ),
        (
            "/meshes/0/primitives/0/attributes",
            json!({ "POSITION": 1 }),
            "accessors[1]: Scalar of U16 can't be a Position",
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(0),
            "accessors[0]: Vec3 of F32 can't be a Indices",
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(9),
            "meshes[0].primitives[0].indices: accessors[9]",
        ),
        (
            "/meshes/0/primitives/0/material",
            json!(1),
            "meshes[0].primitives[0].material: materials[1]",
        ),
        (
            "/meshes/0/primitives/0/mode",
            json!("4"),
            "meshes[0]: invalid type",
        ),
        (
            "/accessors/0/count",
            json!(2),
            "mesh 0, primitive 0: its attributes differ in length",
        ),
        (
            "/accessors/0/count",
            json!(4),
            "accessors[0]: 4 elements of 12 bytes reach past bufferViews[0]",
        ),
        ("/accessors/0/count", json!(-1), "accessors[0]: invalid"),
        (
            "/accessors/0/count",
            json!(u64::MAX),
            "accessors[0]: count 18446744073709551615 is too large",
        ),
        (
            "/accessors/0/byteOffset",
            json!(4),
            "accessors[0]: 3 elements of 12 bytes reach past bufferViews[0]",
        ),
        (
            "/accessors/0/byteOffset",
            json!(u64::MAX),
            "accessors[0]: 3 elements",
        ),
        (
            "/accessors/0/bufferView",
            json!(9),
            "accessors[0].bufferView: bufferViews[9]",
        ),
        (
            "/accessors/0/componentType",
            json!(5124),
            "accessors[0]: its componentType or its type",
        ),
        (
            "/accessors/0/type",
            json!("VEC5"),
            "accessors[0]: its componentType or its type",
        ),
        (
            "/accessors/2/normalized",
            json!("yes"),
            "accessors[2]: invalid type",
        ),
        (
            "/bufferViews/0/buffer",
            json!(1),
            "bufferViews[0].buffer: buffers[1]",
        ),
        (
            "/bufferViews/0/byteLength",
            json!(10_000),
            "bufferViews[0]: 10000 bytes from 0 on reach past",
        ),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            "bufferViews[0]: 36 bytes from 18446744073709551615",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(8),
            "accessors[0]: bufferViews[0] has byteStride 8, an element 12 bytes",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(0),
            "accessors[0]: bufferViews[0] has byteStride 0",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(252),
            "accessors[0]: 3 elements",
        ),
        (
            "/buffers/0/byteLength",
            json!(100_000),
            "buffers[0]: cut short",
        ),
        ("/buffers/0/uri", Value::Null, "buffers[0]: has no uri"),
        (
            "/buffers/0/uri",
            json!("data:nothing"),
            "buffers[0]: its data URI has no comma",
        ),
        (
            "/textures/0/source",
            json!(1),
            "textures[0].source: images[1]",
        ),
        (
            "/textures/0/sampler",
            json!(1),
            "textures[0].sampler: samplers[1]",
        ),
        (
            "/samplers/0/wrapS",
            json!(1),
            "texture 0: the wrap or filter mode",
        ),
        (
            "/samplers/0/magFilter",
            json!(9984),
            "texture 0: the wrap or filter mode",
        ),
        ("/images/0/bufferView", Value::Null, "image 0: has neither"),
        (
            "/images/0/bufferView",
            json!(9),
            "images[0].bufferView: bufferViews[9]",
        ),
        (
            "/images/0/bufferView",
            json!(0),
            "image 0: neither PNG nor JPEG",
        ),
        (
            "/materials/0/emissiveTexture/index",
            json!(1),
            "materials[0].emissiveTexture.index: textures[1]",
        ),
        (
            "/materials/0/emissiveTexture",
            json!({}),
            "missing field `index`",
        ),
        (
            "/materials/0/emissiveTexture/texCoord",
            json!(-1),
            "invalid",
        ),
        (
            "/materials/0/normalTexture/scale",
            json!(1e300),
            "material 0: normalTexture.scale is inf",
        ),
        (
            "/materials/0/alphaMode",
            json!(3),
            "materials[0]: invalid type",
        ),
        ("/materials/0/alphaCutoff", json!(1e300), ""),
        (
            "/extensionsUsed",
            json!("KHR_lights_punctual"),
            "extensionsUsed: not a list of names",
        ),
        (
            "/extensionsRequired",
            json!([1]),
            "extensionsRequired: not a list of names",
        ),
        (
            "/extensionsRequired",
            json!(["KHR_draco_mesh_compression"]),
            "extension KHR_draco_mesh_compression: the file requires it",
        ),
        (
            "/extensionsRequired",
            json!(["A\nB"]),
            "extension A B: the file requires it",
        ),
    ];
    for (pointer, value, wanted) in cases {
        let mut file = complete();
        file.json = file.embedded();
        set(&mut file.json, pointer, value.clone());
        // What nothing reads may hold anything.
        if wanted.is_empty() {
            file.import();
            continue;
        }
        let message = file.error();
        assert!(message.contains(wanted), "{pointer} = {value}: {message}");
    }
}

fn set(json: &mut Value, pointer: &str, value: Value) {
    let (parent, field) = pointer.rsplit_once('/').unwrap();
    match json.pointer_mut(parent).unwrap() {
        Value::Object(object) if value.is_null() => drop(object.remove(field).unwrap()),
        Value::Object(object) => drop(object.insert(field.to_owned(), value)),
        Value::Array(list) => list[field.parse::<usize>().unwrap()] = value,
        other => panic!("{parent} is {other}"),
    }
}

#[test]
fn indices_out_of_range_and_restart_values() {
    let cases = [
        ([0, 1, 3], "index 3, but there are 3 vertices"),
        (
            [0, 1, 65535],
            "index 65535 is reserved for primitive restart",
        ),
    ];
    for (indices, wanted) in cases {
        let mut file = Gltf::triangle();
        let indices = file.indices(&indices);
        file.primitive()["indices"] = json!(indices);
        let message = file.error();
        assert!(
            message.contains(&format!("mesh 0, primitive 0: {wanted}")),
            "{message}"
        );
    }
    // 255 is an ordinary index in 16 bits, and a restart in 8 even where there are vertices enough.
    let mut file = Gltf::empty();
    let positions = file.floats(&[TRIANGLE.to_vec(), vec![[0.0, 0.0, 1.0]; 300]].concat());
    let indices = file.indices(&[0, 1, 255]);
    file.show(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    file.import();
    let bytes = file.accessor(U8, "SCALAR", 3, &[0, 1, 255]);
    file.primitive()["indices"] = json!(bytes);
    assert!(
        file.error()
            .contains("index 255 is reserved for primitive restart")
    );
}

/// glTF forbids them (3.6.2.2), but a picture of the rest is worth more than none.
#[test]
fn infinite_and_undefined_vertices() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut file = Gltf::empty();
        let far = [[5.0, 5.0, 5.0], [6.0, value, 5.0], [5.0, 6.0, 5.0]];
        let positions = file.floats(&[TRIANGLE, far].concat());
        let indices = file.indices(&[0, 1, 2, 0, 1, 4, 3, 4, 5]);
        file.show(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
        let scene = file.import();
        assert_eq!(world_triangles(&scene).len(), 1);
        assert_eq!(scene.frame.origin.rounded().to_array(), [0.5, 0.5, 0.0]);
        assert_eq!(
            warnings(&scene),
            ["meshes: 2 triangles have a corner that is infinite or not a number and are left out"]
        );
    }
}

#[test]
fn infinite_and_undefined_attributes_are_mended_and_counted_once() {
    let mut file = Gltf::with_material(json!({ "normalTexture": { "index": 0 } }));
    crate::materials::add_texture(&mut file);
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let normals = file.floats(&[[0.0, nan, 1.0], [0.6, 0.0, 0.8], [0.0, -inf, 0.0]]);
    let tangents = file.floats(&[
        [1.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, -1.0],
        [nan, 0.0, 0.0, 1.0],
    ]);
    let uvs = file.floats(&[[inf, 1.0], [0.5, 0.5], [nan, nan]]);
    let colors = file.floats(&[[1.0, 0.5, 0.0, 1.0], [nan, 1.0, 1.0, 1.0], [0.0; 4]]);
    file.primitive()["attributes"] = json!({
        "POSITION": 0, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs, "COLOR_0": colors,
    });
    let scene = file.import();
    let geometry = &scene.geometry;
    assert_eq!(geometry.normals[0], Vec3::Z);
    assert_close(geometry.normals[1], Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(geometry.normals[2], Vec3::Z);
    assert!(geometry.tangents[2].is_finite());
    assert_eq!(geometry.uv_sets[0][0], Vec2::ZERO);
    assert_eq!(geometry.uv_sets[0][1], Vec2::splat(0.5));
    assert_eq!(geometry.colors[1], Vec4::ONE);
    let mended = |count: usize, what: &str| format!("mesh 0, primitive 0: {count} of its {what}");
    assert_eq!(
        warnings(&scene),
        [
            mended(
                2,
                "normals are infinite or not a number; that of a triangle there is used"
            ),
            mended(
                2,
                "texture coordinates are infinite or not a number; (0, 0) is used"
            ),
            mended(1, "colours are infinite or not a number; white is used"),
            mended(
                1,
                "tangents are infinite or not a number; any direction is used"
            ),
        ]
    );
}

#[test]
fn broken_sparse_accessors() {
    let sparse = |indices: &[u8], count: usize| {
        let mut file = Gltf::triangle();
        let (indices, values) = (file.view(indices), file.view(&float_bytes(&[0.0; 9])));
        file.json["accessors"][0]["sparse"] = json!({
            "count": count, "indices": { "bufferView": indices, "componentType": U8 }, "values": { "bufferView": values },
        });
        file
    };
    assert!(
        sparse(&[1, 1], 2)
            .error()
            .contains("accessors[0]: sparse: the indices do not increase")
    );
    assert!(
        sparse(&[2, 1], 2)
            .error()
            .contains("accessors[0]: sparse: the indices do not increase")
    );
    assert!(
        sparse(&[1, 3], 2)
            .error()
            .contains("accessors[0]: sparse: index 3, but count is 3")
    );
    assert!(
        sparse(&[1], 2)
            .error()
            .contains("sparse: 2 elements of 1 bytes reach past bufferViews[1]")
    );
    assert!(
        sparse(&[0, 1, 2, 3], 4)
            .error()
            .contains("sparse: count 4 is more than the accessor's 3")
    );
    let mut file = sparse(&[0], 1);
    file.json["accessors"][0]["sparse"]["values"]["bufferView"] = json!(9);
    assert!(
        file.error()
            .contains("accessors[0].sparse.values.bufferView: bufferViews[9]")
    );
    file.json["accessors"][0]["sparse"]["values"] = json!({ "bufferView": 2, "byteOffset": 28 });
    assert!(
        file.error()
            .contains("sparse: 1 elements of 12 bytes reach past bufferViews[2]")
    );
    file.json["accessors"][0]["sparse"]["indices"]["componentType"] = json!(FLOAT);
    assert!(
        file.error()
            .contains("its indices are not unsigned integers")
    );
}

#[test]
fn small_files_cannot_ask_for_much_memory() {
    let mut file = Gltf::triangle();
    file.push(
        "accessors",
        json!({ "componentType": FLOAT, "type": "VEC3", "count": 4_000_000_000_u32 }),
    );
    assert!(
        file.error()
            .contains("accessors[1]: has no bufferView and count 4000000000")
    );

    // A picture of 60,000 by 60,000 texels whose data is missing.
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    png.extend([0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60, 8, 6, 0, 0, 0]);
    png.extend(crc32(&png[12..]).to_be_bytes());
    png.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    let mut file = Gltf::with_material(json!({ "emissiveTexture": { "index": 0 } }));
    let view = file.view(&png);
    file.push("images", json!({ "bufferView": view }));
    file.push("textures", json!({ "source": 0 }));
    assert!(
        file.error().contains("image 0: the images hold more than"),
        "{}",
        file.error()
    );
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| {
        if crc & 1 == 1 {
            crc >> 1 ^ 0xedb8_8320
        } else {
            crc >> 1
        }
    };
    !bytes
        .iter()
        .fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn limits_are_the_callers() {
    let folder = Folder::new();
    let mut file = complete();
    for _ in 0..9 {
        file.push("nodes", json!({ "mesh": 0 }));
    }
    file.json["scenes"][0]["nodes"] = json!([2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    folder.write("scene.glb", &file.glb());
    let path = folder.0.join("scene.glb");
    let import = |options: ImportOptions| import_with(&path, &options);
    let exact = ImportOptions {
        max_triangles: 10,
        max_texels: 2,
        max_bytes: file.binary.len() as u64,
        ..ImportOptions::default()
    };
    assert_eq!(import(exact).unwrap().geometry.triangles.len(), 10);
    let too_small = [
        (
            ImportOptions {
                max_triangles: 9,
                ..exact
            },
            "node 11: the scene has more than 9 triangles",
        ),
        (
            ImportOptions {
                max_texels: 1,
                ..exact
            },
            "image 0: the images hold more than 1 texels",
        ),
        (
            ImportOptions {
                max_bytes: exact.max_bytes - 1,
                ..exact
            },
            "buffers[0]: the buffers hold more than",
        ),
    ];
    for (options, wanted) in too_small {
        let error = import(options).unwrap_err();
        assert!(
            matches!(error, ImportError::Limit { .. }) && error.to_string().contains(wanted),
            "{error}"
        );
    }
}

#[test]
fn files_that_are_not_there_or_no_gltf() {
    let error = import(Path::new("/nowhere/scene.glb")).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("/nowhere/scene.glb: the scene file: cannot be read: "),
        "{error}"
    );
    for text in [
        "",
        "{]",
        "null",
        "[]",
        "3",
        "{}",
        "\u{feff}{}",
        "PK\u{3}\u{4}",
        "glTF",
        "{\"asset\":",
    ] {
        assert!(import_bytes(text.as_bytes()).is_err(), "{text:?}");
    }
    let nested = "[".repeat(100_000);
    assert!(import_bytes(nested.as_bytes()).is_err());
}

#[test]
fn glb_containers() {
    let glb = complete().glb();
    let whole = import_bytes(&glb).unwrap();
    assert_eq!(
        whole.geometry.positions,
        complete().import().geometry.positions
    );
    let patched = |at: usize, word: u32| {
        let mut glb = glb.clone();
        glb[at..at + 4].copy_from_slice(&word.to_le_bytes());
        import_bytes(&glb)
    };
    let refused = |at: usize, word: u32, wanted: &str| {
        let message = patched(at, word).unwrap_err().to_string();
        assert!(
            message.contains("GLB container: ") && message.contains(wanted),
            "{message}"
        );
    };
    refused(4, 1, "version 1");
    refused(8, 0, "less than its own header");
    refused(8, 11, "less than its own header");
    refused(8, u32::MAX, "cut short");
    refused(8, 16, "cut short in a chunk's header");
    refused(12, u32::MAX, "a chunk of 4294967295 bytes has only");
    refused(16, 0x004E_4942, "its first chunk is not JSON");
    // Bytes after the end are said, and ignored.
    let mut longer = glb.clone();
    longer.extend([0; 5]);
    assert!(
        warnings(&import_bytes(&longer).unwrap())[0].contains("5 bytes after its announced end")
    );
}

#[test]
fn cut_short_anywhere_both_forms_are_refused() {
    let file = complete();
    let text = serde_json::to_vec(&file.embedded()).unwrap();
    let folder = Folder::new();
    for bytes in [file.glb(), text] {
        assert!(folder.import(&bytes).is_ok());
        for length in 0..bytes.len() {
            assert!(
                folder.import(&bytes[..length]).is_err(),
                "{length} of {} bytes",
                bytes.len()
            );
        }
    }
}

/// Not to find that something is refused, but that nothing panics, hangs or eats the memory.
#[test]
fn random_damage_never_panics() {
    let file = complete();
    let text = serde_json::to_vec(&file.embedded()).unwrap();
    let mut random = Random(0x2545_F491_4F6C_DD1D);
    let (mut refused, mut imported) = (0, 0);
    let folder = Folder::new();
    for bytes in [file.glb(), text] {
        for _ in 0..2_000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random.below(4) {
                damage(&mut damaged, &mut random);
            }
            match folder.import(&damaged) {
                Ok(scene) => {
                    check_scene(&scene);
                    imported += 1;
                }
                Err(error) => {
                    assert!(!error.to_string().contains('\n'));
                    refused += 1;
                }
            }
        }
    }
    // Both must happen, or the damage is not of the interesting kind.
    assert!(
        refused > 500 && imported > 100,
        "{refused} refused, {imported} imported"
    );
}

pub fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(6) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        // Numbers and braces, where most of the meaning of a file is.
        2 => bytes[at] = b"0123456789-.eE[]{},:\""[random.below(21)],
        3 => drop(bytes.remove(at)),
        4 => bytes.insert(at, b'0' + random.below(10) as u8),
        _ => {
            let digits: Vec<usize> = (0..bytes.len())
                .filter(|&at| bytes[at].is_ascii_digit())
                .collect();
            if !digits.is_empty() {
                bytes[digits[random.below(digits.len())]] = b'0' + random.below(10) as u8;
            }
        }
    }
    if bytes.is_empty() {
        bytes.push(0);
    }
}

/// Marsaglia's xorshift: the same damage every time.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 33) % bound as u64) as usize
    }
}

#[test]
fn unsupported_extensions_warn_once_each() {
    let mut file = Gltf::triangle();
    file.json["extensionsUsed"] = json!([
        "KHR_materials_sheen",
        "EXT_mesh_gpu_instancing",
        "KHR_materials_sheen",
        "KHR_xmp"
    ]);
    file.push("animations", json!({}));
    file.push("skins", json!({}));
    file.json["nodes"][0]["skin"] = json!(0);
    file.primitive()["targets"] = json!([{ "POSITION": 0 }]);
    assert_eq!(
        warnings(&file.import()),
        [
            "extension KHR_materials_sheen: not supported: sheen is left out",
            "extension EXT_mesh_gpu_instancing: not supported: only one of the instances is drawn",
            "animations: not supported: the scene is shown at rest",
            "skins: not supported: skinned meshes are shown as their nodes place them",
            "morph targets: not supported: meshes are shown undeformed",
        ]
    );
}

#[test]
fn a_primitive_without_positions_is_not_drawn() {
    let mut file = Gltf::triangle();
    file.primitive()["attributes"] = json!({});
    let scene = file.import();
    assert!(scene.geometry.triangles.is_empty());
    assert!(warnings(&scene)[0].contains("mesh 0, primitive 0: has no POSITION"));
}

#[test]
fn many_nodes_with_many_empty_primitives_take_no_time() {
    let mut file = Gltf::triangle();
    // 20,000 squared would take minutes.
    let lines = json!({ "mode": 1, "attributes": { "POSITION": 0 } });
    file.json["meshes"][0]["primitives"] = vec![lines; 20_000].into();
    file.json["nodes"] = vec![json!({ "mesh": 0 }); 20_000].into();
    assert_eq!(file.import().warnings.len(), 20_001);
}
