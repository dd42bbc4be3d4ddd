//! Extreme fields of view, and cameras in awkward places.

use glam::{DQuat, DVec3};
use raytree_gpu::RenderSettings;
use raytree_oracle::{Oracle, Settings};
use raytree_scene::model::{Camera, Scene};
use serde_json::{Value, json};

use crate::{
    documents::{Document, default_camera},
    judge::judge_picture,
    made::Made,
    report::Limit,
    stage::{Stage, StressError},
};

/// Pixels of the pictures.
const SIZE: (u32, u32) = (96, 72);

/// Of a picture's channel, from the oracle's.
const TOLERANCE: f64 = 1e-3;

/// Degrees.
const NARROWEST: f64 = 0.001;
const WIDEST: f64 = 179.9;

/// Extents between the scene and the camera that is far away.
const FAR: f64 = 1e6;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for name in ["cornell", "materials", "whitted-1980"] {
        let Some(document) = own_scene(name) else {
            continue;
        };
        narrowest(stage, &document)?;
        far_away(stage, &document)?;
    }
    narrowest(stage, &room([0.35, 0.6, 0.3], 80.0, false))?;
    let wide = room([0.35, 0.6, 0.3], WIDEST, false).import()?;
    let camera = default_camera(&wide);
    judge(stage, &wide, camera, &format!("room, {WIDEST} degrees"))?;
    refused(stage);
    for (where_, eye) in AWKWARD {
        // On an edge that is no axis' direction no f32 place is: the camera would be beside it, and judged as such it is dull.
        let turns: &[bool] = if where_ == "on an edge" {
            &[false]
        } else {
            &[false, true]
        };
        for &tilted in turns {
            let scene = room(eye, 80.0, tilted).import()?;
            let how = if tilted { ", the room tilted" } else { "" };
            let what = format!("camera {where_}{how}");
            if tilted {
                judge_nearby(stage, &scene, default_camera(&scene), &what)?;
            } else {
                judge(stage, &scene, default_camera(&scene), &what)?;
            }
        }
    }
    Ok(())
}

fn own_scene(name: &str) -> Option<Document> {
    let mut all = Document::own_scenes().into_iter();
    all.find(|document| document.name == name)
}

/// The narrowest field, aimed at a vertex: edges run through the picture. The file's own camera is turned, as an author would.
fn narrowest(stage: &mut Stage<'_>, document: &Document) -> Result<(), StressError> {
    let scene = document.import()?;
    let usual = default_camera(&scene);
    let Some(corner) = visible_vertex(&scene, &usual) else {
        stage.fail(&document.name, "the camera sees no vertex");
        return Ok(());
    };
    let yfov = NARROWEST.to_radians();
    let target = beside(&scene, &usual, corner, 0.1 * yfov);
    let [eye, target] = [usual.position, target].map(|point| scene.frame.to_world(point));
    let scene = with_camera(document, eye, target, yfov).import()?;
    let what = format!("{}, {NARROWEST} degrees, aimed at a vertex", document.name);
    judge(stage, &scene, default_camera(&scene), &what)
}

/// A point this angle beside the vertex, as seen from the camera, on a surface of about the same distance.
fn beside(scene: &Scene, camera: &Camera, vertex: DVec3, angle: f64) -> DVec3 {
    let step = angle * vertex.distance(camera.position);
    let sides = [camera.right, camera.up, -camera.right, -camera.up];
    let mut points = sides.into_iter().map(|side| vertex + step * side);
    let seen = points.find(|point| distance_along(scene, camera, *point) < 1.0 + 1e-3);
    seen.unwrap_or(vertex)
}

/// How far one sees from the camera through the point, in distances of the point.
fn distance_along(scene: &Scene, camera: &Camera, point: DVec3) -> f64 {
    let way = point - camera.position;
    let shading = Settings::new(1, 1).shading;
    let hit = Oracle::new(scene).closest_hit(camera.position.to_array(), way.to_array(), shading);
    hit.map_or(f64::INFINITY, |hit| hit.t)
}

/// The document seen by a camera at the root of the scene.
fn with_camera(document: &Document, eye: DVec3, target: DVec3, yfov: f64) -> Document {
    let mut document = document.clone();
    for node in document.elements("nodes") {
        if let Some(node) = node.as_object_mut() {
            node.remove("camera");
        }
    }
    for camera in document.elements("cameras") {
        *camera = json!({ "type": "perspective", "perspective": { "yfov": yfov, "znear": 0.1 } });
    }
    let roots = document.json["scenes"][0]["nodes"].take();
    let mut roots: Vec<Value> = roots.as_array().cloned().unwrap_or_default();
    roots.push(json!(document.elements("nodes").len()));
    document.json["scenes"][0]["nodes"] = roots.into();
    if let Some(nodes) = document.json["nodes"].as_array_mut() {
        nodes.push(Made::looking(eye, target, 0));
    }
    document
}

/// The vertex that the camera sees nearest to the middle of its picture.
fn visible_vertex(scene: &Scene, camera: &Camera) -> Option<DVec3> {
    let oracle = Oracle::new(scene);
    let shading = Settings::new(1, 1).shading;
    let from_axis = |vertex: &DVec3| (*vertex - camera.position).angle_between(camera.forward);
    let mut vertices: Vec<DVec3> = scene
        .geometry
        .positions
        .iter()
        .map(|v| v.as_dvec3())
        .collect();
    vertices.sort_by(|a, b| from_axis(a).total_cmp(&from_axis(b)));
    vertices.into_iter().find(|vertex| {
        let way = *vertex - camera.position;
        let hit = oracle.closest_hit(camera.position.to_array(), way.to_array(), shading);
        hit.is_some_and(|hit| (hit.t - 1.0).abs() < 1e-6)
    })
}

/// The camera moved back along its axis, its field made so narrow that the picture stays as wide as the scene; and 0.001 degrees.
fn far_away(stage: &mut Stage<'_>, document: &Document) -> Result<(), StressError> {
    let near = document.import()?;
    let usual = default_camera(&near);
    let eye = near.frame.to_world(usual.position - FAR * usual.forward);
    for degrees in [(0.5 / FAR).atan().to_degrees(), NARROWEST] {
        let mut document = document.clone();
        for camera in document.elements("cameras") {
            camera["perspective"]["yfov"] = json!(degrees.to_radians());
        }
        for node in document.elements("nodes") {
            if node.get("camera").is_some() {
                node["translation"] = json!(eye.to_array());
            }
        }
        let scene = document.import()?;
        let what = format!(
            "{}, {degrees:.2e} degrees from {FAR:e} extents away",
            document.name
        );
        judge(stage, &scene, default_camera(&scene), &what)?;
    }
    Ok(())
}

fn judge(
    stage: &mut Stage<'_>,
    scene: &Scene,
    camera: Camera,
    what: &str,
) -> Result<(), StressError> {
    let settings = RenderSettings::new(SIZE.0, SIZE.1, camera);
    let film = stage.render(scene, &settings)?.film;
    let judged = judge_picture(scene, &settings, &film, TOLERANCE);
    let colours = colours(&judged.theirs.radiance);
    stage.record_with(
        format!("{what}: pixels off the oracle's by {TOLERANCE} on no edge"),
        judged.unexplained.len() as f64,
        Limit::AtMost(0.0),
        format!(
            "{} on edges; the picture has {colours} colours",
            judged.outliers.len() - judged.unexplained.len()
        ),
    );
    Ok(())
}

/// Rounding puts the camera before or behind faces whose planes, turned, it lies in: the picture has to be that of some place
/// within this distance, scene space, of f32's roundings. The whole picture, of one place.
const NEARBY: f64 = 2e-7;

fn judge_nearby(
    stage: &mut Stage<'_>,
    scene: &Scene,
    camera: Camera,
    what: &str,
) -> Result<(), StressError> {
    let settings = RenderSettings::new(SIZE.0, SIZE.1, camera);
    let film = stage.render(scene, &settings)?.film;
    let places = (0..27).map(|k| {
        let step = |power: u32| f64::from(k / 3_i32.pow(power) % 3 - 1);
        NEARBY * DVec3::new(step(0), step(1), step(2))
    });
    let fewest = places.map(|shift| {
        let mut settings = settings.clone();
        settings.camera.position += shift;
        judge_picture(scene, &settings, &film, TOLERANCE)
            .unexplained
            .len()
    });
    stage.record(
        format!("{what}: pixels off the oracle's from a place within {NEARBY:e}"),
        fewest.min().map_or(f64::NAN, |fewest| fewest as f64),
        Limit::AtMost(0.0),
    );
    Ok(())
}

/// How many colours differ: a picture of one would prove little.
fn colours(radiance: &[[f64; 3]]) -> usize {
    let mut all: Vec<_> = radiance
        .iter()
        .map(|rgb| rgb.map(|c| (c * 1e3).round() as i64))
        .collect();
    all.sort_unstable();
    all.dedup();
    all.len()
}

/// Parallel views without a size are errors that name it.
fn refused(stage: &mut Stage<'_>) {
    for (xmag, ymag, named) in [
        (0.0, 0.0, "mag is 0"),
        (0.0, 1.0, "xmag is 0"),
        (1.0, 0.0, "ymag is 0"),
    ] {
        let (refused, said) = is_refused(xmag, ymag, named);
        stage.record_with(
            format!("orthographic of {xmag} x {ymag}: not refused by name"),
            f64::from(u8::from(!refused)),
            Limit::AtMost(0.0),
            said,
        );
    }
}

/// Is a parallel view of this size refused with an error that says `named`? And what was said.
fn is_refused(xmag: f64, ymag: f64, named: &str) -> (bool, String) {
    let mut document = room([0.5; 3], 80.0, false);
    let lens = json!({ "xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 9.0 });
    for camera in document.elements("cameras") {
        *camera = json!({ "type": "orthographic", "orthographic": lens });
    }
    match document.import() {
        Ok(_) => (false, "it was accepted".to_owned()),
        Err(error) => (error.to_string().contains(named), last_words(&error)),
    }
}

/// Of an error, without the temporary file's name.
fn last_words(error: &StressError) -> String {
    let text = error.to_string();
    text.rsplit_once(".glb")
        .map_or(text.as_str(), |(_, words)| words)
        .trim_start_matches([':', ',', ' '])
        .to_owned()
}

/// Places in the room, whose inside is the unit cube and whose walls are an eighth thick; in f32 too.
const AWKWARD: [(&str, [f64; 3]); 5] = [
    ("on a vertex", [0.0, 0.0, 0.0]),
    ("on an edge", [0.0, 0.0, 0.3]),
    ("in the plane of a face", [0.4, 0.0, 0.3]),
    ("inside a wall", [0.4, -0.05, 0.3]),
    ("on an outer vertex", [1.125, 1.125, 1.125]),
];

/// A room with thick walls: inwards the unit cube, each side of its own colour, outwards a larger one; with a lamp, and a camera
/// that looks at a box near its middle.
fn room(eye: [f64; 3], degrees: f64, tilted: bool) -> Document {
    let mut made = Made::default();
    let inwards = Made::cuboid([0.0; 3], [1.0; 3]).map(|[a, b, c, d]| vec![[d, c, b, a]]);
    let outwards = Made::cuboid([-0.125; 3], [1.125; 3]).to_vec();
    let block = Made::cuboid([0.55, 0.4, 0.5], [0.7, 0.7, 0.65]).to_vec();
    let parts = inwards.into_iter().chain([outwards, block]);
    let mut children = Vec::new();
    for (number, quads) in (1_u32..).zip(parts) {
        let channel = |bit: u32| if (number >> bit) & 1 == 0 { 0.25 } else { 0.8 };
        let color = [channel(0), channel(1), channel(2), 1.0];
        let material = made.material(json!({ "pbrMetallicRoughness": {
            "baseColorFactor": color, "metallicFactor": 0.0, "roughnessFactor": 1.0
        }}));
        let mesh = made.mesh(&quads, material);
        children.push(made.node(json!({ "mesh": mesh })));
    }
    children.push(made.lamp(DVec3::new(0.35, 0.8, 0.45), 0.8));
    children.push(made.camera(
        eye.into(),
        DVec3::new(0.6, 0.5, 0.55),
        json!({ "yfov": degrees.to_radians() }),
    ));
    let turn = if tilted {
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7)
    } else {
        DQuat::IDENTITY
    };
    let root = made.node(json!({ "rotation": turn.to_array(), "children": children }));
    made.document("room", &[root])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_told_apart() {
        assert_eq!(colours(&[]), 0);
        assert_eq!(colours(&[[0.5; 3], [0.5001; 3], [0.5, 0.5, 0.6]]), 2);
    }

    #[test]
    fn a_view_without_size_is_refused_by_name_and_no_other_is() {
        assert!(!is_refused(1.0, 1.0, "mag").0);
        assert!(is_refused(1.0, 0.0, "ymag is 0").0);
        assert!(!is_refused(1.0, 0.0, "xmag is 0").0);
    }

    #[test]
    fn a_visible_vertex_is_one() {
        let scene = room([0.35, 0.6, 0.3], 80.0, false).import().unwrap();
        let camera = default_camera(&scene);
        let vertex = visible_vertex(&scene, &camera).unwrap();
        let positions = scene.geometry.positions.iter();
        assert!(positions.map(|v| v.as_dvec3()).any(|v| v == vertex));
        assert!((vertex - camera.position).normalize().dot(camera.forward) > 0.9);
    }
}
