//! `raytree inspect`: what a scene contains, and what a program for it would.

use std::fmt::Write;

use glam::DVec3;
use raytree::model::{Filter, Texture, Warning, Wrap};
use raytree::{
    ProgramFeatures, RenderSettings, Scene, SceneFeatures, default_camera, default_size,
    light_if_dark,
};
use serde_json::{Value, json};

use crate::args::InspectArgs;
use crate::console::{print, print_json};
use crate::describe;

pub fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let scene = raytree::import(&args.scene)?;
    let features = default_features(&scene);
    let file = args.scene.display().to_string();
    if args.json {
        print_json(&as_json(&file, &scene, features))?;
    } else {
        print(&as_text(&file, &scene, features))?;
    }
    Ok(())
}

/// What the program of a plain `raytree scene.glb` has.
fn default_features(scene: &Scene) -> ProgramFeatures {
    let mut lit = scene.clone();
    light_if_dark(&mut lit);
    let camera = default_camera(&lit);
    let (width, height) = default_size(&camera);
    let settings = RenderSettings::new(width, height, camera);
    ProgramFeatures::of(&SceneFeatures::of(&lit), &settings)
}

/// Metres.
fn world_bounds(scene: &Scene) -> Option<[DVec3; 2]> {
    let (min, max) = scene.geometry.bounds()?;
    Some([min, max].map(|corner| scene.frame.to_world(corner)))
}

fn as_json(file: &str, scene: &Scene, features: ProgramFeatures) -> Value {
    let frame = &scene.frame;
    let materials: Vec<Value> = scene
        .materials
        .iter()
        .map(|material| json!({ "name": material.name, "traits": describe::traits(material) }))
        .collect();
    let images: Vec<Value> = scene
        .images
        .iter()
        .map(|image| json!({ "name": image.name, "width": image.width, "height": image.height }))
        .collect();
    let textures: Vec<Value> = scene.textures.iter().map(texture_json).collect();
    let lights: Vec<Value> = scene
        .lights
        .iter()
        .map(|light| describe::light_json(light, frame))
        .collect();
    let cameras: Vec<Value> = scene
        .cameras
        .iter()
        .map(|camera| describe::camera_json(camera, frame))
        .collect();
    let bounds = world_bounds(scene).map(
        |[min, max]| json!({ "min": describe::point_json(min), "max": describe::point_json(max) }),
    );
    let warnings: Vec<String> = scene.warnings.iter().map(Warning::to_string).collect();
    let (used, left_out) = features.labels();
    json!({
        "file": file,
        "triangles": scene.geometry.triangles.len(),
        "vertices": scene.geometry.positions.len(),
        "uv_sets": scene.geometry.uv_sets.len(),
        "vertex_colors": !scene.geometry.colors.is_empty(),
        "bounds": bounds,
        "frame": { "origin": describe::point_json(frame.origin.rounded()), "scale": frame.scale },
        "nodes": scene.nodes,
        "materials": materials,
        "textures": textures,
        "images": images,
        "lights": lights,
        "cameras": cameras,
        "features": { "used": used, "left_out": left_out },
        "warnings": warnings,
    })
}

fn texture_json(texture: &Texture) -> Value {
    json!({
        "image": texture.image,
        "wrap": [wrap_name(texture.wrap_u), wrap_name(texture.wrap_v)],
        "filter": filter_name(texture.filter),
        "srgb": texture.srgb,
    })
}

fn as_text(file: &str, scene: &Scene, features: ProgramFeatures) -> String {
    let mut text = format!("{file}\n");
    let mut line = |heading: &str, value: &str| {
        // Writing to a string can't fail.
        let _ = writeln!(text, "{heading:<10} {value}");
    };
    line("triangles", &scene.geometry.triangles.len().to_string());
    line("vertices", &scene.geometry.positions.len().to_string());
    match world_bounds(scene) {
        None => line("bounds", "none: there are no triangles"),
        Some([min, max]) => {
            let (low, high) = (describe::triple(min), describe::triple(max));
            line("bounds", &format!("{low} to {high} m"));
        }
    }
    let origin = describe::triple(scene.frame.origin.rounded());
    let scale = describe::short(scene.frame.scale);
    line(
        "frame",
        &format!("origin {origin}, {scale} scene units a metre"),
    );
    line("nodes", &format!("{} with triangles", scene.nodes.len()));

    let frame = &scene.frame;
    let mut section = |heading: &str, entries: Vec<String>| {
        line(heading, &entries.len().to_string());
        for (index, entry) in entries.iter().enumerate() {
            line("", &format!("{index:>3}  {entry}"));
        }
    };
    section(
        "materials",
        scene
            .materials
            .iter()
            .map(|m| format!("'{}'  {}", m.name, describe::traits(m).join(", ")))
            .collect(),
    );
    section(
        "textures",
        scene.textures.iter().map(texture_text).collect(),
    );
    section(
        "images",
        scene
            .images
            .iter()
            .map(|image| format!("'{}'  {} x {}", image.name, image.width, image.height))
            .collect(),
    );
    section(
        "lights",
        scene
            .lights
            .iter()
            .map(|light| describe::light_text(light, frame))
            .collect(),
    );
    section(
        "cameras",
        scene
            .cameras
            .iter()
            .map(|camera| describe::camera_text(camera, frame))
            .collect(),
    );
    section(
        "warnings",
        scene.warnings.iter().map(Warning::to_string).collect(),
    );

    let (used, left_out) = features.labels();
    line("used", &used.join(", "));
    line("left out", &left_out.join(", "));
    text
}

fn texture_text(texture: &Texture) -> String {
    let (u, v) = (wrap_name(texture.wrap_u), wrap_name(texture.wrap_v));
    let encoding = if texture.srgb { "sRGB" } else { "linear" };
    format!(
        "image {}, {encoding}, {}, wrap {u} x {v}",
        texture.image,
        filter_name(texture.filter)
    )
}

fn wrap_name(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "repeat",
        Wrap::MirroredRepeat => "mirrored_repeat",
        Wrap::ClampToEdge => "clamp_to_edge",
    }
}

fn filter_name(filter: Filter) -> &'static str {
    match filter {
        Filter::Nearest => "nearest",
        Filter::Linear => "linear",
    }
}
