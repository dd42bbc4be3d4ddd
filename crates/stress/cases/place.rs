//! Our own scenes far from the world's origin, and a small thing anywhere on a large plane.

use glam::DVec3;
use raytree_gpu::RenderSettings;
use serde_json::json;

use super::scale::{Picture, renders_alike};
use crate::{
    documents::{Document, default_camera},
    judge::{judge_picture, largest_difference, worse},
    made::Made,
    report::Limit,
    stage::{Stage, StressError},
};

/// Of the issue.
const LIMIT: Limit = Limit::AtMost(1e-5);

/// Powers of ten of the distance, in extents of the scene.
const STEPS: std::ops::RangeInclusive<i32> = 0..=9;

/// The step that is rendered even where the scene is the same to the bit.
const RENDERED: i32 = 9;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for document in Document::own_scenes() {
        moved(stage, &document)?;
    }
    for lit in [false, true] {
        small_on_large(stage, lit)?;
    }
    Ok(())
}

fn moved(stage: &mut Stage<'_>, document: &Document) -> Result<(), StressError> {
    let unmoved = Picture::of(stage, document.import()?)?;
    let extent = unmoved.scene.frame.scale.recip();
    let (mut worst, mut scenes) = (0.0, 0);
    for step in STEPS {
        let far = extent * 10_f64.powi(step);
        for axis in DVec3::AXES {
            // An offset of few digits, and one that fills all 53 bits.
            for offset in [axis * far.ceil(), axis * far * std::f64::consts::SQRT_2] {
                let mut document = document.clone();
                document.hang_under(json!({ "translation": offset.to_array() }));
                let scene = document.import()?;
                let differs = !renders_alike(&scene, &unmoved.scene);
                scenes += u32::from(differs);
                if differs || (step == RENDERED && axis == DVec3::X) {
                    let film = Picture::of(stage, scene)?.film;
                    worst = worse(worst, largest_difference(&film, &unmoved.film));
                }
            }
        }
    }
    let (first, last) = (STEPS.start(), STEPS.end());
    stage.record_with(
        format!(
            "{} moved by 10^{first}..10^{last} extents: worst pixel",
            document.name
        ),
        worst,
        LIMIT,
        format!("{scenes} of the 60 scenes differ in a bit"),
    );
    Ok(())
}

/// Metres.
const PLANE: f32 = 1e6;
const THING: f32 = 1e-4;

/// Places on the plane, metres from its middle.
const PLACES: [[f64; 2]; 3] = [
    [1000.0, -3.0],
    [123_456.789, -398_765.432_1],
    [499_999.0, 499_999.0],
];

/// A cube of 10^-4 m that lies on a plane of 10^6 m, seen from three times its size away.
fn small_on_large(stage: &mut Stage<'_>, lit: bool) -> Result<(), StressError> {
    let look = if lit { "lit" } else { "unlit" };
    let at_middle = Picture::of(stage, thing_at([0.0, 0.0], lit).import()?)?;
    against_oracle(
        stage,
        &at_middle,
        format!("{look} thing in the middle of the plane"),
    );
    for place in PLACES {
        let picture = Picture::of(stage, thing_at(place, lit).import()?)?;
        let [x, z] = place;
        stage.record(
            format!("{look} thing at ({x}, {z}) m: worst pixel against the middle"),
            largest_difference(&picture.film, &at_middle.film),
            LIMIT,
        );
        against_oracle(stage, &picture, format!("{look} thing at ({x}, {z}) m"));
    }
    Ok(())
}

fn against_oracle(stage: &mut Stage<'_>, picture: &Picture, what: String) {
    let Picture { scene, film } = picture;
    let settings = RenderSettings::new(film.width, film.height, default_camera(scene));
    let judged = judge_picture(scene, &settings, film, 1e-3);
    stage.record_with(
        format!("{what}: pixels off the oracle's by 0.001 on no edge"),
        judged.unexplained.len() as f64,
        Limit::AtMost(0.0),
        format!(
            "{} on edges",
            judged.outliers.len() - judged.unexplained.len()
        ),
    );
}

fn thing_at([x, z]: [f64; 2], lit: bool) -> Document {
    let (size, half) = (f64::from(THING), 0.5 * PLANE);
    let mut made = Made::default();
    let material = |made: &mut Made, color: [f64; 3]| {
        let mut material = json!({ "pbrMetallicRoughness": {
            "baseColorFactor": [color[0], color[1], color[2], 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0
        }});
        if !lit {
            material["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        made.material(material)
    };
    let (pale, red) = (
        material(&mut made, [0.8, 0.8, 0.7]),
        material(&mut made, [0.9, 0.1, 0.1]),
    );
    let corners = [[-half, half], [half, half], [half, -half], [-half, -half]];
    made.mesh(&[corners.map(|[x, z]| [x, 0.0, z])], pale);
    made.mesh(
        &Made::cuboid(
            [-0.5 * THING, 0.0, -0.5 * THING],
            [0.5 * THING, THING, 0.5 * THING],
        ),
        red,
    );
    let eye = DVec3::new(1.1, 2.0, 2.1) * size;
    let camera = made.camera(eye, DVec3::Y * 0.4 * size, json!({ "yfov": 0.9 }));
    let plane = made.node(json!({ "mesh": 0 }));
    let thing = made.node(json!({ "mesh": 1 }));
    let spot = made.node(json!({ "translation": [x, 0.0, z], "children": [camera, thing] }));
    let sun = made.sun(DVec3::new(-1.0, -2.5, -0.4), 3.0);
    made.document("thing", &[plane, spot, sun])
}
