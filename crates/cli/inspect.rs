//! `raytree inspect`: what a scene contains, what a program for it would and why, and what that costs.

use std::fmt::Write;

use glam::DVec3;
use raytree::model::{Filter, Texture, Warning, Wrap};
use raytree::{
    Cost, Feature, Preset, ProgramFeatures, RenderError, RenderSettings, RepeatedMesh, Scene,
    SceneFeatures, WhyCopied, default_camera, default_size, light_if_dark, simplify,
};
use serde_json::{Map, Value, json};

use crate::args::InspectArgs;
use crate::console::{print, print_json};
use crate::describe;

pub fn run(args: &InspectArgs) -> anyhow::Result<()> {
    // What the file says; the plan is made for what of it can show.
    let scene = raytree::import_unsimplified(&args.scene)?;
    let plan = Plan::of(&scene);
    let file = args.scene.display().to_string();
    if args.json {
        print_json(&as_json(&file, &scene, &plan))?;
    } else {
        print(&as_text(&file, &scene, &plan))?;
    }
    Ok(())
}

/// What a plain `raytree scene.glb` would do.
struct Plan {
    features: ProgramFeatures,
    cost: Result<Cost, RenderError>,
}

impl Plan {
    fn of(scene: &Scene) -> Self {
        let mut lit = scene.clone();
        simplify(&mut lit);
        light_if_dark(&mut lit);
        let camera = default_camera(&lit);
        let (width, height) = default_size(&camera);
        let settings = RenderSettings::new(width, height, camera);
        let features = ProgramFeatures::of(&SceneFeatures::of(&lit), &settings);
        let bvh = raytree::build_bvh(&lit, Preset::default());
        let cost = bvh
            .map_err(RenderError::from)
            .and_then(|bvh| raytree::cost(&lit, &bvh, &settings, features));
        Self { features, cost }
    }
}

/// Metres.
fn world_bounds(scene: &Scene) -> Option<[DVec3; 2]> {
    let (min, max) = scene.bounds()?;
    Some([min, max].map(|corner| scene.frame.to_world(corner)))
}

fn as_json(file: &str, scene: &Scene, plan: &Plan) -> Value {
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
    let (used, left_out) = plan.features.labels();
    let reason = |feature: Feature| feature.reason(plan.features.has(feature)).into();
    let reasons: Map<String, Value> = Feature::ALL
        .iter()
        .map(|&feature| (feature.label().to_owned(), reason(feature)))
        .collect();
    json!({
        "file": file,
        "triangles": scene.geometry.triangles.len(),
        "placed_triangles": scene.placed_triangles(),
        "repeated_meshes": repeated_json(scene),
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
        "features": { "used": used, "left_out": left_out, "reasons": reasons },
        "cost": cost_json(&plan.cost),
        "warnings": warnings,
    })
}

/// Of a triangle's copy on the device, at least: corners, normal, and what a hit looks up.
const COPY_BYTES: u64 = 68;

/// What sharing a mesh saves on the device, hierarchy and attributes left out.
fn saved_bytes(mesh: &RepeatedMesh) -> u64 {
    mesh.sharing.saturating_sub(1) as u64 * mesh.triangles as u64 * COPY_BYTES
}

fn repeated_json(scene: &Scene) -> Vec<Value> {
    let entry = |mesh: &RepeatedMesh| {
        json!({
            "mesh": mesh.name,
            "nodes": mesh.nodes,
            "triangles": mesh.triangles,
            "sharing": mesh.sharing,
            "saved_bytes": saved_bytes(mesh),
            "copied": mesh.copied.map(WhyCopied::reason),
        })
    };
    scene.repeated.iter().map(entry).collect()
}

fn repeated_text(mesh: &RepeatedMesh) -> String {
    let RepeatedMesh {
        name,
        nodes,
        triangles,
        sharing,
        copied,
    } = mesh;
    let mut text = format!("'{name}'  {triangles} triangles, {nodes} nodes");
    if *sharing > 0 {
        let saved = size(saved_bytes(mesh));
        text += &format!(", shared by {sharing}: {saved} saved");
    }
    if let Some(why) = copied {
        text += &format!(", {} copied: {}", nodes - sharing, why.reason());
    }
    text
}

fn texture_json(texture: &Texture) -> Value {
    json!({
        "image": texture.image,
        "wrap": [wrap_name(texture.wrap_u), wrap_name(texture.wrap_v)],
        "filter": filter_name(texture.filter),
        "srgb": texture.srgb,
    })
}

fn as_text(file: &str, scene: &Scene, plan: &Plan) -> String {
    let mut text = format!("{file}\n");
    let mut line = |heading: &str, value: &str| {
        // Writing to a string can't fail.
        let _ = writeln!(text, "{heading:<10} {value}");
    };
    let (stored, seen) = (
        scene.geometry.triangles.len() as u64,
        scene.placed_triangles(),
    );
    if stored == seen {
        line("triangles", &stored.to_string());
    } else {
        line("triangles", &format!("{stored}, of which {seen} are seen"));
    }
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
        "repeated",
        scene.repeated.iter().map(repeated_text).collect(),
    );
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

    let (used, left_out) = plan.features.used_and_left_out();
    for (heading, features, present) in [("used", used, true), ("left out", left_out, false)] {
        line(heading, &features.len().to_string());
        for feature in features {
            let (label, reason) = (feature.label(), feature.reason(present));
            line("", &format!("     {label:<33} {reason}"));
        }
    }
    for (heading, value) in cost_lines(&plan.cost) {
        line(heading, &value);
    }
    text
}

fn cost_json(cost: &Result<Cost, RenderError>) -> Value {
    match cost {
        Err(error) => json!({ "error": error.to_string() }),
        Ok(cost) => {
            let buffers: Map<String, Value> = cost
                .buffers
                .iter()
                .map(|buffer| (buffer.name.clone(), buffer.bytes.into()))
                .collect();
            json!({
                "spirv_words": cost.spirv_words,
                "bindings": cost.buffers.len(),
                "bytes": cost.bytes(),
                "buffers": buffers,
                "triangle_bytes": cost.triangle_bytes,
                "traversal_stack": cost.traversal_stack,
                "ray_stack": cost.ray_stack,
                "pixel_bytes": cost.pixel_bytes,
                "batch_pixels": cost.batch_pixels,
            })
        }
    }
}

fn cost_lines(cost: &Result<Cost, RenderError>) -> Vec<(&'static str, String)> {
    let cost = match cost {
        Ok(cost) => cost,
        Err(error) => return vec![("cost", format!("can't be rendered: {error}"))],
    };
    let program = format!(
        "{} SPIR-V words, {} bindings",
        cost.spirv_words,
        cost.buffers.len()
    );
    let memory = format!(
        "{}, {:.0} bytes of geometry a triangle",
        size(cost.bytes()),
        cost.triangle_bytes
    );
    let stacks = format!(
        "{} entries for traversal; {} rays or {} a pixel, {} pixels at a time",
        cost.traversal_stack,
        cost.ray_stack,
        size(cost.pixel_bytes),
        cost.batch_pixels
    );
    let buffers = cost.buffers.iter().map(|buffer| {
        (
            "",
            format!("     {:<15} {}", buffer.name, size(buffer.bytes)),
        )
    });
    let mut lines = vec![("program", program), ("memory", memory)];
    lines.extend(buffers);
    lines.push(("stacks", stacks));
    lines
}

/// Bytes as people read them.
fn size(bytes: u64) -> String {
    match bytes {
        0..1024 => format!("{bytes} bytes"),
        1024..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0)),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_that_many_nodes_show_says_what_became_of_it() {
        let mesh = |sharing, copied| RepeatedMesh {
            name: "tree".to_owned(),
            nodes: 12,
            triangles: 1000,
            sharing,
            copied,
        };
        assert_eq!(
            repeated_text(&mesh(11, Some(WhyCopied::Placement))),
            "'tree'  1000 triangles, 12 nodes, shared by 11: 664.1 KiB saved, 1 copied: nodes flatten, stretch or shrink it too far"
        );
        assert_eq!(
            repeated_text(&mesh(0, Some(WhyCopied::Small))),
            "'tree'  1000 triangles, 12 nodes, 12 copied: copies cost less than the rays' longer way"
        );
        assert_eq!(saved_bytes(&mesh(12, None)), 11 * 1000 * COPY_BYTES);
        let scene = Scene {
            repeated: vec![mesh(0, Some(WhyCopied::SeenThrough))],
            ..Scene::default()
        };
        let json = &repeated_json(&scene)[0];
        assert_eq!(
            (&json["saved_bytes"], &json["nodes"]),
            (&json!(0), &json!(12))
        );
        assert_eq!(json["copied"], WhyCopied::SeenThrough.reason());
    }

    #[test]
    fn sizes_have_the_unit_that_fits() {
        assert_eq!(size(1023), "1023 bytes");
        assert_eq!(size(1536), "1.5 KiB");
        assert_eq!(size(3 << 20), "3.0 MiB");
    }

    #[test]
    fn what_cannot_be_rendered_says_why() {
        let failed = Err(RenderError::Settings("too much".to_owned()));
        assert_eq!(cost_lines(&failed)[0].1, "can't be rendered: too much");
        assert_eq!(cost_json(&failed)["error"], "too much");
    }
}
