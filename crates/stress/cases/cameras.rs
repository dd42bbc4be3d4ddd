//! Extreme fields of view, and cameras in awkward places.

use glam::{DQuat, DVec3};
use raytree_gpu::RenderSettings;
use raytree_oracle::{Oracle, Settings};
use raytree_scene::{
    default_view::look_at,
    model::{Camera, Scene},
};
use serde_json::json;

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
    for name in ["cornell", "materials", "book"] {
        let Some(document) = own_scene(name) else {
            continue;
        };
        fields_of_view(stage, &document)?;
        far_away(stage, &document)?;
    }
    refused(stage);
    for (where_, eye) in AWKWARD {
        for tilted in [false, true] {
            let scene = room(eye, tilted).import()?;
            let how = if tilted { ", the room tilted" } else { "" };
            judge(
                stage,
                &scene,
                default_camera(&scene),
                &format!("camera {where_}{how}"),
            )?;
        }
    }
    Ok(())
}

fn own_scene(name: &str) -> Option<Document> {
    let mut all = Document::own_scenes().into_iter();
    all.find(|document| document.name == name)
}

fn fields_of_view(stage: &mut Stage<'_>, document: &Document) -> Result<(), StressError> {
    let scene = document.import()?;
    let usual = default_camera(&scene);
    let Some(corner) = visible_vertex(&scene, &usual) else {
        stage.fail(&document.name, "the camera sees no vertex");
        return Ok(());
    };
    for degrees in [NARROWEST, WIDEST] {
        // A tenth of the field beside the vertex, so that its edges run through the picture.
        let yfov = degrees.to_radians();
        let beside = 0.1 * yfov.min(1.0) * corner.distance(usual.position);
        let target = corner + beside * usual.right;
        let camera = look_at(usual.position, target, None, yfov, "extreme");
        match camera {
            Ok(camera) => {
                let what = format!("{}, {degrees} degrees, aimed at a vertex", document.name);
                judge(stage, &scene, camera, &what)?;
            }
            Err(error) => stage.fail(format!("{degrees} degrees"), error.to_string()),
        }
    }
    Ok(())
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
    if let Ok(folder) = std::env::var("SCALE_PICTURES") {
        crate::debug_write(&film, &format!("{folder}/{what}.png"));
    }
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
        let mut document = room([0.5; 3], false);
        for camera in document.elements("cameras") {
            *camera = json!({ "type": "orthographic", "orthographic": { "xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 9.0 } });
        }
        let (accepted, said) = match document.import() {
            Ok(_) => (1.0, "it was accepted".to_owned()),
            Err(error) => (
                f64::from(u8::from(!error.to_string().contains(named))),
                last_words(&error),
            ),
        };
        stage.record_with(
            format!("orthographic of {xmag} x {ymag}: not refused by name"),
            accepted,
            Limit::AtMost(0.0),
            said,
        );
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

/// Places in the room, whose inside is the unit cube and whose walls are a tenth thick.
const AWKWARD: [(&str, [f64; 3]); 5] = [
    ("on a vertex", [0.0, 0.0, 0.0]),
    ("on an edge", [0.0, 0.0, 0.3]),
    ("in the plane of a face", [0.4, 0.0, 0.3]),
    ("inside a wall", [0.4, -0.05, 0.3]),
    ("on an outer vertex", [1.1, 1.1, 1.1]),
];

/// A room of six boxes around the unit cube, each of its colour, with a lamp and a camera that looks at a box near its middle.
fn room(eye: [f64; 3], tilted: bool) -> Document {
    let mut made = Made::default();
    let (low, high) = (-0.1, 1.1);
    let slabs = [
        ([low, low, low], [0.0, high, high]),
        ([1.0, low, low], [high, high, high]),
        ([0.0, low, low], [1.0, 0.0, high]),
        ([0.0, 1.0, low], [1.0, high, high]),
        ([0.0, 0.0, low], [1.0, 1.0, 0.0]),
        ([0.0, 0.0, 1.0], [1.0, 1.0, high]),
        ([0.55, 0.4, 0.5], [0.7, 0.7, 0.65]),
    ];
    let mut children = Vec::new();
    for (number, (min, max)) in (0_u32..).zip(slabs) {
        let channel = |bit: u32| {
            if ((number + 1) >> bit) & 1 == 0 {
                0.25
            } else {
                0.8
            }
        };
        let color = [channel(0), channel(1), channel(2), 1.0];
        let material = made.material(json!({ "pbrMetallicRoughness": {
            "baseColorFactor": color, "metallicFactor": 0.0, "roughnessFactor": 1.0
        }}));
        let mesh = made.mesh(&Made::cuboid(min, max), material);
        children.push(made.node(json!({ "mesh": mesh })));
    }
    children.push(made.lamp(DVec3::new(0.35, 0.8, 0.45), 0.8));
    children.push(made.camera(
        eye.into(),
        DVec3::new(0.6, 0.5, 0.55),
        json!({ "yfov": 1.4 }),
    ));
    let turn = if tilted {
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7)
    } else {
        DQuat::IDENTITY
    };
    let root = made.node(json!({ "rotation": turn.to_array(), "children": children }));
    made.document("room", &[root])
}
