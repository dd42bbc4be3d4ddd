//! Inside out: mirrored by their node, wound the wrong way round, or both. Unlit squares side by side, so that a pixel says whether
//! its square is seen.

use glam::Vec3;
use raytree_gpu::RenderSettings;
use serde_json::{Value, json};

use super::file::File;
use crate::{
    report::Limit,
    scenes::pinhole,
    stage::{Stage, StressError},
};

/// A square: by which node it is placed, whether it is wound clockwise, whether both sides are seen; and what is to be seen.
struct Square {
    node: Value,
    clockwise: bool,
    double_sided: bool,
    seen: bool,
}

fn squares() -> Vec<Square> {
    let mirrored = json!({ "scale": [-1, 1, 1] });
    let thrice = json!({ "scale": [-1, -1, -1] });
    let twice = json!({ "scale": [-1, -1, 1] });
    let square = |node: &Value, clockwise, double_sided, seen| Square {
        node: node.clone(),
        clockwise,
        double_sided,
        seen,
    };
    let plain = json!({});
    vec![
        square(&plain, false, false, true),
        square(&plain, true, false, false),
        square(&plain, true, true, true),
        // A mirroring node turns the winding round and the file's readers turn it back (glTF 2.0, 3.7.4).
        square(&mirrored, false, false, true),
        square(&mirrored, true, false, false),
        square(&mirrored, true, true, true),
        square(&twice, false, false, true),
        // Through the origin: what faced +z faces -z.
        square(&thrice, false, false, false),
        square(&thrice, true, false, true),
    ]
}

const COLOR: [f32; 3] = [0.25, 0.5, 0.75];

fn file(squares: &[Square]) -> File {
    let mut file = File::new();
    for (square, k) in squares.iter().zip(0_u32..) {
        let material = file.push(
            "materials",
            json!({
                "pbrMetallicRoughness": { "baseColorFactor": [COLOR[0], COLOR[1], COLOR[2], 1] },
                "doubleSided": square.double_sided,
                "extensions": { "KHR_materials_unlit": {} },
            }),
        );
        let corner = |x: f32, y: f32| [0.4 * x, 0.4 * y, 0.0];
        let mut corners = vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        if square.clockwise {
            corners.reverse();
        }
        let mut node = square.node.clone();
        node["translation"] = json!([f64::from(k), 0, 0]);
        file.triangles(&corners, material, node);
    }
    file
}

pub(super) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let squares = squares();
    let scene = file(&squares).import()?;
    let count = squares.len() as u32;
    // One pixel looks at the middle of each square.
    let middle = scene
        .frame
        .to_scene(glam::DVec3::new(0.5 * f64::from(count - 1), 0.0, 0.0));
    let width = f64::from(count) * scene.frame.scale;
    let distance = 4.0;
    let yfov = 2.0 * (0.5 * width / f64::from(count) / distance).atan();
    let mut camera = pinhole(
        middle.as_vec3() + distance as f32 * Vec3::Z,
        middle.as_vec3(),
        yfov,
    );
    (camera.right, camera.up) = (glam::DVec3::X, glam::DVec3::Y);
    let film = stage
        .render(&scene, &RenderSettings::new(count, 1, camera))?
        .film;
    let expected: Vec<bool> = squares.iter().map(|square| square.seen).collect();
    stage.record(
        "mirrored by a node, wound the wrong way, both: squares seen from the wrong side",
        wrong_sides(&film.radiance, &expected) as f64,
        Limit::AtMost(0.0),
    );
    Ok(())
}

/// Pixels that show their square though they should not, or the other way round, or something else.
fn wrong_sides(pixels: &[[f32; 3]], seen: &[bool]) -> usize {
    let right = |(pixel, seen): (&[f32; 3], &bool)| *pixel == if *seen { COLOR } else { [0.0; 3] };
    seen.len() - pixels.iter().zip(seen).filter(|&pair| right(pair)).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The comparison has to be able to fail.
    #[test]
    fn a_wrong_side_is_noticed() {
        assert_eq!(wrong_sides(&[COLOR, [0.0; 3]], &[true, false]), 0);
        assert_eq!(wrong_sides(&[COLOR, [0.0; 3]], &[true, true]), 1);
        assert_eq!(wrong_sides(&[COLOR, COLOR], &[true, false]), 1);
        assert_eq!(wrong_sides(&[[f32::NAN; 3], [0.0; 3]], &[true, false]), 1);
        assert_eq!(wrong_sides(&[COLOR], &[true, false]), 1);
    }
}
