//! Texture look-ups, seen as the base colour of an unlit floor.

use glam::Vec2;
use raytree_oracle::Settings;
use raytree_scene::model::{Filter, Material, TextureRef, Wrap};

use crate::build::*;

const BLACK: [u8; 4] = [0, 0, 0, 255];
const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];

/// A floor whose texture is looked up in `(u, v)`.
fn look_up(
    rows: &[&[[u8; 4]]],
    wrap: Wrap,
    filter: Filter,
    change: impl Fn(&mut TextureRef),
    (u, v): (f32, f32),
) -> [f64; 3] {
    let mut build = Build::before([0.0; 3]);
    let mut texture = build.texture(rows, wrap, filter, false);
    change(&mut texture);
    let material = Material {
        base_color_texture: Some(texture),
        ..unlit([1.0; 3])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    build.scene.geometry.uv_sets[0].fill(Vec2::new(u, v));
    build.scene.geometry.uv_sets.push(vec![Vec2::new(v, u); 4]);
    build.radiance([0.1, 1.0, 0.2], DOWN)
}

const QUARTERS: &[&[[u8; 4]]] = &[&[BLACK, RED], &[GREEN, BLUE]];
const BLACK_RED_GREEN: &[&[[u8; 4]]] = &[&[BLACK, RED, GREEN]];

#[test]
fn nearest_is_the_texel_around_the_point_rows_from_the_top() {
    let nearest = |uv| look_up(QUARTERS, Wrap::Repeat, Filter::Nearest, |_| {}, uv);
    assert_rgb(nearest((0.49, 0.49)), [0.0; 3]);
    assert_rgb(nearest((0.51, 0.01)), [1.0, 0.0, 0.0]);
    assert_rgb(nearest((0.01, 0.99)), [0.0, 1.0, 0.0]);
    assert_rgb(nearest((0.5, 0.5)), [0.0, 0.0, 1.0]);
}

#[test]
fn linear_is_between_the_four_nearest_centres() {
    let linear = |uv| look_up(QUARTERS, Wrap::ClampToEdge, Filter::Linear, |_| {}, uv);
    assert_rgb(linear((0.25, 0.25)), [0.0; 3]);
    assert_rgb(linear((0.5, 0.5)), [0.25; 3]);
    assert_rgb(linear((0.375, 0.25)), [0.25, 0.0, 0.0]);
    assert_rgb(linear((0.0, 0.625)), [0.0, 0.75, 0.0]);
}

#[test]
fn wrapping_applies_to_the_neighbours_too() {
    let at_edge = |wrap, u| look_up(BLACK_RED_GREEN, wrap, Filter::Linear, |_| {}, (u, 0.5));
    // u = 0 lies between the first texel and what wrapping puts before it.
    assert_rgb(at_edge(Wrap::Repeat, 0.0), [0.0, 0.5, 0.0]);
    assert_rgb(at_edge(Wrap::MirroredRepeat, 0.0), [0.0; 3]);
    assert_rgb(at_edge(Wrap::ClampToEdge, 0.0), [0.0; 3]);
    assert_rgb(at_edge(Wrap::Repeat, 1.0), [0.0, 0.5, 0.0]);
    assert_rgb(at_edge(Wrap::MirroredRepeat, 1.0), [0.0, 1.0, 0.0]);
    assert_rgb(at_edge(Wrap::ClampToEdge, 1.0), [0.0, 1.0, 0.0]);
}

#[test]
fn wrapping_far_outside() {
    let far = |wrap, u| look_up(BLACK_RED_GREEN, wrap, Filter::Nearest, |_| {}, (u, 0.5));
    assert_rgb(far(Wrap::Repeat, -2.5), [1.0, 0.0, 0.0]);
    assert_rgb(far(Wrap::Repeat, -0.1), [0.0, 1.0, 0.0]);
    assert_rgb(far(Wrap::MirroredRepeat, 1.9), [0.0; 3]);
    assert_rgb(far(Wrap::MirroredRepeat, -0.9), [0.0, 1.0, 0.0]);
    assert_rgb(far(Wrap::ClampToEdge, -7.0), [0.0; 3]);
    assert_rgb(far(Wrap::ClampToEdge, 7.0), [0.0, 1.0, 0.0]);
}

#[test]
fn transforms_are_affine() {
    // u' = v + 1/2, v' = -u: (0.75, 0.1) -> (0.6, -0.75), which is texel (1, 0).
    let turn = |texture: &mut TextureRef| texture.transform = [0.0, 1.0, 0.5, -1.0, 0.0, 0.0];
    let found = look_up(QUARTERS, Wrap::Repeat, Filter::Nearest, turn, (0.75, 0.1));
    assert_rgb(found, [1.0, 0.0, 0.0]);
}

#[test]
fn the_ref_names_its_uv_set() {
    let second = |texture: &mut TextureRef| texture.uv_set = 1;
    let found = look_up(QUARTERS, Wrap::Repeat, Filter::Nearest, second, (0.75, 0.1));
    assert_rgb(found, [0.0, 1.0, 0.0]);
}

#[test]
fn srgb_is_decoded_before_filtering_and_alpha_never() {
    let mut build = Build::before([0.0; 3]);
    let rows: &[&[[u8; 4]]] = &[&[[0, 0, 0, 0], [188, 255, 255, 102]]];
    let texture = build.texture(rows, Wrap::ClampToEdge, Filter::Linear, true);
    let material = Material {
        base_color_texture: Some(texture),
        alpha_mode: raytree_scene::model::AlphaMode::Blend,
        ..unlit([1.0; 3])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    build.scene.geometry.uv_sets[0].fill(Vec2::splat(0.5));
    let camera = looking([0.1, 1.0, 0.2], DOWN);
    let hit = build
        .oracle()
        .first_hit(&camera, &Settings::new(1, 1), 0, 0)
        .unwrap();
    let decoded = ((188.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4);
    assert_rgb(hit.base, [0.5 * decoded, 0.5, 0.5]);
    assert!((hit.alpha - 0.2).abs() < 1e-12);
}

#[test]
fn each_channel_goes_where_gltf_says() {
    // Roughness from G: 0.2 * 0.5 = 0.1 is still a full mirror; metallic from B: 1; occlusion from R.
    let mut build = Build::before([0.5; 3]);
    let packed = build.texture(&[&[[0, 51, 255, 9]]], Wrap::Repeat, Filter::Nearest, false);
    let material = Material {
        roughness: 0.5,
        metallic: 1.0,
        metallic_roughness_texture: Some(packed),
        ..Material::default()
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    assert_grey(build.radiance([0.1, 1.0, 0.2], DOWN), 0.5);

    // Transmission from R (none), specular from A.
    let mut build = Build::before([1.0; 3]);
    let packed = build.texture(
        &[&[[0, 255, 255, 51]]],
        Wrap::Repeat,
        Filter::Nearest,
        false,
    );
    let material = Material {
        transmission_texture: Some(packed),
        specular_texture: Some(packed),
        ..pane([0.0; 3])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    assert_grey(build.radiance([0.1, 1.0, 0.2], DOWN), 0.04 * 0.2);
}

#[test]
fn specular_colour_and_emission_are_multiplied_by_their_textures() {
    let mut build = Build::before([1.0; 3]);
    let texture = build.texture(
        &[&[[255, 51, 0, 255]]],
        Wrap::Repeat,
        Filter::Nearest,
        false,
    );
    let material = Material {
        specular_color: [1.0, 2.0, 1.0].into(),
        specular_color_texture: Some(texture),
        emissive: [2.0, 0.5, 3.0].into(),
        emissive_texture: Some(texture),
        roughness: 0.0,
        ..matte([0.0; 3])
    };
    let material = build.material(Material {
        specular: 1.0,
        ..material
    });
    build.floor(0.0, 1.0, material);
    let expected = [2.0 + 0.04, 0.1 + 0.04 * 0.4, 0.0];
    assert_rgb(build.radiance([0.1, 1.0, 0.2], DOWN), expected);
}
