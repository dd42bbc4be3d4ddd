//! Numbers that host and shaders have to agree on, judged by what the host uploads for a scene that has one of each. (Those that
//! only the renderer itself can see are in `crates/gpu/agreement.rs`.)

use glam::{DVec3, Vec3};
use naga::Module;
use raytree::{
    Feature, Preset, ProgramFeatures, Scene, Shading, build_bvh,
    model::{
        AlphaMode, Filter, Geometry, Image, Light, LightKind, Material, Texture, TextureRef,
        Triangle, Volume, WhittedCoefficients, Wrap,
    },
};
use raytree_gpu::{
    GpuScene, TABLE_WIDTH, source,
    types::{self, LeafTriangle, MATERIAL_TEXTURES, MEDIA, SRGB_CODES, TextureUse},
};

use super::module::constant;

fn parsed() -> Module {
    source::parse(source::Limits::for_depth(32)).unwrap_or_else(|error| panic!("{error}"))
}

/// One triangle of each material.
fn scene_of(materials: Vec<Material>) -> Scene {
    let mut geometry = Geometry::default();
    for material in 0..materials.len() as u32 {
        let first = geometry.positions.len() as u32;
        let z = material as f32;
        geometry.positions.extend([
            Vec3::new(0.0, 0.0, z),
            Vec3::new(1.0, 0.0, z),
            Vec3::new(0.0, 1.0, z),
        ]);
        geometry.normals.extend([Vec3::Z; 3]);
        geometry.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
            node: 0,
        });
    }
    Scene {
        geometry,
        materials,
        nodes: vec!["all".to_owned()],
        ..Scene::default()
    }
}

/// What `look` finds in what is uploaded.
fn uploaded<T>(scene: &Scene, shading: Shading, look: impl FnOnce(&GpuScene<'_>) -> T) -> T {
    let bvh = build_bvh(scene, Preset::Fast).expect("few triangles");
    let features =
        ProgramFeatures::everything().with(Feature::Whitted, shading == Shading::Whitted);
    look(&GpuScene::new(scene, &bvh, features, shading).expect("few media"))
}

fn glass() -> Material {
    let volume = Volume {
        attenuation_color: Vec3::ONE,
        attenuation_distance: f64::INFINITY,
    };
    Material {
        metallic: 0.0,
        transmission: 1.0,
        volume: Some(volume),
        ..Material::default()
    }
}

#[test]
fn flags_of_leaves() {
    let module = parsed();
    let [culled, transparent, index] =
        ["LEAF_CULLED", "LEAF_TRANSPARENT", "LEAF_TRIANGLE"].map(|name| constant(&module, name));
    assert_eq!((culled | transparent) & index, 0, "flags and index overlap");
    let double_sided = Material {
        double_sided: true,
        ..Material::default()
    };
    let cases = [
        (Material::default(), culled),
        (double_sided.clone(), 0),
        (
            Material {
                alpha_mode: AlphaMode::Blend,
                ..double_sided.clone()
            },
            transparent,
        ),
        (
            Material {
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                ..Material::default()
            },
            culled | transparent,
        ),
        (glass(), transparent),
    ];
    let (materials, expected): (Vec<_>, Vec<_>) = cases.into_iter().unzip();
    let leaves: Vec<LeafTriangle> = uploaded(&scene_of(materials), Shading::Pbr, |gpu| {
        (0..expected.len())
            .map(|leaf| gpu.leaf_triangle(leaf))
            .collect()
    });
    for leaf in leaves {
        let triangle = leaf.entry & index;
        assert_eq!(
            leaf.entry & !index,
            expected[triangle as usize],
            "triangle {triangle}"
        );
    }
}

#[test]
fn flags_of_materials() {
    let module = parsed();
    let none = WhittedCoefficients::default();
    let with = |whitted| Material {
        whitted: Some(whitted),
        ..Material::default()
    };
    let cases = [
        (
            "MATERIAL_MASK",
            Material {
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                ..Material::default()
            },
        ),
        (
            "MATERIAL_BLEND",
            Material {
                alpha_mode: AlphaMode::Blend,
                ..Material::default()
            },
        ),
        (
            "MATERIAL_UNLIT",
            Material {
                unlit: true,
                ..Material::default()
            },
        ),
        (
            "MATERIAL_KA",
            with(WhittedCoefficients {
                ka: Some(0.5),
                ..none
            }),
        ),
        (
            "MATERIAL_KD",
            with(WhittedCoefficients {
                kd: Some(0.5),
                ..none
            }),
        ),
        (
            "MATERIAL_KS",
            with(WhittedCoefficients {
                ks: Some(Vec3::ONE),
                ..none
            }),
        ),
        (
            "MATERIAL_N",
            with(WhittedCoefficients {
                n: Some(5.0),
                ..none
            }),
        ),
        (
            "MATERIAL_KT",
            with(WhittedCoefficients {
                kt: Some(Vec3::ONE),
                ..none
            }),
        ),
    ];
    let (names, mut materials): (Vec<_>, Vec<_>) = cases.into_iter().unzip();
    materials.push(Material::default());
    let materials = uploaded(&scene_of(materials), Shading::Whitted, |gpu| {
        gpu.materials.clone()
    });
    for (name, material) in names.iter().zip(&materials) {
        assert_eq!(material.flags, constant(&module, name), "{name}");
    }
    assert_eq!(
        materials[names.len()].flags,
        0,
        "glTF's default material has no flag"
    );
}

#[test]
fn an_infinite_index_and_no_texture() {
    let module = parsed();
    let scene = scene_of(vec![Material {
        ior: f32::INFINITY,
        ..Material::default()
    }]);
    let (material, uses) = uploaded(&scene, Shading::Pbr, |gpu| {
        (gpu.materials[0], gpu.texture_uses[0])
    });
    assert_eq!(material.ior.to_bits(), constant(&module, "IOR_INFINITE"));
    assert_eq!(TextureUse::NONE.offset, constant(&module, "NO_TEXTURE"));
    assert!(
        uses.iter()
            .all(|texture| texture.offset == TextureUse::NONE.offset)
    );
}

fn image(width: u32) -> Image {
    Image {
        name: String::new(),
        width,
        height: 1,
        texels: vec![[0; 4]; width as usize],
    }
}

/// Each texture of a material lies where the shaders look for it.
#[test]
fn order_of_textures() {
    let module = parsed();
    let use_of = |texture| {
        Some(TextureRef {
            texture,
            uv_set: 0,
            transform: TextureRef::IDENTITY,
        })
    };
    let material = Material {
        base_color_texture: use_of(0),
        metallic_roughness_texture: use_of(1),
        normal_texture: use_of(2),
        occlusion_texture: use_of(3),
        emissive_texture: use_of(4),
        transmission_texture: use_of(5),
        specular_texture: use_of(6),
        specular_color_texture: use_of(7),
        ..Material::default()
    };
    let mut scene = scene_of(vec![material]);
    // Told apart by their widths.
    for width in 1..=8 {
        scene.images.push(image(width));
        scene.textures.push(Texture {
            image: width - 1,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Linear,
            srgb: false,
        });
    }
    let uses = uploaded(&scene, Shading::Pbr, |gpu| gpu.texture_uses[0]);
    let names = [
        "BASE_COLOR_TEXTURE",
        "METALLIC_ROUGHNESS_TEXTURE",
        "NORMAL_TEXTURE",
        "OCCLUSION_TEXTURE",
        "EMISSIVE_TEXTURE",
        "TRANSMISSION_TEXTURE",
        "SPECULAR_TEXTURE",
        "SPECULAR_COLOR_TEXTURE",
    ];
    for (name, width) in names.into_iter().zip(1_u32..) {
        assert_eq!(
            uses[constant(&module, name) as usize].width,
            width,
            "{name}"
        );
    }
}

#[test]
fn flags_of_textures() {
    let module = parsed();
    let wraps = [
        (Wrap::Repeat, "WRAP_REPEAT"),
        (Wrap::MirroredRepeat, "WRAP_MIRRORED"),
        (Wrap::ClampToEdge, "WRAP_CLAMP"),
    ];
    let mut scene = scene_of(Vec::new());
    scene.images.push(image(1));
    let mut expected = Vec::new();
    for (wrap_u, name_u) in wraps {
        for (wrap_v, name_v) in wraps {
            for (filter, nearest) in [
                (Filter::Linear, 0),
                (Filter::Nearest, constant(&module, "TEXTURE_NEAREST")),
            ] {
                for (srgb, decoded) in [(false, 0), (true, constant(&module, "TEXTURE_SRGB"))] {
                    let texture = scene.textures.len() as u32;
                    scene.materials.push(Material {
                        base_color_texture: Some(TextureRef {
                            texture,
                            uv_set: 0,
                            transform: TextureRef::IDENTITY,
                        }),
                        ..Material::default()
                    });
                    scene.textures.push(Texture {
                        image: 0,
                        wrap_u,
                        wrap_v,
                        filter,
                        srgb,
                    });
                    expected.push(
                        constant(&module, name_u)
                            | (constant(&module, name_v) << 2)
                            | nearest
                            | decoded,
                    );
                }
            }
        }
    }
    let flags: Vec<u32> = uploaded(&scene, Shading::Pbr, |gpu| {
        gpu.texture_uses.iter().map(|uses| uses[0].flags).collect()
    });
    assert_eq!(flags, expected);
}

#[test]
fn kinds_of_lights() {
    let module = parsed();
    let (position, direction, range) = (DVec3::ZERO, DVec3::NEG_Y, 1.0);
    let kinds = [
        ("LIGHT_DIRECTIONAL", LightKind::Directional { direction }),
        ("LIGHT_POINT", LightKind::Point { position, range }),
        (
            "LIGHT_SPOT",
            LightKind::Spot {
                position,
                direction,
                range,
                inner_cone_angle: 0.1,
                outer_cone_angle: 0.2,
            },
        ),
    ];
    let mut scene = scene_of(vec![Material::default()]);
    let light = |kind| Light {
        name: String::new(),
        kind,
        intensity: DVec3::ONE,
    };
    scene.lights = kinds.map(|(_, kind)| light(kind)).to_vec();
    let lights = uploaded(&scene, Shading::Pbr, |gpu| gpu.lights.clone());
    for ((name, _), light) in kinds.iter().zip(&lights) {
        assert_eq!(light.kind, constant(&module, name), "{name}");
    }
}

/// The sizes of arrays in uniform buffers, and of entries of tables.
#[test]
fn capacities() {
    let module = parsed();
    assert_eq!(constant(&module, "MEDIA") as usize, MEDIA);
    assert_eq!(constant(&module, "SRGB_CODES") as usize, SRGB_CODES);
    let textures = constant(&module, "MATERIAL_TEXTURES") as usize;
    assert_eq!(textures, MATERIAL_TEXTURES);
    assert_eq!(constant(&module, "TABLE_WIDTH"), TABLE_WIDTH);
    let texels = |size: usize| (size / 16) as u32;
    assert_eq!(
        constant(&module, "MATERIAL_WORDS"),
        texels(size_of::<types::Material>())
    );
    assert_eq!(
        constant(&module, "LIGHT_WORDS"),
        texels(size_of::<types::Light>())
    );
    assert_eq!(
        constant(&module, "TEXTURE_USE_WORDS"),
        texels(size_of::<TextureUse>())
    );
}

/// A ray's stack of media has a byte for each.
#[test]
fn media_fit_a_byte() {
    let glasses = |count: u16| -> Vec<Material> {
        (0..count)
            .map(|k| Material {
                ior: 1.0 + f32::from(k) / 256.0,
                ..glass()
            })
            .collect()
    };
    let media = |count| {
        let scene = scene_of(glasses(count));
        let bvh = build_bvh(&scene, Preset::Fast).expect("few triangles");
        GpuScene::new(&scene, &bvh, ProgramFeatures::everything(), Shading::Pbr)
            .map(|gpu| gpu.media.len())
    };
    assert_eq!(media(255).expect("255 fit"), 255);
    assert!(media(256).is_err());
}

/// The comparison has to be able to fail: a constant is what the shaders say, and a name that they lack is no constant.
#[test]
#[should_panic(expected = "no constant LEAF_NONSENSE")]
fn a_missing_constant_is_noticed() {
    constant(&parsed(), "LEAF_NONSENSE");
}
