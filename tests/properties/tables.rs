//! The entries of the scene's tables as the shaders read them (`shaders/tables.wgsl`), word by word against what was uploaded.

use bytemuck::{NoUninit, cast_slice};
use glam::{DVec3, Vec3, Vec4};
use raytree::{
    ProgramFeatures, RenderSettings, Scene,
    model::{
        Filter, Image, Light, LightKind, Material, Texture, TextureRef, Volume,
        WhittedCoefficients, Wrap,
    },
};
use raytree_gpu::{GpuScene, Piece, PieceCall, evaluate};

use super::support;

/// Words of an answer.
const ANSWER: usize = 16;

/// A scene in whose materials, lights and textures no two numbers are alike.
fn scene() -> Scene {
    let mut last = 0.0_f32;
    let mut next = || {
        last += 1.0 / 128.0;
        last
    };
    let mut scene = Scene::default();
    for width in 1..=8 {
        scene.images.push(Image {
            name: String::new(),
            width,
            height: 9 + width,
            texels: vec![[0; 4]; (width * (9 + width)) as usize],
        });
        scene.textures.push(Texture {
            image: width - 1,
            wrap_u: Wrap::MirroredRepeat,
            wrap_v: Wrap::ClampToEdge,
            filter: Filter::Nearest,
            srgb: width % 2 == 0,
        });
    }
    for k in 0..3 {
        let mut use_of = |texture| {
            Some(TextureRef {
                texture,
                uv_set: texture + k,
                transform: std::array::from_fn(|_| next()),
            })
        };
        let [base, rough, normal, occlusion] = [0, 1, 2, 3].map(&mut use_of);
        let [emissive, transmission, specular, tint] = [4, 5, 6, 7].map(&mut use_of);
        let mut vector = || Vec3::new(next(), next(), next());
        scene.materials.push(Material {
            emissive: vector(),
            specular_color: vector(),
            whitted: Some(WhittedCoefficients {
                ks: Some(vector()),
                kt: Some(vector()),
                n: Some(17.0),
                ka: Some(0.25),
                kd: Some(0.125),
                ior: None,
            }),
            base_color: Vec4::new(next(), next(), next(), next()),
            metallic: next(),
            roughness: next(),
            transmission: next(),
            ior: 1.0 + next(),
            specular: next(),
            normal_scale: next(),
            occlusion_strength: next(),
            volume: Some(Volume {
                attenuation_color: Vec3::ONE,
                attenuation_distance: f64::INFINITY,
            }),
            base_color_texture: base,
            metallic_roughness_texture: rough,
            normal_texture: normal,
            occlusion_texture: occlusion,
            emissive_texture: emissive,
            transmission_texture: transmission,
            specular_texture: specular,
            specular_color_texture: tint,
            ..Material::default()
        });
        scene.lights.push(Light {
            name: String::new(),
            kind: LightKind::Spot {
                position: DVec3::new(1.0, 2.0, f64::from(k)),
                direction: DVec3::new(0.6, 0.0, 0.8),
                range: 7.0,
                inner_cone_angle: 0.1,
                outer_cone_angle: 0.2 + f64::from(k),
            },
            intensity: DVec3::new(11.0, 12.0, 13.0),
        });
    }
    scene
}

/// The words of entries, each padded to two answers.
fn words<T: NoUninit>(entries: &[T]) -> Vec<Vec<u32>> {
    entries
        .iter()
        .map(|entry| {
            let mut words = cast_slice::<T, u32>(std::slice::from_ref(entry)).to_vec();
            words.resize(2 * ANSWER, 0);
            words
        })
        .collect()
}

#[test]
fn entries_are_read_as_they_were_written() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = scene();
    let settings = RenderSettings::new(1, 1, raytree::default_camera(&scene));
    let features = ProgramFeatures::everything();
    let bvh = raytree::build_bvh(&scene, raytree::Preset::default()).expect("no triangles");
    let gpu = GpuScene::new(&scene, &bvh, features, settings.shading).expect("few media");
    let tables = [
        words(&gpu.materials),
        words(&gpu.lights),
        words(gpu.texture_uses.as_flattened()),
    ];
    let mut calls = Vec::new();
    let mut expected = Vec::new();
    for (table, entries) in tables.iter().zip(0_u32..).map(|(entries, k)| (k, entries)) {
        assert!(entries.len() >= 3);
        for (entry, index) in entries.iter().zip(0_u32..) {
            for (part, first) in entry.chunks(ANSWER).zip([0, ANSWER as u32]) {
                let mut call = PieceCall::default();
                call[..3].copy_from_slice(&[table, index, first]);
                calls.push(call);
                expected.push(part.to_vec());
            }
        }
    }
    let found = evaluate(device, Piece::Record, &scene, &settings, &calls)
        .unwrap_or_else(|error| panic!("{error}"));
    for ((call, found), expected) in calls.iter().zip(&found).zip(&expected) {
        assert_eq!(found.as_slice(), expected, "{:?}", &call[..3]);
    }
}
