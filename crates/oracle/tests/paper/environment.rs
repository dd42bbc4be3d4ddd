//! Light from all around.

use std::f64::consts::FRAC_PI_2;

use raytree_scene::model::{Background, Filter, Material, Wrap};

use crate::build::*;

/// An empty scene that shows `texel(column, row)` of a map of 8 by 4.
fn map(texel: impl Fn(u32, u32) -> [f32; 3]) -> Build {
    let mut build = Build::before([0.0; 3]);
    build.scene.surroundings.background = Background::Environment;
    build.scene.surroundings.environment = Some(environment(8, 4, texel));
    build
}

const CENTRE: [f64; 3] = [0.0; 3];

#[test]
fn the_middle_is_plus_z_and_the_left_quarter_plus_x() {
    let build = map(|i, _| [if i == 3 || i == 4 { 1.0 } else { 0.0 }; 3]);
    assert_grey(build.radiance(CENTRE, [0.0, 0.0, 1.0]), 1.0);
    assert_grey(build.radiance(CENTRE, [0.0, 0.0, -1.0]), 0.0);
    let build = map(|i, _| [if i == 1 || i == 2 { 1.0 } else { 0.0 }; 3]);
    assert_grey(build.radiance(CENTRE, [1.0, 0.0, 0.0]), 1.0);
    assert_grey(build.radiance(CENTRE, [-1.0, 0.0, 0.0]), 0.0);
}

#[test]
fn the_first_row_is_up() {
    let build = map(|_, j| [j as f32; 3]);
    assert_grey(build.radiance(CENTRE, UP), 0.0);
    assert_grey(build.radiance(CENTRE, DOWN), 3.0);
    // The horizon is between the second and the third.
    assert_grey(build.radiance(CENTRE, [0.3, 0.0, 0.4]), 1.5);
}

#[test]
fn columns_wrap_around_behind() {
    let build = map(|i, _| {
        [match i {
            0 => 1.0,
            7 => 3.0,
            _ => 0.0,
        }; 3]
    });
    assert_grey(build.radiance(CENTRE, [0.0, 0.0, -1.0]), 2.0);
}

#[test]
fn rotation_turns_the_map_counter_clockwise_seen_from_above() {
    let mut build = map(|i, _| [if i == 3 || i == 4 { 1.0 } else { 0.0 }; 3]);
    // What was at +Z goes to +X.
    build
        .scene
        .surroundings
        .environment
        .as_mut()
        .unwrap()
        .rotation = FRAC_PI_2;
    assert_grey(build.radiance(CENTRE, [1.0, 0.0, 0.0]), 1.0);
    assert_grey(build.radiance(CENTRE, [0.0, 0.0, 1.0]), 0.0);
    assert_grey(build.radiance(CENTRE, [-1.0, 0.0, 0.0]), 0.0);
}

#[test]
fn rotation_moves_every_azimuth_alike() {
    let upright = map(|i, _| [(i * i) as f32; 3]);
    let mut turned = upright.clone();
    turned
        .scene
        .surroundings
        .environment
        .as_mut()
        .unwrap()
        .rotation = 0.4;
    for azimuth in [0.0_f64, 1.0, 2.5, 4.0, 5.5] {
        // Counter-clockwise from above: from +Z towards +X.
        let direction = |a: f64| [a.sin(), 0.2, a.cos()];
        let found = turned.radiance(CENTRE, direction(azimuth + 0.4));
        assert_rgb(found, upright.radiance(CENTRE, direction(azimuth)));
    }
}

#[test]
fn without_a_map_the_environment_is_black() {
    let mut build = Build::before([1.0; 3]);
    build.scene.surroundings.background = Background::Environment;
    assert_grey(build.radiance(CENTRE, UP), 0.0);
}

/// What a floor of `material` shows in a constant environment of 0.75, seen at 45 degrees.
fn in_constant_light(material: Material) -> [f64; 3] {
    let mut build = Build::before([0.0; 3]);
    build.scene.surroundings.background = Background::Environment;
    build.scene.surroundings.environment = Some(environment(4, 2, |_, _| [0.75; 3]));
    let material = build.material(material);
    build.floor(0.0, 8.0, material);
    build.radiance([-1.0, 1.0, 0.1], [1.0, -1.0, 0.0])
}

#[test]
fn white_furnaces() {
    // All that is not reflected is scattered, whatever the roughness: the diffuse part gets what Fresnel leaves.
    for roughness in [0.0, 0.05, 0.2, 0.3, 0.7, 1.0] {
        for ior in [1.0, 1.5, 2.4] {
            let white = Material {
                specular: 1.0,
                roughness,
                ior,
                ..matte([1.0; 3])
            };
            assert_grey(in_constant_light(white), 0.75);
        }
    }
    assert_grey(in_constant_light(mirror([1.0; 3])), 0.75);
    assert_grey(in_constant_light(pane([1.0; 3])), 0.75);
}

#[test]
fn rough_reflections_lie_between_the_levels() {
    let mut build = Build::before([0.0; 3]);
    let mut levels = environment(4, 2, |_, _| [0.0; 3]);
    for (k, level) in levels.rough.iter_mut().enumerate() {
        level.texels.fill([(k + 1) as f32; 3]);
    }
    build.scene.surroundings.environment = Some(levels);
    // A white metal: AB.x + AB.y by Karis' fit at r = 0.625, cos = 1.
    let material = build.material(Material {
        roughness: 0.625,
        ..Material::default()
    });
    build.floor(0.0, 1.0, material);
    let (x, y) = (1.0 - 0.625, 0.0425 - 0.0275 * 0.625);
    let a: f64 = f64::min(x * x, 2_f64.powf(-9.28)) * x + y;
    let scale = -1.04 * a + 1.04 - 0.572 * 0.625;
    let bias = 1.04 * a - 0.04 + 0.022 * 0.625;
    assert_grey(build.radiance([0.1, 1.0, 0.2], DOWN), 2.5 * (scale + bias));
}

#[test]
fn ambient_is_occluded_and_added_to_the_environment() {
    let mut build = Build::before([0.0; 3]);
    build.scene.surroundings.ambient = [0.25, 0.5, 1.0].into();
    build.scene.surroundings.environment = Some(environment(4, 2, |_, _| [1.0; 3]));
    let texture = build.texture(&[&[[51, 0, 0, 0]]], Wrap::Repeat, Filter::Linear, false);
    let material = Material {
        occlusion_texture: Some(texture),
        occlusion_strength: 0.5,
        ..matte([0.5; 3])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    // 1 + 0.5 (0.2 - 1) = 0.6 of it arrives.
    let expected = [1.25, 1.5, 2.0].map(|light| 0.6 * 0.5 * light);
    assert_rgb(build.radiance([0.1, 1.0, 0.2], DOWN), expected);
}
