//! Shading where its inputs are extreme: exponents and roughness, tangents and normals that vanish, texture coordinates and sizes.

use glam::{DVec3, Vec2, Vec3, Vec4};
use raytree_gpu::{RenderSettings, Shading};
use raytree_scene::model::{
    Filter, Image, LightKind, Material, Texture, TextureRef, WhittedCoefficients, Wrap,
};

use crate::{
    judge::{judge_picture, largest_difference},
    report::Limit,
    scenes::{Build, matte, pinhole},
    stage::{Stage, StressError},
};

/// Of radiance, against the oracle: what the suite's pictures are held to.
const TOLERANCE: f64 = 1e-3;

/// Against a picture that has to be the same.
const SAME: f64 = 1e-6;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    exponents(stage)?;
    roughness(stage)?;
    frames(stage)?;
    far_coordinates(stage)?;
    texture_sizes(stage)
}

/// A square seen from above, 60 pixels a side.
fn view(shading: Shading) -> RenderSettings {
    let camera = pinhole(EYE, Vec3::ZERO, 0.9);
    RenderSettings {
        shading,
        ..RenderSettings::new(60, 60, camera)
    }
}

fn against_oracle(
    stage: &mut Stage<'_>,
    build: &Build,
    settings: &RenderSettings,
    parameter: String,
) -> Result<(), StressError> {
    let film = stage.render(&build.0, settings)?.film;
    let judged = judge_picture(&build.0, settings, &film, TOLERANCE);
    stage.record(parameter, judged.worst, Limit::AtMost(TOLERANCE));
    Ok(())
}

const EYE: Vec3 = Vec3::new(0.2, 2.0, 1.4);
const LIGHT: Vec3 = Vec3::new(0.4, 3.0, -1.3);

/// A floor under a light, of this material.
fn lit(material: Material) -> Build {
    let mut build = Build::before([0.1, 0.2, 0.3]);
    let material = build.material(material);
    build.square(Vec3::ZERO, Vec3::Y, 1.2, material);
    let position = LIGHT.as_dvec3();
    let range = f64::INFINITY;
    build.light(LightKind::Point { position, range }, 8.0);
    build
}

/// Where the floor mirrors the light, from `EYE`, and as much around it as half vectors turn by `spread`, radians.
fn highlight_view(shading: Shading, spread: f64) -> RenderSettings {
    let mirrored = Vec3::new(LIGHT.x, -LIGHT.y, LIGHT.z);
    let middle = EYE + (mirrored - EYE) * (EYE.y / (EYE.y - mirrored.y));
    RenderSettings {
        camera: pinhole(EYE, middle, (2.0 * spread).min(0.9)),
        ..view(shading)
    }
}

/// Judges the picture, and that there was a highlight in it to be judged.
fn highlight_against_oracle(
    stage: &mut Stage<'_>,
    build: &Build,
    settings: &RenderSettings,
    parameter: &str,
) -> Result<(), StressError> {
    let film = stage.render(&build.0, settings)?.film;
    let judged = judge_picture(&build.0, settings, &film, TOLERANCE);
    stage.record(
        format!("{parameter}, against the oracle"),
        judged.worst,
        Limit::AtMost(TOLERANCE),
    );
    let of =
        |fold: fn(f32, f32) -> f32, start| film.radiance.iter().map(|c| c[0]).fold(start, fold);
    let contrast = of(f32::max, 0.0) / of(f32::min, f32::INFINITY);
    stage.record(
        format!("{parameter}: brightest by darkest pixel"),
        f64::from(contrast),
        Limit::AtLeast(1.5),
    );
    Ok(())
}

fn exponents(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for n in [1e2_f32, 1e4, 1e6] {
        let build = lit(Material {
            whitted: Some(WhittedCoefficients {
                ks: Some(Vec3::splat(0.5)),
                n: Some(n),
                ..WhittedCoefficients::default()
            }),
            ..matte([0.3; 3])
        });
        let settings = highlight_view(Shading::Whitted, 3.0 / f64::from(n).sqrt());
        highlight_against_oracle(stage, &build, &settings, &format!("exponent {n:e}"))?;
    }
    Ok(())
}

/// Under `pbr` a surface with alpha = roughness^2 below 1e-3 shows no highlight of a light without size: a roughness of 0.032 does.
fn roughness(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let of = |roughness| {
        lit(Material {
            roughness,
            metallic: 0.5,
            base_color: Vec4::new(0.8, 0.6, 0.4, 1.0),
            ..Material::default()
        })
    };
    for (shading, name, shown) in [
        (Shading::Pbr, "pbr", vec![0.032, 0.1]),
        (Shading::Whitted, "whitted", vec![0.0, 1e-4, 0.032]),
    ] {
        for roughness in [0.0_f32, 1e-4, 0.032, 0.1] {
            let build = of(roughness);
            let spread = 3.0 * f64::from(roughness * roughness).max(1e-3);
            let settings = highlight_view(shading, spread);
            let parameter = format!("roughness {roughness}, {name}");
            if shown.contains(&roughness) {
                highlight_against_oracle(stage, &build, &settings, &parameter)?;
            } else {
                against_oracle(
                    stage,
                    &build,
                    &settings,
                    format!("{parameter}, against the oracle"),
                )?;
            }
        }
    }
    Ok(())
}

/// Tangents and normals that tell no direction, on a square with a normal map.
fn frames(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let along = Vec4::new(1.0, 0.0, 0.0, 1.0);
    let up = [Vec3::Y; 4];
    let opposed = [Vec3::Y, Vec3::X, Vec3::NEG_Y, Vec3::NEG_X];
    for (name, normals, tangent) in [
        ("tangents of no length", up, Vec4::new(0.0, 0.0, 0.0, 1.0)),
        (
            "tangents along the normal",
            up,
            Vec4::new(0.0, 1.0, 0.0, 1.0),
        ),
        ("tangents of 1e-30", up, 1e-30 * along),
        ("normals of no length", [Vec3::ZERO; 4], along),
        ("normals that cancel", opposed, along),
        ("neither normals nor tangents", [Vec3::ZERO; 4], Vec4::ZERO),
    ] {
        let mut build = textured_square([2, 2], [Wrap::Repeat; 2], Vec2::ZERO, 3.0);
        build.0.geometry.normals = normals.to_vec();
        build.0.geometry.tangents = vec![tangent; 4];
        let material = &mut build.0.materials[0];
        material.normal_texture = material.base_color_texture.take();
        let light = LightKind::Directional {
            direction: DVec3::new(0.4, -1.0, -0.2).normalize(),
        };
        build.light(light, 2.0);
        let parameter = format!("{name}, against the oracle");
        against_oracle(stage, &build, &view(Shading::Pbr), parameter)?;
    }
    Ok(())
}

/// Texture coordinates far from 0: the same picture as near it, as far as their corners are the same.
fn far_coordinates(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let settings = view(Shading::Pbr);
    // 1e9 is a multiple of 64, as are its neighbours in f32.
    for (offset, span) in [(1e3, 3.0), (1e6, 3.0), (-1e6, 3.0), (1e9, 64.0)] {
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat] {
            let at = |offset: f32| textured_square([16, 8], [wrap; 2], Vec2::splat(offset), span);
            let near = stage.render(&at(0.0).0, &settings)?.film;
            let far = stage.render(&at(offset).0, &settings)?.film;
            let parameter = format!("uv from {offset:e}, {wrap:?}: against uv from 0");
            stage.record(
                parameter,
                largest_difference(&near, &far),
                Limit::AtMost(SAME),
            );
        }
    }
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        let mut build = textured_square([16, 8], [wrap; 2], Vec2::splat(1e6), 3.0);
        let reference = &mut build.0.materials[0].base_color_texture;
        if let Some(reference) = reference {
            reference.transform = [0.7, 0.3, 0.1, -0.3, 0.7, 0.2];
        }
        let parameter = format!("uv from 1e6, turned and scaled, {wrap:?}, against the oracle");
        against_oracle(stage, &build, &settings, parameter)?;
    }
    Ok(())
}

fn texture_sizes(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (size, wrap) in [
        ([1, 1], Wrap::Repeat),
        ([1, 1], Wrap::ClampToEdge),
        ([16_384, 1], Wrap::Repeat),
        ([16_384, 1], Wrap::MirroredRepeat),
        ([16_384, 1], Wrap::ClampToEdge),
        ([1, 16_384], Wrap::Repeat),
    ] {
        for offset in [0.0, 1e6] {
            let build = textured_square(size, [wrap; 2], Vec2::splat(offset), 2.0);
            let [width, height] = size;
            let parameter =
                format!("{width}x{height}, {wrap:?}, uv from {offset:e}, against the oracle");
            against_oracle(stage, &build, &view(Shading::Pbr), parameter)?;
        }
    }
    Ok(())
}

/// A square that shines by what its texture, of so many texels, says: uv from `from` on, `span` periods wide.
fn textured_square(
    [width, height]: [u32; 2],
    [wrap_u, wrap_v]: [Wrap; 2],
    from: Vec2,
    span: f32,
) -> Build {
    let mut build = Build::before([0.1, 0.2, 0.3]);
    let texel = |k: u32| {
        let (i, j) = (k % width, k / width);
        // Smooth over many texels, rough over few.
        let ramp = |i: u32, size: u32| if size > 256 { i * 255 / size } else { i * 97 % 256 } as u8;
        [ramp(i, width), ramp(j, height), 128, 255]
    };
    build.0.images.push(Image {
        name: "ramp".to_owned(),
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
    });
    build.0.textures.push(Texture {
        image: 0,
        wrap_u,
        wrap_v,
        filter: Filter::Linear,
        srgb: false,
    });
    let material = build.material(Material {
        base_color_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            transform: TextureRef::IDENTITY,
        }),
        ..matte([1.0; 3])
    });
    build.0.surroundings.ambient = Vec3::ONE;
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    build.quad(corners.map(|(x, z)| Vec3::new(x, 0.0, z)), material);
    let place = |(x, z): (f32, f32)| from + 0.5 * span * Vec2::new(x + 1.0, z + 1.0);
    build.0.geometry.uv_sets = vec![corners.map(place).to_vec()];
    build
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is moved is the uv alone, and by whole numbers that f32 holds.
    #[test]
    fn far_squares_differ_in_uv_alone() {
        let [near, far] = [0.0, 1e6]
            .map(|offset| textured_square([2, 2], [Wrap::Repeat; 2], Vec2::splat(offset), 3.0));
        assert_eq!(near.0.geometry.positions, far.0.geometry.positions);
        let uv = |build: &Build| build.0.geometry.uv_sets[0].clone();
        for (near, far) in uv(&near).into_iter().zip(uv(&far)) {
            assert_eq!(far - Vec2::splat(1e6), near);
        }
    }
}
