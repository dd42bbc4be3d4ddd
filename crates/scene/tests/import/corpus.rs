//! The glTF files in ../shared, which nobody on this project made. Skipped, and said so, where they are not there.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use raytree_scene::import::{ImportError, import};
use raytree_scene::model::Scene;

use crate::broken::{Random, damage};
use crate::builder::*;

/// A folder beside the repository's, or a line that says that it is not there.
#[expect(
    clippy::print_stdout,
    reason = "a skipped test must not look like a passed one"
)]
fn shared(folder: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared")
        .join(folder);
    if !path.is_dir() {
        println!("skipped: {} not there", path.display());
        return None;
    }
    Some(path)
}

fn scene_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension().and_then(|extension| extension.to_str()) {
                _ if path.is_dir() => pending.push(path),
                Some("gltf" | "glb") => files.push(path),
                _ => {}
            }
        }
    }
    files.sort();
    files
}

fn load(file: &str) -> Option<Scene> {
    let scene = import(&shared("gltf")?.join(file)).unwrap_or_else(|error| panic!("{error}"));
    check_scene(&scene);
    Some(scene)
}

/// The table of INDEX.md: file, number of triangles, extent in metres.
fn index(folder: &Path) -> Vec<(String, usize, f64)> {
    let text = fs::read_to_string(folder.join("INDEX.md")).unwrap();
    let rows = text
        .lines()
        .map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    rows.filter(|cells| {
        cells.len() == 13 && (cells[1].ends_with(".gltf") || cells[1].ends_with(".glb"))
    })
    .map(|cells| {
        (
            cells[1].to_owned(),
            cells[6].parse().unwrap(),
            cells[10].parse().unwrap(),
        )
    })
    .collect()
}

#[test]
fn every_valid_file_has_the_triangles_and_the_extent_of_the_index() {
    let Some(folder) = shared("gltf") else { return };
    let rows = index(&folder);
    assert_eq!(rows.len(), scene_files(&folder).len());
    for (file, triangles, extent) in rows {
        let outcome = import(&folder.join(&file));
        if file == "Box/glTF-Draco/Box.gltf" {
            let message = outcome.unwrap_err().to_string();
            assert!(
                message.contains("extension KHR_draco_mesh_compression"),
                "{message}"
            );
            continue;
        }
        let scene = outcome.unwrap_or_else(|error| panic!("{error}"));
        check_scene(&scene);
        let dropped = scene
            .warnings
            .iter()
            .find(|warning| warning.text.contains("have no area"));
        let dropped = dropped.map_or(0, |warning| {
            warning.text.split(' ').next().unwrap().parse().unwrap()
        });
        assert_eq!(
            scene.geometry.triangles.len() + dropped,
            triangles,
            "{file}"
        );
        // The index counts points and lines in the extent.
        if scene
            .warnings
            .iter()
            .any(|warning| warning.text.contains("are not drawn"))
        {
            continue;
        }
        let corners = scene
            .geometry
            .positions
            .iter()
            .map(|position| position.as_dvec3());
        let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let measured = (high - low).max_element();
        assert!((measured - 1.0).abs() < 1e-6, "{file}: {measured}");
        // The index has four digits, from the accessors' min and max, which for turned nodes bound more than the triangles.
        let measured = measured / scene.frame.scale;
        assert!(
            (measured / extent - 1.0).abs() < 2e-3,
            "{file}: {measured} m, not {extent} m"
        );
    }
}

/// An invalid file whose picture is worth having.
const MENDED: &str = "BoxWithInfinites.glb";

#[test]
fn infinite_vertices_cost_their_triangles() {
    let Some(folder) = shared("gltf-invalid") else {
        return;
    };
    let scene = import(&folder.join("BoxWithInfinites").join(MENDED)).unwrap();
    check_scene(&scene);
    assert!(scene.geometry.triangles.is_empty());
    assert_eq!(
        warnings(&scene),
        [
            "meshes: 12 triangles have a corner that is infinite or not a number and are left out",
            "the scene: has no triangles"
        ]
    );
}

#[test]
fn every_invalid_file_is_refused_in_one_line() {
    let Some(folder) = shared("gltf-invalid") else {
        return;
    };
    let mut files = scene_files(&folder);
    assert_eq!(files.len(), 12);
    files.retain(|file| !file.ends_with(MENDED));
    assert_eq!(files.len(), 11);
    for file in files {
        let message = import(&file)
            .expect_err(&file.display().to_string())
            .to_string();
        assert!(
            message.starts_with(&file.display().to_string()) && !message.contains('\n'),
            "{message}"
        );
    }
}

#[test]
fn what_is_wrong_with_each_invalid_file_is_said() {
    let Some(folder) = shared("gltf-invalid") else {
        return;
    };
    let wanted = [
        (
            "zero_length",
            "GLB container: announces a length of 0 bytes",
        ),
        ("truncated_chunk_data", "GLB container: "),
        ("invalid_syntax", "JSON: "),
        (
            "empty_object",
            "image 0: has neither a uri nor a bufferView",
        ),
        (
            "node_loop_scene",
            "is a child of node 3 and again of node 5",
        ),
        (
            "invalid_length",
            "bufferViews[0]: 5 bytes from 0 on reach past the 4 bytes of buffers[0]",
        ),
        ("IndexOutOfRange", "index 255, but there are 24 vertices"),
        ("BoxTextured", "buffers[0], file "),
        (
            "invalid-buffer-view-index",
            "accessors[0].bufferView: bufferViews[1] is not there",
        ),
        (
            "Compatibility_05",
            "extension FAKE_materials_quantumRendering: the file requires it",
        ),
        (
            "Compatibility_04",
            "asset.minVersion: glTF 2.1 is not supported",
        ),
    ];
    for (name, problem) in wanted {
        let file = scene_files(&folder.join(name)).remove(0);
        let message = import(&file).unwrap_err().to_string();
        assert!(message.contains(problem), "{message}");
    }
}

/// Copies a scene's folder, to damage the scene there.
fn copy_of(file: &Path) -> Folder {
    let folder = Folder::new();
    for entry in fs::read_dir(file.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            folder.write(
                path.file_name().unwrap().to_str().unwrap(),
                &fs::read(&path).unwrap(),
            );
        }
    }
    folder
}

#[test]
fn files_cut_short_are_refused() {
    let (Some(valid), Some(invalid)) = (shared("gltf"), shared("gltf-invalid")) else {
        return;
    };
    let chosen = [
        "Box/glTF-Binary/Box.glb",
        "Box/glTF-Embedded/Box.gltf",
        "SimpleSparseAccessor/SimpleSparseAccessor.gltf",
        "SimpleMorph/SimpleMorph.gltf",
        "MultiUVTest/MultiUVTest.glb",
        "GeometryCameraLight/geometry-camera-light.glb",
        "Cameras/Cameras.gltf",
    ];
    let mut files: Vec<PathBuf> = chosen.iter().map(|file| valid.join(file)).collect();
    files.extend(scene_files(&invalid));
    for file in files {
        let folder = copy_of(&file);
        let whole = fs::read(&file).unwrap();
        let end = whole.trim_ascii_end().len();
        for length in (0..end).step_by(end.div_ceil(400)) {
            assert!(
                folder.import(&whole[..length]).is_err(),
                "{} cut to {length} bytes",
                file.display()
            );
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let Some(folder) = shared("gltf") else { return };
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let size = |path: &PathBuf| fs::metadata(path).unwrap().len();
    let files = scene_files(&folder)
        .into_iter()
        .filter(|file| size(file) < 12_000);
    // Many of the Asset Generator's files differ only in megabytes of texture.
    let small = files.filter(|file| {
        fs::read_dir(file.parent().unwrap())
            .unwrap()
            .all(|entry| size(&entry.unwrap().path()) < 50_000)
    });
    let (mut refused, mut imported) = (0, 0);
    for file in small {
        let (folder, whole) = (copy_of(&file), fs::read(&file).unwrap());
        for _ in 0..50 {
            let mut damaged = whole.clone();
            damage(&mut damaged, &mut random);
            match folder.import(&damaged) {
                Ok(scene) => {
                    check_scene(&scene);
                    imported += 1;
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(
        refused > 100 && imported > 100,
        "{refused} refused, {imported} imported"
    );
}

/// Other programs baked them with MikkTSpace too; few corners may differ where exporters weld vertices otherwise.
/// (The tangents of PortalFrame are of the other hand throughout, against the specification.)
#[test]
fn what_mikktspace_makes_agrees_with_tangents_of_the_file() {
    let Some(folder) = shared("gltf") else { return };
    for file in [
        "AlphaBlendModeTest/AlphaBlendModeTest.glb",
        "LightsPunctualLamp/LightsPunctualLamp.gltf",
    ] {
        let given = import(&folder.join(file)).unwrap();
        let made = import_without_tangents(&folder.join(file));
        let agreement = tangent_agreement(&given, &made);
        assert!(agreement > 0.99, "{file}: {agreement}");
    }
}

/// The scene with every TANGENT renamed, so that the importer makes them.
fn import_without_tangents(path: &Path) -> Scene {
    let folder = copy_of(path);
    let mut bytes = fs::read(path).unwrap();
    let name = b"\"TANGENT\"";
    for at in 0..bytes.len() - name.len() {
        if bytes[at..].starts_with(name) {
            bytes[at..at + name.len()].copy_from_slice(b"\"_ANGENT\"");
        }
    }
    folder.import(&bytes).unwrap()
}

/// The share of corners with a normal map whose tangents are within ten degrees and on the same side.
fn tangent_agreement(a: &Scene, b: &Scene) -> f64 {
    let (mut same, mut all) = (0, 0);
    for (one, other) in a.geometry.triangles.iter().zip(&b.geometry.triangles) {
        if a.materials[one.material as usize].normal_texture.is_none() {
            continue;
        }
        for (v, w) in one.vertices.into_iter().zip(other.vertices) {
            let (s, t) = (
                a.geometry.tangents[v as usize],
                b.geometry.tangents[w as usize],
            );
            all += 1;
            same += usize::from(s.truncate().dot(t.truncate()) > 0.985 && s.w == t.w);
        }
    }
    f64::from(same as u32) / f64::from(all)
}

/// The material called `name`.
fn base_color_transform(scene: &Scene, name: &str) -> [f32; 6] {
    let material = scene
        .materials
        .iter()
        .find(|material| material.name == name)
        .unwrap();
    material.base_color_texture.unwrap().transform
}

#[test]
fn the_arrow_of_texture_transform_test_meets_its_marker() {
    let Some(scene) = load("TextureTransformTest/TextureTransformTest.gltf") else {
        return;
    };
    let apply = |m: [f32; 6], uv: Vec2| {
        Vec2::new(
            m[0] * uv.x + m[1] * uv.y + m[2],
            m[3] * uv.x + m[4] * uv.y + m[5],
        )
    };
    // On the quad, u = x + 0.5 and v = 0.5 - y. The markers' nodes say where the arrow's tip belongs; untransformed it is at
    // the marker "Not Supported", at (0.7778, 0.7778).
    let tip = Vec2::splat(0.777_817_5);
    let rotated = apply(
        base_color_transform(&scene, "Rotation"),
        Vec2::new(0.420_951_8, 1.016_267_5),
    );
    assert!((rotated - tip).length() < 1e-5, "{rotated}");
    let scaled = apply(
        base_color_transform(&scene, "Scale"),
        Vec2::new(0.518_545, 0.518_545),
    );
    assert!((scaled - tip).length() < 1e-5, "{scaled}");
    let all = apply(base_color_transform(&scene, "All"), Vec2::new(0.43, 0.75));
    assert!((all - tip).length() < 0.04, "{all}");
}

#[test]
fn both_halves_of_negative_scale_test_face_outwards() {
    let Some(scene) = load("NegativeScaleTest/NegativeScaleTest.glb") else {
        return;
    };
    assert_faces_agree_with_normals(&scene, 0.999);
}

#[test]
fn front_faces_agree_with_shading_normals() {
    for file in [
        "OrientationTest/OrientationTest.glb",
        "ToyCar/ToyCar.gltf",
        "IORTestGrid/IORTestGrid.glb",
        "MetalRoughSpheresNoTextures/MetalRoughSpheresNoTextures.glb",
    ] {
        let Some(scene) = load(file) else { return };
        assert_faces_agree_with_normals(&scene, 0.99);
    }
}

fn assert_faces_agree_with_normals(scene: &Scene, share: f64) {
    let geometry = &scene.geometry;
    let agrees = |vertices: [u32; 3]| {
        let [a, b, c] = vertices.map(|vertex| geometry.positions[vertex as usize]);
        let mean: Vec3 = vertices
            .map(|vertex| geometry.normals[vertex as usize])
            .iter()
            .sum();
        (b - a).cross(c - a).dot(mean) > 0.0
    };
    let agreeing = geometry
        .triangles
        .iter()
        .filter(|triangle| agrees(triangle.vertices))
        .count();
    let measured = agreeing as f64 / geometry.triangles.len() as f64;
    assert!(measured >= share, "{measured}");
}

#[test]
fn the_same_box_in_every_form() {
    let Some(binary) = load("Box/glTF-Binary/Box.glb") else {
        return;
    };
    let embedded = load("Box/glTF-Embedded/Box.gltf").unwrap();
    let interleaved = load("BoxInterleaved/BoxInterleaved.glb").unwrap();
    let triangles = world_triangles(&binary);
    assert_eq!(triangles, world_triangles(&embedded));
    let centroid = |triangles: &[[[f64; 3]; 3]]| {
        triangles
            .iter()
            .flatten()
            .map(|corner| DVec3::from_array(*corner))
            .sum::<DVec3>()
    };
    assert!((centroid(&triangles) - centroid(&world_triangles(&interleaved))).length() < 1e-6);
}

#[test]
fn cameras_and_lights_of_the_corpus() {
    let Some(scene) = load("GeometryCameraLight/geometry-camera-light.glb") else {
        return;
    };
    assert_eq!((scene.cameras.len(), scene.lights.len()), (2, 2));
    assert_eq!(load("ToyCar/ToyCar.gltf").unwrap().cameras.len(), 8);
    assert_eq!(
        load("LightsPunctualLamp/LightsPunctualLamp.gltf")
            .unwrap()
            .lights
            .len(),
        5
    );
}

#[test]
fn required_extensions_are_named_in_the_error() {
    let Some(folder) = shared("gltf") else { return };
    let error = import(&folder.join("Box/glTF-Draco/Box.gltf")).unwrap_err();
    assert!(matches!(error, ImportError::Unsupported { .. }));
    assert!(
        error
            .to_string()
            .contains("export without mesh compression"),
        "{error}"
    );
}
