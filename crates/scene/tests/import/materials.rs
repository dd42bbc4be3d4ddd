//! Materials, textures, images and the extensions on them.

use std::f32::consts::PI;
use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{Vec2, Vec3, Vec4};
use image::{ImageFormat, Rgba, RgbaImage};
use raytree_scene::import::import;
use raytree_scene::model::{
    AlphaMode, Filter, Material, Texture, TextureRef, Volume, WhittedCoefficients, Wrap,
};
use serde_json::{Value, json};

use crate::builder::*;

/// Two texels: red, and half transparent green.
fn png() -> Vec<u8> {
    let mut image = RgbaImage::new(2, 1);
    image.put_pixel(0, 0, Rgba([255, 0, 0, 255]));
    image.put_pixel(1, 0, Rgba([0, 255, 0, 128]));
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, ImageFormat::Png).unwrap();
    file.into_inner()
}

const TEXELS: [[u8; 4]; 2] = [[255, 0, 0, 255], [0, 255, 0, 128]];

/// Texture 0 of image 0, a PNG in a buffer view.
pub fn add_texture(file: &mut Gltf) {
    let view = file.view(&png());
    file.push(
        "images",
        json!({ "bufferView": view, "mimeType": "image/png" }),
    );
    file.push("textures", json!({ "source": 0 }));
}

fn material(json: Value) -> Material {
    let file = Gltf::with_material(json);
    let scene = file.import();
    assert_eq!(scene.materials.len(), 1);
    scene.materials[0].clone()
}

#[test]
fn an_empty_material_is_the_default_one_with_a_name() {
    assert_eq!(
        material(json!({})),
        Material {
            name: "material 0".to_owned(),
            ..Material::default()
        }
    );
    assert_eq!(material(json!({ "name": "brass" })).name, "brass");
}

#[test]
fn factors() {
    let expected = Material {
        name: "all".to_owned(),
        base_color: Vec4::new(0.125, 0.25, 0.5, 0.75),
        metallic: 0.25,
        roughness: 0.5,
        emissive: Vec3::new(2.0, 1.0, 0.5),
        alpha_mode: AlphaMode::Mask { cutoff: 0.25 },
        double_sided: true,
        unlit: true,
        transmission: 0.75,
        ior: 1.25,
        specular: 0.5,
        specular_color: Vec3::new(1.0, 2.0, 0.0),
        volume: Some(Volume {
            attenuation_color: Vec3::new(0.5, 0.25, 1.0),
            attenuation_distance: 3.0,
        }),
        ..Material::default()
    };
    let json = json!({
        "name": "all",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.125, 0.25, 0.5, 0.75], "metallicFactor": 0.25, "roughnessFactor": 0.5,
        },
        "emissiveFactor": [1.0, 0.5, 0.25],
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "extensions": {
            "KHR_materials_unlit": {},
            "KHR_materials_transmission": { "transmissionFactor": 0.75 },
            "KHR_materials_ior": { "ior": 1.25 },
            "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 2, 0] },
            "KHR_materials_volume": {
                "thicknessFactor": 0.01, "attenuationDistance": 3, "attenuationColor": [0.5, 0.25, 1],
            },
            "KHR_materials_emissive_strength": { "emissiveStrength": 2 },
        },
    });
    assert_eq!(material(json), expected);
}

#[test]
fn extensions_have_the_defaults_of_their_specifications() {
    let extension = |name: &str| material(json!({ "extensions": { name: {} } }));
    assert_eq!(extension("KHR_materials_transmission").transmission, 0.0);
    assert_eq!(extension("KHR_materials_ior").ior, 1.5);
    assert_eq!(extension("KHR_materials_specular").specular, 1.0);
    assert_eq!(
        extension("KHR_materials_specular").specular_color,
        Vec3::ONE
    );
    assert_eq!(extension("KHR_materials_volume").volume, None);
    let thick =
        material(json!({ "extensions": { "KHR_materials_volume": { "thicknessFactor": 1 } } }));
    let clear = Volume {
        attenuation_color: Vec3::ONE,
        attenuation_distance: f64::INFINITY,
    };
    assert_eq!(thick.volume, Some(clear));
    let glowing = json!({ "emissiveFactor": [1, 1, 1], "extensions": { "KHR_materials_emissive_strength": {} } });
    assert_eq!(material(glowing).emissive, Vec3::ONE);
}

#[test]
fn alpha_modes() {
    assert_eq!(
        material(json!({ "alphaMode": "OPAQUE" })).alpha_mode,
        AlphaMode::Opaque
    );
    assert_eq!(
        material(json!({ "alphaMode": "MASK" })).alpha_mode,
        AlphaMode::Mask { cutoff: 0.5 }
    );
    assert_eq!(
        material(json!({ "alphaMode": "BLEND", "alphaCutoff": 0.1 })).alpha_mode,
        AlphaMode::Blend
    );
    assert!(
        Gltf::with_material(json!({ "alphaMode": "GLASS" }))
            .error()
            .contains("material 0: alphaMode")
    );
}

#[test]
fn attenuation_distances_are_in_scene_space() {
    let volume = json!({ "thicknessFactor": 1, "attenuationDistance": 3 });
    let mut file = Gltf::with_material(json!({ "extensions": { "KHR_materials_volume": volume } }));
    file.json["nodes"][0]["scale"] = json!([8, 8, 8]);
    let scene = file.import();
    assert_eq!(scene.frame.scale, 0.125);
    assert_eq!(
        scene.materials[0].volume.unwrap().attenuation_distance,
        0.375
    );
}

#[test]
fn indices_of_refraction() {
    let ior = |ior: f64| json!({ "extensions": { "KHR_materials_ior": { "ior": ior } } });
    assert_eq!(material(ior(0.0)).ior, f32::INFINITY);
    assert_eq!(material(ior(1.0)).ior, 1.0);
    assert!(
        Gltf::with_material(ior(0.5))
            .error()
            .contains("ior is 0.5, but must be 0, or 1 and above")
    );
}

#[test]
fn factors_out_of_range_are_clamped_with_a_warning() {
    let file = Gltf::with_material(
        json!({ "pbrMetallicRoughness": { "roughnessFactor": 1.5, "metallicFactor": -1 } }),
    );
    let scene = file.import();
    assert_eq!(
        (scene.materials[0].roughness, scene.materials[0].metallic),
        (1.0, 0.0)
    );
    assert_eq!(
        warnings(&scene),
        [
            "material 0: metallicFactor -1 is not within 0 and 1; 0 is used",
            "material 0: roughnessFactor 1.5 is not within 0 and 1; 1 is used",
        ]
    );
}

#[test]
fn the_books_coefficients() {
    let whitted = |json: Value| material(json!({ "extras": { "whitted": json } })).whitted;
    assert_eq!(whitted(json!({})), Some(WhittedCoefficients::default()));
    let all = whitted(
        json!({ "ka": 0.5, "kd": 2, "ks": 0.25, "n": 30, "kt": [0.5, 0.25, 0], "ior": 1.5 }),
    );
    let expected = WhittedCoefficients {
        ka: Some(0.5),
        kd: Some(2.0),
        ks: Some(Vec3::splat(0.25)),
        n: Some(30.0),
        kt: Some(Vec3::new(0.5, 0.25, 0.0)),
        ior: Some(1.5),
    };
    assert_eq!(all, Some(expected));
    for broken in [
        json!([]),
        json!({ "kd": -1 }),
        json!({ "ks": [1, 2] }),
        json!({ "ior": 0.5 }),
        json!({ "n": "30" }),
    ] {
        let message = Gltf::with_material(json!({ "extras": { "whitted": broken } })).error();
        assert!(message.contains("material 0"), "{message}");
    }
    let scene = Gltf::with_material(json!({ "extras": { "whitted": { "Kd": 1 } } })).import();
    assert!(warnings(&scene)[0].contains("extras.whitted has 'Kd'"));
}

#[test]
fn priorities_of_solids() {
    let priority =
        |json: Value| Gltf::with_material(json!({ "extras": { "priority": json } })).import();
    assert_eq!(material(json!({})).priority, 0);
    for whole in [-3, 0, 7] {
        let scene = priority(json!(whole));
        assert_eq!(scene.materials[0].priority, whole);
        assert!(warnings(&scene).is_empty());
    }
    for other in [json!(1.5), json!("high"), json!(1_u64 << 40)] {
        let scene = priority(other);
        assert_eq!(scene.materials[0].priority, 0);
        assert!(warnings(&scene)[0].contains("extras.priority"));
    }
}

#[test]
fn extras_may_be_any_json() {
    for extras in [
        json!(3),
        json!("text"),
        json!([1, [2]]),
        json!(null),
        json!({ "whitted_": 1 }),
    ] {
        let mut file = Gltf::with_material(
            json!({ "extras": extras, "pbrMetallicRoughness": { "extras": extras } }),
        );
        file.primitive()["extras"] = extras.clone();
        file.json["accessors"][0]["extras"] = extras.clone();
        file.json["nodes"][0]["extras"] = extras.clone();
        file.json["extras"] = extras;
        assert_eq!(file.import().materials[0].whitted, None);
    }
}

#[test]
fn only_used_materials_stay_and_the_default_comes_last() {
    let mut file = Gltf::triangle();
    for name in ["zero", "one", "two"] {
        file.push(
            "materials",
            json!({ "name": name, "emissiveTexture": { "index": 0 } }),
        );
    }
    file.json["materials"][1]
        .as_object_mut()
        .unwrap()
        .remove("emissiveTexture");
    add_texture(&mut file);
    for material in [json!(1), Value::Null, json!(1)] {
        file.show(json!({ "attributes": { "POSITION": 0 }, "material": material }));
    }
    let scene = file.import();
    let names: Vec<_> = scene
        .materials
        .iter()
        .map(|material| material.name.as_str())
        .collect();
    assert_eq!(names, ["one", "default"]);
    let used: Vec<_> = scene
        .geometry
        .triangles
        .iter()
        .map(|triangle| triangle.material)
        .collect();
    assert_eq!(used, [1, 0, 1, 0]);
    assert!(scene.textures.is_empty() && scene.images.is_empty());
}

#[test]
fn every_slot_reads_its_texture_in_its_encoding() {
    let slot = |index: usize| json!({ "index": index });
    let mut file = Gltf::with_material(json!({
        "pbrMetallicRoughness": { "baseColorTexture": slot(0), "metallicRoughnessTexture": slot(1) },
        "normalTexture": { "index": 2, "scale": 0.5 },
        "occlusionTexture": { "index": 3, "strength": 0.25 },
        "emissiveTexture": slot(4),
        "extensions": {
            "KHR_materials_transmission": { "transmissionTexture": slot(5) },
            "KHR_materials_specular": { "specularTexture": slot(6), "specularColorTexture": slot(7) },
        },
    }));
    // A wrap mode of its own tells each texture from the others; image 0 for all.
    let modes = [10497, 33071, 33648];
    let view = file.view(&png());
    file.push(
        "images",
        json!({ "bufferView": view, "name": "two texels" }),
    );
    for index in 0..8 {
        file.push(
            "samplers",
            json!({ "wrapS": modes[index % 3], "wrapT": modes[index / 3] }),
        );
        file.push("textures", json!({ "source": 0, "sampler": index }));
    }
    let scene = file.import();
    let material = &scene.materials[0];
    assert_eq!(
        (material.normal_scale, material.occlusion_strength),
        (0.5, 0.25)
    );
    let slots = [
        (&material.base_color_texture, true),
        (&material.metallic_roughness_texture, false),
        (&material.normal_texture, false),
        (&material.occlusion_texture, false),
        (&material.emissive_texture, true),
        (&material.transmission_texture, false),
        (&material.specular_texture, false),
        (&material.specular_color_texture, true),
    ];
    let wraps = [Wrap::Repeat, Wrap::ClampToEdge, Wrap::MirroredRepeat];
    for (index, (slot, srgb)) in slots.into_iter().enumerate() {
        let texture = scene.textures[slot.unwrap().texture as usize];
        let (wrap_u, wrap_v) = (wraps[index % 3], wraps[index / 3]);
        assert_eq!(
            texture,
            Texture {
                image: 0,
                wrap_u,
                wrap_v,
                filter: Filter::Linear,
                srgb
            },
            "slot {index}"
        );
    }
    assert_eq!(scene.images.len(), 1);
    assert_eq!(
        (
            scene.images[0].name.as_str(),
            scene.images[0].width,
            scene.images[0].height
        ),
        ("two texels", 2, 1)
    );
    assert_eq!(scene.images[0].texels, TEXELS);
}

#[test]
fn samplers() {
    let texture = |sampler: Value| {
        let mut file = Gltf::with_material(json!({ "emissiveTexture": { "index": 0 } }));
        add_texture(&mut file);
        file.push("samplers", sampler);
        file.json["textures"][0]["sampler"] = json!(0);
        file.import().textures[0]
    };
    let default = Texture {
        image: 0,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Linear,
        srgb: true,
    };
    assert_eq!(texture(json!({})), default);
    assert_eq!(texture(json!({ "minFilter": 9728 })), default);
    assert_eq!(texture(json!({ "magFilter": 9729 })), default);
    assert_eq!(
        texture(json!({ "magFilter": 9728, "minFilter": 9987 })),
        Texture {
            filter: Filter::Nearest,
            ..default
        }
    );
}

#[test]
fn the_same_texture_is_listed_once_for_each_encoding() {
    let mut file = Gltf::with_material(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } },
        "emissiveTexture": { "index": 1 },
    }));
    add_texture(&mut file);
    file.push("textures", json!({ "source": 0 }));
    let scene = file.import();
    let material = &scene.materials[0];
    let index = |slot: &Option<TextureRef>| slot.unwrap().texture;
    assert_eq!(
        index(&material.base_color_texture),
        index(&material.emissive_texture)
    );
    assert_eq!((scene.textures.len(), scene.images.len()), (2, 1));
    assert!(!scene.textures[index(&material.metallic_roughness_texture) as usize].srgb);
}

fn texture_ref(info: Value) -> TextureRef {
    let mut file = Gltf::with_material(json!({ "emissiveTexture": info }));
    add_texture(&mut file);
    for set in 0..3 {
        let uvs = file.floats(&[[set as f32, 0.0]; 3]);
        file.primitive()["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
    }
    let scene = file.import();
    let texture = scene.materials[0].emissive_texture.unwrap();
    // Put the file's number back: set n holds n.
    TextureRef {
        uv_set: scene.geometry.uv_sets[texture.uv_set as usize][0].x as u32,
        ..texture
    }
}

fn apply(m: [f32; 6], uv: Vec2) -> Vec2 {
    Vec2::new(
        m[0] * uv.x + m[1] * uv.y + m[2],
        m[3] * uv.x + m[4] * uv.y + m[5],
    )
}

#[test]
fn texture_transforms() {
    let transform = |json: Value| {
        texture_ref(
            json!({ "index": 0, "texCoord": 1, "extensions": { "KHR_texture_transform": json } }),
        )
    };
    assert_eq!(
        texture_ref(json!({ "index": 0 })),
        TextureRef {
            texture: 0,
            uv_set: 0,
            transform: TextureRef::IDENTITY
        }
    );
    assert_eq!(transform(json!({})).transform, TextureRef::IDENTITY);
    assert_eq!(transform(json!({})).uv_set, 1);
    assert_eq!(transform(json!({ "texCoord": 2 })).uv_set, 2);
    assert_eq!(transform(json!({ "texCoord": 0 })).uv_set, 0);
    let moved = transform(json!({ "offset": [0.5, 0.25], "scale": [2, 4] }));
    assert_eq!(moved.transform, [2.0, 0.0, 0.5, 0.0, 4.0, 0.25]);
    // Counter-clockwise where v runs down: u turns to -v (up), v turns to u (right).
    let turned =
        transform(json!({ "rotation": PI / 2.0, "scale": [2, 3], "offset": [10, 20] })).transform;
    assert!((apply(turned, Vec2::X) - Vec2::new(10.0, 18.0)).length() < 1e-5);
    assert!((apply(turned, Vec2::Y) - Vec2::new(13.0, 20.0)).length() < 1e-5);
}

#[test]
fn normal_and_occlusion_textures_are_transformed_too() {
    let transform = json!({ "KHR_texture_transform": { "offset": [0.5, 0.25] } });
    let mut file = Gltf::with_material(json!({
        "normalTexture": { "index": 0, "extensions": transform },
        "occlusionTexture": { "index": 0, "extensions": transform },
    }));
    add_texture(&mut file);
    let scene = file.import();
    for slot in [
        scene.materials[0].normal_texture,
        scene.materials[0].occlusion_texture,
    ] {
        assert_eq!(slot.unwrap().transform, [1.0, 0.0, 0.5, 0.0, 1.0, 0.25]);
    }
}

/// A file whose only image is `image`.
fn textured(image: Value) -> Gltf {
    let mut file = Gltf::with_material(json!({ "emissiveTexture": { "index": 0 } }));
    file.push("images", image);
    file.push("textures", json!({ "source": 0 }));
    file
}

#[test]
fn images_in_data_uris() {
    for media in [
        "data:image/png;base64,",
        "data:;base64,",
        "DATA:image/png;BASE64,",
    ] {
        let scene =
            textured(json!({ "uri": format!("{media}{}", STANDARD.encode(png())) })).import();
        assert_eq!(scene.images[0].texels, TEXELS);
        assert_eq!(scene.images[0].name, "image 0");
    }
    let percent: String = png().iter().map(|byte| format!("%{byte:02X}")).collect();
    assert_eq!(
        textured(json!({ "uri": format!("data:image/png,{percent}") }))
            .import()
            .images[0]
            .texels,
        TEXELS
    );
}

#[test]
fn images_and_buffers_beside_the_scene() {
    let folder = Folder::new();
    let mut file = textured(json!({ "uri": "two%20texels%C3%A4.png" }));
    file.json["buffers"] = json!([{ "byteLength": file.binary.len(), "uri": "./vertices%23.bin" }]);
    folder.write("two texelsä.png", &png());
    folder.write("vertices#.bin", &file.binary);
    folder.write("scene.gltf", &serde_json::to_vec(&file.json).unwrap());
    let scene = import(&folder.0.join("scene.gltf")).unwrap();
    assert_eq!(scene.images[0].texels, TEXELS);
    assert_eq!(scene.images[0].name, "two%20texels%C3%A4.png");
    assert_eq!(scene.geometry.triangles.len(), 1);

    std::fs::remove_file(folder.0.join("two texelsä.png")).unwrap();
    let message = import(&folder.0.join("scene.gltf"))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("image 0 'two%20texels%C3%A4.png', file ")
            && message.contains("two texelsä.png"),
        "{message}"
    );
    std::fs::remove_file(folder.0.join("vertices#.bin")).unwrap();
    let message = import(&folder.0.join("scene.gltf"))
        .unwrap_err()
        .to_string();
    assert!(message.contains("buffers[0], file "), "{message}");
}

#[test]
fn jpeg_images() {
    let mut encoded = Cursor::new(Vec::new());
    let grey = image::DynamicImage::ImageRgb8(image::RgbImage::from_pixel(
        8,
        8,
        image::Rgb([128, 128, 128]),
    ));
    grey.write_to(&mut encoded, ImageFormat::Jpeg).unwrap();
    let scene = textured(json!({ "uri": format!("data:image/jpeg;base64,{}", STANDARD.encode(encoded.into_inner())) })).import();
    assert_eq!((scene.images[0].width, scene.images[0].height), (8, 8));
    assert!(
        scene.images[0]
            .texels
            .iter()
            .all(|texel| texel[0].abs_diff(128) <= 2 && texel[3] == 255)
    );
}

#[test]
fn sixteen_bits_and_grey_become_eight_bits_and_rgba() {
    let mut encoded = Cursor::new(Vec::new());
    let image =
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![0_u16, 0x8080]).unwrap();
    image::DynamicImage::ImageLuma16(image)
        .write_to(&mut encoded, ImageFormat::Png)
        .unwrap();
    let scene = textured(json!({ "uri": format!("data:image/png;base64,{}", STANDARD.encode(encoded.into_inner())) })).import();
    assert_eq!(
        scene.images[0].texels,
        [[0, 0, 0, 255], [128, 128, 128, 255]]
    );
}

#[test]
fn images_that_cannot_be_read_are_errors() {
    assert!(
        textured(json!({}))
            .error()
            .contains("image 0: has neither a uri nor a bufferView")
    );
    let webp = format!(
        "data:image/webp;base64,{}",
        STANDARD.encode(b"RIFF\0\0\0\0WEBPVP8 ")
    );
    assert!(
        textured(json!({ "uri": webp }))
            .error()
            .contains("image 0: neither PNG nor JPEG")
    );
    let cut = format!("data:image/png;base64,{}", STANDARD.encode(&png()[..60]));
    assert!(
        textured(json!({ "uri": cut, "name": "cut\nshort" }))
            .error()
            .contains("image 0 'cut short'")
    );
    assert!(
        textured(json!({ "uri": "data:image/png;base64,###" }))
            .error()
            .contains("is not base64")
    );
    for uri in [
        "http://example.invalid/a.png",
        "file:///etc/passwd",
        "/etc/passwd",
        "%2Fetc%2Fpasswd",
        "C:\\a.png",
        "",
    ] {
        assert!(
            textured(json!({ "uri": uri }))
                .error()
                .contains("relative path"),
            "{uri}"
        );
    }
    // A folder, and a device that never ends.
    assert!(
        textured(json!({ "uri": "../" }))
            .error()
            .contains("not a regular file")
    );
    let up = "../".repeat(20);
    assert!(
        textured(json!({ "uri": format!("{up}dev/zero") }))
            .error()
            .contains("not a regular file")
    );
}

#[test]
fn a_texture_in_an_unsupported_format_only_is_left_out() {
    let mut file = textured(json!({ "uri": "data:image/webp;base64,AAAA" }));
    file.json["extensionsUsed"] = json!(["EXT_texture_webp"]);
    file.json["textures"][0] = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
    let scene = file.import();
    assert_eq!(scene.materials[0].emissive_texture, None);
    assert_eq!(scene.warnings.len(), 2);
    file.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    assert!(
        file.error()
            .contains("extension EXT_texture_webp: the file requires it")
    );
}
