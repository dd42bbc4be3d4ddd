//! The camera, lights, the environment and textures.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use raytree::{
    Camera, Scene,
    model::{Filter, Image, LightKind, Material, Projection, Texture, TextureRef, Wrap},
};
use raytree_gpu::Piece;
use raytree_scene::environment::EquirectMap;
use raytree_stress::{
    random::Random,
    scenes::{Build, matte, unfiltered},
};

use super::trial::{
    Answer, Arguments, EPSILON, Trial, decades, direction, near, near_vector, point, roundings,
};

/// `shaders/README.md`, "Rays".
#[test]
fn cameras_look_where_they_should() {
    let (width, height) = (640, 480);
    for (orthographic, yfov) in [(false, 0.8), (false, 3.1), (true, 0.8)] {
        let projection = if orthographic {
            Projection::Orthographic {
                xmag: 3.0,
                ymag: 0.5,
            }
        } else {
            Projection::Perspective { yfov, aspect: None }
        };
        let mut trial = Trial::alone(Piece::Camera);
        let forward = DVec3::new(0.3, -0.5, -0.8).normalize();
        let (right, up) = forward.any_orthonormal_pair();
        let camera = Camera {
            position: DVec3::new(0.7, 0.2, 1.5),
            right,
            up,
            forward,
            projection,
            ..trial.settings.camera.clone()
        };
        trial.settings.camera = camera;
        (trial.settings.width, trial.settings.height) = (width, height);
        let arguments = (0..width, 0..height, -0.5_f32..0.5, -0.5_f32..0.5);
        type Sample = (u32, u32, f32, f32);
        let call = |(px, py, sx, sy): &Sample| {
            Arguments::default()
                .word(*px)
                .word(*py)
                .number(*sx)
                .number(*sy)
                .done()
        };
        let judge = |(px, py, sx, sy): &Sample, answer: Answer<'_>| {
            let (w, h) = (f64::from(width), f64::from(height));
            let x = 2.0 * (f64::from(*px) + 0.5 + f64::from(*sx)) / w - 1.0;
            let y = 1.0 - 2.0 * (f64::from(*py) + 0.5 + f64::from(*sy)) / h;
            let position = trial.settings.camera.position;
            let (origin, direction) = if orthographic {
                let my = 0.5_f64.max(3.0 * h / w);
                (position + x * my * w / h * right + y * my * up, forward)
            } else {
                let tan = (0.5 * yfov).tan();
                (
                    position,
                    (forward + x * tan * w / h * right + y * tan * up).normalize(),
                )
            };
            near_vector("origin", answer.vector(0), origin, 32.0 * EPSILON)?;
            // Close to 180 degrees a rounding of x weighs as much as the picture is wide, in lengths of `forward`.
            let wide = if orthographic {
                1.0
            } else {
                (0.5 * yfov).tan().max(1.0)
            };
            near_vector(
                "direction",
                answer.vector(3),
                direction,
                32.0 * EPSILON * wide,
            )
        };
        trial.holds(arguments, call, judge);
    }
}

/// `shaders/README.md`, "Lights"; KHR_lights_punctual.
#[test]
fn lights_fall_off_as_they_should() {
    let place = DVec3::new(0.5, 0.25, -0.75);
    let axis = DVec3::new(0.5, -1.0, 0.25).normalize();
    let (inner, outer): (f64, f64) = (0.4, 1.1);
    let kinds = [
        LightKind::Directional { direction: axis },
        LightKind::Point {
            position: place,
            range: f64::INFINITY,
        },
        LightKind::Point {
            position: place,
            range: 1.5,
        },
        LightKind::Spot {
            position: place,
            direction: axis,
            range: f64::INFINITY,
            inner_cone_angle: inner,
            outer_cone_angle: outer,
        },
    ];
    let mut build = Build::before([0.0; 3]);
    for kind in kinds {
        build.light(kind, 2.0);
    }
    type Lit = (u32, Vec3);
    let call = |(light, at): &Lit| Arguments::default().word(*light).vector(*at).done();
    let judge = |(light, at): &Lit, answer: Answer<'_>| {
        let way = place - at.as_dvec3();
        let d = way.length();
        if *light == 0 {
            near_vector("wi", answer.vector(0), -axis, 4.0 * EPSILON)?;
            return near("Ip", answer.number(4), 2.0, 0.0);
        }
        if d < 1e-3 {
            return Ok(());
        }
        near_vector("wi", answer.vector(0), way / d, 8.0 * EPSILON / d.min(1.0))?;
        // A square root may be off by 4.5 ulp (WGSL's accuracy: 2 of inverseSqrt, 2.5 of a division), and the square by two roundings.
        let most = roundings(8.0, 12.0 * d.max(1.0)) * EPSILON;
        near("distance", answer.number(3), d, most)?;
        let window = if *light == 2 {
            (1.0 - (d / 1.5).powi(4)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let cosine = -axis.dot(way / d);
        let cone = if *light == 3 {
            ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let expected = 2.0 * window * cone * cone / (d * d);
        near(
            "Ip",
            answer.number(4),
            expected,
            64.0 * EPSILON * 2.0 / (d * d * d.min(1.0)),
        )
    };
    Trial::within(Piece::Light, build.0).holds((0_u32..4, point()), call, judge);
}

/// `shaders/README.md`, "Environment look-up".
#[test]
fn the_environment_is_where_it_should_be() {
    let (width, height) = (16_u32, 8_u32);
    let mut random = Random::new(5);
    let texels: Vec<[f32; 3]> = (0..width * height)
        .map(|_| {
            [
                random.unit() as f32,
                random.unit() as f32,
                random.unit() as f32,
            ]
        })
        .collect();
    let mut build = Build::before([0.0; 3]);
    let map = EquirectMap {
        width,
        height,
        texels: texels.clone(),
    };
    build.0.surroundings.environment = Some(unfiltered(map));
    let rotation: f64 = 0.7; // of `unfiltered`
    let call = |d: &Vec3| Arguments::default().word(0).vector(*d).done();
    let judge = |d: &Vec3, answer: Answer<'_>| {
        let d = d.as_dvec3().normalize();
        let x = d.x * rotation.cos() - d.z * rotation.sin();
        let z = d.x * rotation.sin() + d.z * rotation.cos();
        let u = 0.5 - x.atan2(z) / TAU;
        let v = d.y.acos() / PI;
        // All longitudes meet at the poles.
        if x.hypot(z) > 1e-2 {
            let apart = (answer.number(3) - u).abs();
            near(
                "u",
                apart.min(1.0 - apart),
                0.0,
                16.0 * EPSILON / x.hypot(z),
            )?;
        }
        near("v", answer.number(4), v, 8.0 * EPSILON)?;
        let place = (u * f64::from(width) - 0.5, v * f64::from(height) - 0.5);
        let texel = |i: i64, j: i64| {
            let (i, j) = (
                i.rem_euclid(i64::from(width)),
                j.clamp(0, i64::from(height) - 1),
            );
            DVec3::from_array(texels[(j * i64::from(width) + i) as usize].map(f64::from))
        };
        let expected = bilinear(place.0, place.1, texel);
        let slope = 16.0 * EPSILON * f64::from(width) / x.hypot(z).max(1e-3);
        near_vector(
            "radiance",
            answer.vector(0),
            expected,
            2.0 * slope + 16.0 * EPSILON,
        )
    };
    Trial::within(Piece::Environment, build.0).holds(direction(), call, judge);
}

/// Between the four values around a place, of a grid with values at whole numbers.
fn bilinear<T>(x: f64, y: f64, texel: impl Fn(i64, i64) -> T) -> T
where
    T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
{
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let (s, t) = (x - x.floor(), y - y.floor());
    let row = |j: i64| texel(i, j) * (1.0 - s) + texel(i + 1, j) * s;
    row(j) * (1.0 - t) + row(j + 1) * t
}

/// Every way to wrap and filter, on sides that are and are not powers of two, at uv of up to 1e6 on both sides: no more is lost
/// than the rounding of one texel coordinate within its period.
#[test]
fn textures_wrap_as_far_as_their_coordinates_tell() {
    let sizes = [(1, 1), (7, 5), (16_384, 1), (1, 300)];
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    let scene = textured(&sizes, &wraps);
    let count = scene.textures.len() as u32;
    let coordinate = || {
        let far = (any::<bool>(), decades(-9.0, 6.0))
            .prop_map(|(up, x)| if up { x as f32 } else { -x as f32 });
        prop_oneof![-2.0_f32..2.0, far]
    };
    type Look = (u32, f32, f32);
    let call = |(texture, u, v): &Look| {
        Arguments::default()
            .word(*texture)
            .number(*u)
            .number(*v)
            .done()
    };
    let judge = |(texture, u, v): &Look, answer: Answer<'_>| {
        let texture = &scene.textures[*texture as usize];
        let image = &scene.images[texture.image as usize];
        let (width, height) = (f64::from(image.width), f64::from(image.height));
        let (x, y) = (f64::from(*u) * width, f64::from(*v) * height);
        let slack = 8.0 * EPSILON * width.max(height);
        let texel = |i: i64, j: i64| {
            let i = wrapped(texture.wrap_u, i, image.width);
            let j = wrapped(texture.wrap_v, j, image.height);
            f64::from(image.texels[(j * i64::from(image.width) + i) as usize][0]) / 255.0
        };
        if texture.filter == Filter::Linear {
            return near(
                "texel",
                answer.number(0),
                bilinear(x - 0.5, y - 0.5, texel),
                2.0 * slack + 8.0 * EPSILON,
            );
        }
        // Beside an edge either neighbour is right.
        let found = [-slack, slack].iter().any(|dx| {
            [-slack, slack].iter().any(|dy| {
                let right = texel((x + dx).floor() as i64, (y + dy).floor() as i64);
                near("texel", answer.number(0), right, 2.0 * EPSILON).is_ok()
            })
        });
        let expected = texel(x.floor() as i64, y.floor() as i64);
        if found {
            Ok(())
        } else {
            near("texel", answer.number(0), expected, 0.0)
        }
    };
    Trial::within(Piece::Texture, scene.clone()).holds(
        (0..count, coordinate(), coordinate()),
        call,
        judge,
    );
}

fn wrapped(wrap: Wrap, texel: i64, size: u32) -> i64 {
    let size = i64::from(size);
    match wrap {
        Wrap::Repeat => texel.rem_euclid(size),
        Wrap::MirroredRepeat if texel.div_euclid(size) % 2 == 0 => texel.rem_euclid(size),
        Wrap::MirroredRepeat => size - 1 - texel.rem_euclid(size),
        Wrap::ClampToEdge => texel.clamp(0, size - 1),
    }
}

/// A texture of noise for every size, way to wrap, and filter, and a material for each.
fn textured(sizes: &[(u32, u32)], wraps: &[Wrap]) -> Scene {
    let mut build = Build::before([0.0; 3]);
    let mut random = Random::new(8);
    for &(width, height) in sizes {
        let grey = |random: &mut Random| random.below(256) as u8;
        let texels = (0..width * height)
            .map(|_| [grey(&mut random), 0, 0, 255])
            .collect();
        build.0.images.push(Image {
            name: "noise".to_owned(),
            width,
            height,
            texels,
        });
        for &wrap_u in wraps {
            for &wrap_v in wraps {
                for filter in [Filter::Nearest, Filter::Linear] {
                    let image = build.0.images.len() as u32 - 1;
                    build.0.textures.push(Texture {
                        image,
                        wrap_u,
                        wrap_v,
                        filter,
                        srgb: false,
                    });
                }
            }
        }
    }
    for texture in 0..build.0.textures.len() as u32 {
        let used = TextureRef {
            texture,
            uv_set: 0,
            transform: TextureRef::IDENTITY,
        };
        build.material(Material {
            base_color_texture: Some(used),
            ..matte([1.0; 3])
        });
    }
    build.0
}
