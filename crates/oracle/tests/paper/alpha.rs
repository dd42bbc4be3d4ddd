//! Alpha: BLEND, MASK, and that of the picture.

use raytree_oracle::{Picture, Settings};
use raytree_scene::model::{AlphaMode, Background, Filter, Material, Wrap};

use crate::build::*;

fn veil(base: [f32; 3], alpha: f32) -> Material {
    let mut material = Material {
        alpha_mode: AlphaMode::Blend,
        ..unlit(base)
    };
    material.base_color.w = alpha;
    material
}

fn seen_from_above(build: &Build, settings: &Settings) -> Picture {
    build
        .oracle()
        .render(&looking([0.1, 3.0, 0.2], DOWN), settings)
}

fn three_veils(background: [f32; 3]) -> Build {
    let mut build = Build::before(background);
    let colors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (color, y) in colors.into_iter().zip([1.0, 0.0, -1.0]) {
        let material = build.material(veil(color, 0.5));
        build.floor(y, 1.0, material);
    }
    build
}

#[test]
fn veils_are_laid_over_each_other() {
    let picture = seen_from_above(&three_veils([0.5; 3]), &one_ray());
    assert_rgb(
        picture.at(0, 0),
        [0.5 + 0.0625, 0.25 + 0.0625, 0.125 + 0.0625],
    );
    assert_eq!(picture.alpha, [0.875]);
    assert_eq!((picture.rays.refraction, picture.ended.miss), (3, 1));
}

#[test]
fn what_is_cut_short_does_not_reach_the_background() {
    let settings = Settings {
        max_depth: 2,
        ..one_ray()
    };
    let picture = seen_from_above(&three_veils([0.5; 3]), &settings);
    assert_rgb(picture.at(0, 0), [0.5, 0.25, 0.125]);
    assert_eq!((picture.alpha, picture.ended.depth), (vec![1.0], 1));

    let settings = Settings {
        min_weight: 0.126,
        ..one_ray()
    };
    let picture = seen_from_above(&three_veils([0.5; 3]), &settings);
    assert_eq!((picture.alpha, picture.ended.weight), (vec![1.0], 1));
}

#[test]
fn transparent_background_is_black_with_alpha_zero() {
    let mut build = three_veils([0.5; 3]);
    build.scene.surroundings.background = Background::Transparent;
    let picture = seen_from_above(&build, &one_ray());
    assert_rgb(picture.at(0, 0), [0.5, 0.25, 0.125]);
    assert_eq!(picture.alpha, [0.875]);
}

#[test]
fn glass_covers_what_is_behind_it() {
    let mut build = Build::before([1.0; 3]);
    let material = build.material(pane([1.0; 3]));
    build.floor(0.0, 1.0, material);
    assert_eq!(seen_from_above(&build, &one_ray()).alpha, [1.0]);
}

#[test]
fn blend_is_shaded_by_its_share() {
    let mut build = Build::before([0.5; 3]);
    let mut shining = veil([0.0; 3], 0.25);
    shining.unlit = false;
    shining.emissive = [2.0; 3].into();
    shining.specular = 0.0;
    shining.metallic = 0.0;
    let material = build.material(shining);
    build.floor(0.0, 1.0, material);
    assert_grey(
        build.radiance([0.1, 1.0, 0.2], DOWN),
        0.25 * 2.0 + 0.75 * 0.5,
    );
}

#[test]
fn alpha_zero_is_nothing_at_all() {
    let mut build = Build::before([0.5; 3]);
    build.point_light([0.0, 1.0, 0.0], 1.0);
    let material = build.material(Material {
        unlit: false,
        ..veil([1.0; 3], 0.0)
    });
    build.floor(0.0, 1.0, material);
    let picture = seen_from_above(&build, &one_ray());
    assert_grey(picture.at(0, 0), 0.5);
    assert_eq!((picture.alpha, picture.rays.shadow), (vec![0.0], 0));
}

#[test]
fn opaque_and_mask_ignore_alpha_as_coverage() {
    for mode in [AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.25 }] {
        let mut build = Build::before([0.0; 3]);
        let material = build.material(Material {
            alpha_mode: mode,
            ..veil([1.0; 3], 0.5)
        });
        build.floor(0.0, 1.0, material);
        assert_grey(build.radiance([0.1, 1.0, 0.2], DOWN), 1.0);
    }
}

#[test]
fn a_mask_is_not_there_where_it_is_cut_out() {
    let mut build = Build::before([0.0; 3]);
    let (clear, solid) = ([255, 255, 255, 127], [255, 255, 255, 128]);
    let texture = build.texture(
        &[&[clear, solid]],
        Wrap::ClampToEdge,
        Filter::Nearest,
        false,
    );
    let mode = AlphaMode::Mask { cutoff: 0.5 };
    let net = Material {
        alpha_mode: mode,
        base_color_texture: Some(texture),
        ..unlit([1.0; 3])
    };
    let net = build.material(net);
    let green = build.material(unlit([0.0, 1.0, 0.0]));
    build.floor(0.0, 1.0, net);
    // In the very same place: of equals, the lower index would win.
    build.floor(0.0, 1.0, green);
    assert_rgb(build.radiance([-0.5, 1.0, 0.1], DOWN), [0.0, 1.0, 0.0]);
    assert_rgb(build.radiance([0.5, 1.0, 0.1], DOWN), [1.0; 3]);
}

#[test]
fn straight_rays_see_the_background_and_others_the_environment() {
    let mut build = Build::before([1.0, 0.0, 0.0]);
    build.scene.surroundings.environment = Some(environment(4, 2, |_, _| [0.0, 1.0, 0.0]));
    let veil = build.material(veil([0.0; 3], 0.5));
    let mirror = build.material(mirror([1.0; 3]));
    let pane = build.material(pane([1.0; 3]));
    build.quad(
        [
            [-3.0, 0.0, 1.0],
            [-1.0, 0.0, 1.0],
            [-1.0, 0.0, -1.0],
            [-3.0, 0.0, -1.0],
        ],
        veil,
    );
    build.quad(
        [
            [-1.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 0.0, -1.0],
            [-1.0, 0.0, -1.0],
        ],
        mirror,
    );
    build.quad(
        [
            [1.0, 0.0, 1.0],
            [3.0, 0.0, 1.0],
            [3.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
        ],
        pane,
    );
    assert_rgb(build.radiance([0.0, 1.0, 0.0], UP), [1.0, 0.0, 0.0]);
    assert_rgb(build.radiance([-2.0, 1.0, 0.1], DOWN), [0.5, 0.0, 0.0]);
    assert_rgb(build.radiance([0.0, 1.0, 0.1], DOWN), [0.0, 1.0, 0.0]);
    assert_rgb(build.radiance([2.0, 1.0, 0.1], DOWN), [0.0, 1.0, 0.0]);
}
