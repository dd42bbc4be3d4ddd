//! Single rays whose way through solids is known on paper: Snell's law from surface to surface, in f64. Nothing is reflected
//! (the materials' specular factor is 0), so what a ray brings back is the sky in the direction in which it leaves.

use glam::{DVec3, Quat, Vec3};
use raytree_scene::model::Scene;

use super::scenes::{Blocks, Cut, SLOPE, ray, slanted, solid};
use crate::{
    judge::worse,
    report::Limit,
    stage::{Stage, StressError},
};

/// Radians.
const DIRECTION: f64 = 1e-5;

const WATER: f64 = 1.33;
const GLASS: f64 = 1.5;

/// A surface on a ray's way: its normal, whichever side it points to, and the index beyond.
#[derive(Clone, Copy)]
struct Step {
    normal: DVec3,
    index: f64,
}

/// Snell's law in vectors; `None` in total internal reflection.
fn refracted(direction: DVec3, normal: DVec3, from: f64, to: f64) -> Option<DVec3> {
    let facing = if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    };
    let cos = -facing.dot(direction);
    let ratio = from / to;
    let left = 1.0 - ratio * ratio * (1.0 - cos * cos);
    (left > 0.0).then(|| ratio * direction + (ratio * cos - left.sqrt()) * facing)
}

/// Where a ray in a medium of index `index` goes after all steps.
fn through(direction: DVec3, mut index: f64, steps: &[Step]) -> Option<DVec3> {
    steps.iter().try_fold(direction, |direction, step| {
        let next = refracted(direction, step.normal, index, step.index);
        index = step.index;
        next
    })
}

/// A ray that starts within `scene`, and where it should leave to.
struct Way {
    from: Vec3,
    direction: DVec3,
    leaves: DVec3,
}

/// By how much the way that was taken differs from the paper's, radians.
fn deviation(stage: &mut Stage<'_>, scene: &Scene, way: &Way) -> Result<f64, StressError> {
    let seen = stage
        .render(scene, &ray(way.from, way.direction))?
        .film
        .radiance[0];
    let empty = Blocks::new(Quat::IDENTITY).build.0;
    let sky = stage
        .render(&empty, &ray(Vec3::ZERO, way.leaves))?
        .film
        .radiance[0];
    Ok(angle_between(seen, sky))
}

/// How far apart two places of the sky are that look like this.
fn angle_between(a: [f32; 3], b: [f32; 3]) -> f64 {
    let channels = [0, 1, 2].map(|k| (f64::from(a[k]) - f64::from(b[k])).abs() / SLOPE);
    channels.into_iter().fold(0.0, worse)
}

pub(super) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    shared_face(stage)?;
    windows(stage)?;
    lens_of_air(stage)
}

/// From water into glass through the face that they share, beyond water's critical angle against air, and back.
fn shared_face(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (name, turn, cut) in [
        (
            "a shared face, same triangles",
            Quat::IDENTITY,
            Cut::Diagonal,
        ),
        (
            "a shared face, the other diagonal",
            Quat::IDENTITY,
            Cut::Across,
        ),
        ("a shared face, a fan, slanted", slanted(), Cut::Fan),
    ] {
        let mut blocks = Blocks::new(turn);
        let [water, glass] =
            [WATER, GLASS].map(|n| blocks.build.material(solid(n as f32, 0.0, 0.0)));
        blocks.block(
            Vec3::new(-0.7, -0.5, -0.4),
            Vec3::new(0.0, 0.5, 0.4),
            water,
            Cut::Diagonal,
        );
        blocks.block(
            Vec3::new(0.0, -0.5, -0.4),
            Vec3::new(0.6, 0.5, 0.4),
            glass,
            cut,
        );
        let to_space = turn.as_dquat();
        let (beside, above) = (to_space * DVec3::X, to_space * DVec3::Y);
        let mut farthest = 0.0_f64;
        for degrees in [20.0_f64, 50.0, 58.0, 65.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let into_glass = to_space * DVec3::new(cos, sin, 0.013).normalize();
            let steps = [
                Step {
                    normal: beside,
                    index: GLASS,
                },
                Step {
                    normal: if degrees < 45.0 { beside } else { above },
                    index: 1.0,
                },
            ];
            // So that it comes to the shared face near its upper end, or in its middle.
            let height = if degrees < 45.0 { 0.1 } else { 0.41 };
            let start = DVec3::new(-0.12, height - 0.12 * sin / cos, 0.03);
            if let Some(leaves) = through(into_glass, WATER, &steps) {
                let from = (to_space * start).as_vec3();
                farthest = worse(
                    farthest,
                    deviation(
                        stage,
                        &blocks.build.0,
                        &Way {
                            from,
                            direction: into_glass,
                            leaves,
                        },
                    )?,
                );
            }
        }
        // From glass into water, and out at its far side.
        for degrees in [10.0_f64, 25.0, 35.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let direction = to_space * DVec3::new(-cos, -sin, 0.021).normalize();
            let from = (to_space * DVec3::new(0.2, 0.3, 0.02)).as_vec3();
            let steps = [WATER, 1.0].map(|index| Step {
                normal: beside,
                index,
            });
            if let Some(leaves) = through(direction, GLASS, &steps) {
                farthest = worse(
                    farthest,
                    deviation(
                        stage,
                        &blocks.build.0,
                        &Way {
                            from,
                            direction,
                            leaves,
                        },
                    )?,
                );
            }
        }
        stage.record(
            format!("{name}: direction, rad"),
            farthest,
            Limit::AtMost(DIRECTION),
        );
    }
    Ok(())
}

/// Snell's window: out of the water that the camera is in, and out of glass in that water.
fn windows(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut blocks = Blocks::new(Quat::IDENTITY);
    let [water, glass] = [WATER, GLASS].map(|n| blocks.build.material(solid(n as f32, 0.0, 0.0)));
    blocks.block(Vec3::splat(-0.6), Vec3::splat(0.6), water, Cut::Diagonal);
    blocks.block(
        Vec3::splat(-0.2),
        Vec3::new(0.2, 0.1, 0.2),
        glass,
        Cut::Diagonal,
    );
    let scene = blocks.build.0;
    let surface = Step {
        normal: DVec3::Y,
        index: 1.0,
    };
    let [mut in_water, mut in_glass] = [0.0_f64; 2];
    for degrees in [0.0_f64, 15.0, 30.0, 40.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let direction = DVec3::new(0.8 * sin, cos, 0.6 * sin);
        if let Some(leaves) = through(direction, WATER, &[surface]) {
            let from = Vec3::new(-0.1, 0.21, -0.04);
            in_water = worse(
                in_water,
                deviation(
                    stage,
                    &scene,
                    &Way {
                        from,
                        direction,
                        leaves,
                    },
                )?,
            );
        }
        let steps = [
            Step {
                index: WATER,
                ..surface
            },
            surface,
        ];
        if let Some(leaves) = through(direction, GLASS, &steps) {
            let from = Vec3::new(-0.01, 0.03, 0.02);
            in_glass = worse(
                in_glass,
                deviation(
                    stage,
                    &scene,
                    &Way {
                        from,
                        direction,
                        leaves,
                    },
                )?,
            );
        }
    }
    stage.record(
        "camera in water: direction, rad",
        in_water,
        Limit::AtMost(DIRECTION),
    );
    stage.record(
        "camera in glass in water: direction, rad",
        in_glass,
        Limit::AtMost(DIRECTION),
    );
    Ok(())
}

/// A bubble in a block of glass, from inside of the glass, through two of the bubble's vertices, where a ball of triangles is a ball.
fn lens_of_air(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (name, inwards) in [
        (
            "a bubble, the glass's surface turned inwards: direction, rad",
            true,
        ),
        ("a bubble, a solid of index 1: direction, rad", false),
    ] {
        let mut blocks = Blocks::new(Quat::IDENTITY);
        let [glass, air] = [GLASS, 1.0].map(|n| blocks.build.material(solid(n as f32, 0.0, 0.0)));
        blocks.block(Vec3::splat(-0.6), Vec3::splat(0.6), glass, Cut::Diagonal);
        let geometry = &blocks.build.0.geometry;
        let (vertex, triangle) = (geometry.positions.len(), geometry.triangles.len());
        blocks
            .build
            .ball(Vec3::ZERO, 0.3, 3, if inwards { glass } else { air });
        let geometry = &mut blocks.build.0.geometry;
        let corners: Vec<DVec3> = geometry.positions[vertex..]
            .iter()
            .map(|p| p.as_dvec3())
            .collect();
        if inwards {
            geometry.triangles[triangle..]
                .iter_mut()
                .for_each(|t| t.vertices.reverse());
            geometry.normals[vertex..].iter_mut().for_each(|n| *n = -*n);
        }
        let (mut farthest, mut ways) = (0.0_f64, 0);
        for k in 0..corners.len() {
            let chord = (corners[k], corners[(31 * k + 97) % corners.len()]);
            if k % 9 == 0
                && let Some(way) = through_bubble(chord)
            {
                farthest = worse(farthest, deviation(stage, &blocks.build.0, &way)?);
                ways += 1;
            }
        }
        if ways < 5 {
            stage.fail(
                name,
                format!("only {ways} ways through the bubble were found"),
            );
        } else {
            stage.record_with(
                name,
                farthest,
                Limit::AtMost(DIRECTION),
                format!("{ways} ways"),
            );
        }
    }
    Ok(())
}

/// The ray in glass that runs along `chord` in a bubble around the origin; it leaves through a side of the block around it.
fn through_bubble((a, b): (DVec3, DVec3)) -> Option<Way> {
    let along = (b - a).try_normalize()?;
    // Neither close to grazing, nor through facets that face away.
    let steepness = -along.dot(a.normalize());
    if !(0.75..0.97).contains(&steepness) {
        return None;
    }
    let direction = -refracted(-along, a.normalize(), 1.0, GLASS)?;
    let behind = through(
        along,
        1.0,
        &[Step {
            normal: b.normalize(),
            index: GLASS,
        }],
    )?;
    // The side through which it leaves, well away from the block's edges.
    let sizes = behind.abs().to_array();
    let axis = (0..3).max_by(|&i, &j| sizes[i].total_cmp(&sizes[j]))?;
    let t = (0.6 * behind[axis].signum() - b[axis]) / behind[axis];
    let out = b + t * behind;
    if (0..3).any(|k| k != axis && out[k].abs() > 0.58) {
        return None;
    }
    let leaves = refracted(behind, DVec3::AXES[axis], GLASS, 1.0)?;
    let from = (a - 0.1 * direction).as_vec3();
    // From where f32 has the camera to the very vertex.
    let direction = (a - from.as_dvec3()).normalize();
    Some(Way {
        from,
        direction,
        leaves,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_knows_snell() {
        let down = DVec3::new(0.6, -0.8, 0.0);
        let inside = refracted(down, DVec3::Y, 1.0, 1.5).unwrap();
        assert!((inside - DVec3::new(0.4, -(0.84_f64).sqrt(), 0.0)).length() < 1e-15);
        let steps = [1.5, 1.33, 1.0].map(|index| Step {
            normal: DVec3::Y,
            index,
        });
        assert!((through(down, 1.0, &steps).unwrap() - down).length() < 1e-15);
        assert!(refracted(-DVec3::new(0.8, -0.6, 0.0), DVec3::Y, 1.5, 1.0).is_none());
    }

    #[test]
    fn another_direction_is_noticed() {
        assert_eq!(angle_between([0.5; 3], [0.5; 3]), 0.0);
        assert!(angle_between([0.5, 0.50001, 0.5], [0.5; 3]) > DIRECTION);
        assert!(angle_between([0.5, f32::NAN, 0.5], [0.5; 3]).is_nan());
    }
}
