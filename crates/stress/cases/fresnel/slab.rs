//! Through parallel slabs, nested in each other, a ray leaves as it came, whatever the indices.
//!
//! The surroundings tell the direction: their map holds its own coordinates, of which bilinear filtering loses nothing.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, EulerRot, Vec3};
use raytree_film::Film;
use raytree_gpu::{RenderSettings, Shading};
use raytree_scene::{
    environment::EquirectMap,
    model::{Background, Camera, Material, WhittedCoefficients},
};

use super::{INDICES, twin::angle};
use crate::{
    report::Limit,
    scenes::{Build, parallel, pinhole, unfiltered},
    stage::{Stage, StressError},
};

/// Of the map.
const SIZE: [u32; 2] = [64, 32];

/// How the slabs lie: along no axis.
fn orientation() -> DMat3 {
    DMat3::from_euler(EulerRot::YXZ, 0.7, 0.4, 0.3)
}

pub(super) fn measure(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let wide = wide_view();
    let unbent = directions(&stage.render(&surroundings().0, &wide)?.film);
    for outer in [1.0, 1.33] {
        for inner in INDICES {
            let mut worst: f64 = 0.0;
            for thickness in [2e-2, 1e-4] {
                let build = slabs(outer, inner, thickness);
                let bent = directions(&stage.render(&build.0, &wide)?.film);
                worst = worst.max(turned(&unbent, &bent));
            }
            let parameter = format!("slab of {inner} in {outer}, up to 89 degrees: turned, rad");
            stage.record(parameter, worst, Limit::AtMost(1e-5));
        }
    }
    for nearness in [1e-3, 1e-4, 1e-5] {
        let worst = grazing(stage, nearness)?;
        let parameter = format!("slab of 1.5, {nearness:e} rad from grazing: turned, rad");
        if nearness > 1e-5 {
            stage.record(parameter, worst, Limit::AtMost(1e-5));
        } else {
            let beyond = grazing(stage, 0.1 * nearness)?;
            let note = format!(
                "1e-6 rad from grazing: {beyond:.2e}. A direction inside has 34 bits, and cos^2 is 1e-12 there"
            );
            stage.record_with(parameter, worst, Limit::AtMost(1e-5), note);
        }
    }
    Ok(())
}

fn grazing(stage: &mut Stage<'_>, nearness: f64) -> Result<f64, StressError> {
    let view = grazing_view(nearness);
    let unbent = directions(&stage.render(&surroundings().0, &view)?.film);
    let bent = directions(&stage.render(&slabs(1.0, 1.5, 1e-4).0, &view)?.film);
    Ok(turned(&unbent, &bent))
}

/// Rays at 1 to 89 degrees from the slabs' normal.
fn wide_view() -> RenderSettings {
    let up = orientation().y_axis;
    let along = orientation().z_axis;
    let eye = 0.02 * up;
    let target = eye + along - up;
    view(
        [6, 89],
        pinhole(eye.as_vec3(), target.as_vec3(), 88_f64.to_radians()),
    )
}

/// Parallel rays, this far from the slabs' plane.
fn grazing_view(nearness: f64) -> RenderSettings {
    let (up, along) = (orientation().y_axis, orientation().z_axis);
    let forward = nearness.cos() * along - nearness.sin() * up;
    view(
        [4, 4],
        Camera {
            position: -forward,
            right: orientation().x_axis,
            up: orientation().x_axis.cross(forward),
            forward,
            ..parallel(Vec3::ZERO, Vec3::Z, 1e-7)
        },
    )
}

fn view([width, height]: [u32; 2], camera: Camera) -> RenderSettings {
    RenderSettings {
        shading: Shading::Whitted,
        ..RenderSettings::new(width, height, camera)
    }
}

/// Nothing but a map of its own coordinates.
fn surroundings() -> Build {
    let [width, height] = SIZE;
    let texels = (0..width * height)
        .map(|k| {
            let (i, j) = (k % width, k / width);
            [
                (i as f32 + 0.5) / width as f32,
                (j as f32 + 0.5) / height as f32,
                0.0,
            ]
        })
        .collect();
    let mut build = Build::before([0.0; 3]);
    let mut environment = unfiltered(EquirectMap {
        width,
        height,
        texels,
    });
    environment.rotation = 0.0;
    build.0.surroundings.background = Background::Environment;
    build.0.surroundings.environment = Some(environment);
    build
}

/// A slab of index `inner` between two layers of index `outer`, all as thick, the upper face below the origin.
fn slabs(outer: f32, inner: f32, thickness: f64) -> Build {
    let mut build = surroundings();
    let nested = outer != 1.0;
    if nested {
        add_slab(&mut build, outer, [0.0, 3.0 * thickness]);
    }
    let depth = if nested { thickness } else { 0.0 };
    add_slab(&mut build, inner, [depth, depth + thickness]);
    build
}

/// Faces at two depths below the plane through the origin, wide enough for all rays.
fn add_slab(build: &mut Build, ior: f32, depths: [f64; 2]) {
    const HALF: f64 = 8.0;
    let material = build.material(clear(ior));
    let [right, up, along] = [
        orientation().x_axis,
        orientation().y_axis,
        orientation().z_axis,
    ];
    for (depth, facing) in depths.into_iter().zip([1.0, -1.0]) {
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let [a, b, c, d] = corners.map(|(x, z): (f64, f64)| {
            let point = -depth * up + HALF * (facing * x * right + z * along);
            build.vertex(point.as_vec3(), (facing * up).as_vec3())
        });
        build.triangle([a, b, c], material);
        build.triangle([a, c, d], material);
    }
}

/// Lets all light through, by the book's coefficients, and bends it.
fn clear(ior: f32) -> Material {
    Material {
        whitted: Some(WhittedCoefficients {
            ka: Some(0.0),
            kd: Some(0.0),
            ks: Some(Vec3::ZERO),
            n: None,
            kt: Some(Vec3::ONE),
            ior: Some(ior),
        }),
        ..Material::default()
    }
}

/// The direction that each pixel looked in; `None` where the map wraps and does not tell.
fn directions(film: &Film) -> Vec<Option<DVec3>> {
    let seen = film.radiance.iter();
    seen.map(|&[u, v, _]| direction(f64::from(u), f64::from(v)))
        .collect()
}

/// Inverse of "Environment look-up" in `shaders/README.md`.
fn direction(u: f64, v: f64) -> Option<DVec3> {
    let [width, height] = SIZE.map(f64::from);
    let inside = |x: f64, size: f64| x * size > 1.0 && x * size < size - 1.0;
    let (sin_turn, cos_turn) = (TAU * (0.5 - u)).sin_cos();
    let (sin_polar, cos_polar) = (PI * v).sin_cos();
    (inside(u, width) && inside(v, height))
        .then(|| DVec3::new(sin_polar * sin_turn, cos_polar, sin_polar * cos_turn))
}

/// The largest angle between what is seen without and with the slabs; NaN if a direction is not told in one of them alone, or
/// in too few to say anything.
fn turned(unbent: &[Option<DVec3>], bent: &[Option<DVec3>]) -> f64 {
    let mut worst: f64 = 0.0;
    let mut told = 0;
    for pair in unbent.iter().zip(bent) {
        match pair {
            (Some(a), Some(b)) => {
                worst = worst.max(angle(*a, *b));
                told += 1;
            }
            (None, None) => {}
            _ => return f64::NAN,
        }
    }
    if 2 * told > unbent.len() {
        worst
    } else {
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_ray_is_noticed() {
        let straight = direction(0.4, 0.6);
        let turned_by = |du: f64| turned(&[straight; 3], &[direction(0.4 + du, 0.6); 3]);
        assert_eq!(turned_by(0.0), 0.0);
        assert!((turned_by(1e-5) - 1e-5 * TAU * (0.6 * PI).sin()).abs() < 1e-9);
        assert!(turned(&[straight; 3], &[None; 3]).is_nan());
        assert!(turned(&[None; 3], &[None; 3]).is_nan());
    }
}
