//! Lights, and what is in their way.

use std::f64::consts::PI;

use raytree_oracle::Settings;
use raytree_scene::model::{AlphaMode, LightKind, Material};

use crate::build::*;

/// A matte floor of albedo 1/2 at the origin.
fn lit_floor() -> Build {
    let mut build = Build::before([0.0; 3]);
    let floor = build.material(matte([0.5; 3]));
    build.floor(0.0, 4.0, floor);
    build
}

/// Radiance of the floor in the origin, seen from above at an angle: a matte surface looks the same from everywhere.
fn seen(build: &Build) -> [f64; 3] {
    build.radiance([-0.7, 0.5, 0.0], [0.7, -0.5, 0.0])
}

#[test]
fn lambert_under_a_point_light() {
    let mut build = lit_floor();
    build.point_light([1.5, 2.0, 0.0], 10.0);
    // d^2 = 6.25, cos = 2/2.5.
    assert_grey(seen(&build), 0.5 / PI * 10.0 * 0.8 / 6.25);
}

#[test]
fn directional_light_does_not_fade() {
    let mut build = lit_floor();
    build.light(
        LightKind::Directional {
            direction: [0.6, -0.8, 0.0].into(),
        },
        3.0,
    );
    assert_grey(seen(&build), 0.5 / PI * 3.0 * 0.8);
}

#[test]
fn range_closes_a_window() {
    for (range, window) in [(4.0, 1.0 - 0.5_f64.powi(4)), (2.0, 0.0), (1.0, 0.0)] {
        let mut build = lit_floor();
        build.light(
            LightKind::Point {
                position: [0.0, 2.0, 0.0].into(),
                range,
            },
            1.0,
        );
        assert_grey(seen(&build), 0.5 / PI / 4.0 * window);
    }
}

#[test]
fn spot_falls_off_between_its_cones() {
    let (inner, outer) = (0.2_f64, 0.6_f64);
    let halfway = (0.5 * (inner.cos() + outer.cos())).acos();
    for (angle, share) in [
        (0.0, 1.0),
        (0.199, 1.0),
        (halfway, 0.25),
        (0.601, 0.0),
        (3.0, 0.0),
    ] {
        let mut build = lit_floor();
        let kind = LightKind::Spot {
            position: [0.0, 2.0, 0.0].into(),
            direction: down_by(angle).into(),
            range: f64::INFINITY,
            inner_cone_angle: inner,
            outer_cone_angle: outer,
        };
        build.light(kind, 8.0);
        assert_grey(seen(&build), 0.5 / PI * 2.0 * share);
    }
}

#[test]
fn lights_behind_the_surface_cost_no_ray() {
    let mut build = lit_floor();
    build.point_light([0.0, -1.0, 0.0], 1.0);
    build.point_light([0.0, 1.0, 0.0], 0.0);
    let picture = build
        .oracle()
        .render(&looking([0.0, 0.5, 0.0], DOWN), &Settings::new(1, 1));
    assert_eq!(picture.rays.shadow, 0);
    assert_grey(picture.at(0, 0), 0.0);
    build.point_light([0.0, 1.0, 0.0], 1.0);
    let picture = build
        .oracle()
        .render(&looking([0.0, 0.5, 0.0], DOWN), &Settings::new(1, 1));
    assert_eq!(picture.rays.shadow, 1);
}

#[test]
fn a_tilted_normal_shows_no_light_from_below_the_surface() {
    let mut build = lit_floor();
    build
        .scene
        .geometry
        .normals
        .fill(glam::Vec3::new(1.0, 1.0, 0.0).normalize());
    build.light(
        LightKind::Directional {
            direction: [-0.8, 0.6, 0.0].into(),
        },
        1.0,
    );
    assert_grey(build.radiance([0.7, 0.5, 0.0], [-0.7, -0.5, 0.0]), 0.0);
    // Just above it the normal counts as it is.
    build.light(
        LightKind::Directional {
            direction: [-1.0, 0.0, 0.0].into(),
        },
        1.0,
    );
    build.scene.lights[0].kind = LightKind::Directional {
        direction: [-0.8, -0.6, 0.0].into(),
    };
    let found = build.radiance([0.7, 0.5, 0.0], [-0.7, -0.5, 0.0]);
    assert_rgb_within(found, [0.5 / PI * 1.4 / 2_f64.sqrt(); 3], 1e-7);
}

/// What remains of the light above where `blocker` builds something between it and the floor.
fn remaining(blocker: impl Fn(&mut Build)) -> [f64; 3] {
    let mut build = lit_floor();
    build.point_light([0.0, 3.0, 0.0], 1.0);
    let free = seen(&build)[0];
    blocker(&mut build);
    seen(&build).map(|shadowed| shadowed / free)
}

fn remaining_behind(material: Material) -> [f64; 3] {
    remaining(|build| {
        let material = build.material(material.clone());
        build.ceiling(1.0, 0.5, material);
    })
}

#[test]
fn opaque_surfaces_leave_nothing_seen_from_either_side() {
    assert_grey(remaining_behind(matte([1.0; 3])), 0.0);
    assert_grey(remaining_behind(unlit([1.0; 3])), 0.0);
    let from_behind = remaining(|build| {
        let material = build.material(matte([1.0; 3]));
        build.floor(1.0, 0.5, material);
    });
    assert_grey(from_behind, 0.0);
}

#[test]
fn surfaces_beyond_the_light_or_behind_the_floor_cast_no_shadow() {
    let free = remaining(|build| {
        let colourless = build.material(pane([1.0; 3]));
        build.ceiling(2.5, 4.0, colourless);
        let material = build.material(matte([1.0; 3]));
        build.ceiling(3.5, 4.0, material);
        build.ceiling(-0.5, 4.0, material);
    });
    assert_grey(free, 1.0);
}

#[test]
fn thin_walls_tint() {
    assert_rgb(remaining_behind(pane([0.5, 1.0, 0.25])), [0.5, 1.0, 0.25]);
    let half_metal = Material {
        metallic: 0.5,
        transmission: 0.5,
        ..pane([1.0; 3])
    };
    assert_grey(remaining_behind(half_metal), 0.25);
}

#[test]
fn a_closed_solid_tints_twice_and_absorbs_in_between() {
    let shadow = remaining(|build| {
        let mut material = glass(1.5, [0.25, 0.5, 1.0], 2.0);
        material.base_color = [0.5, 1.0, 0.25, 1.0].into();
        let material = build.material(material);
        build.cuboid([-0.5, 1.0, -0.5], [0.5, 2.0, 0.5], material);
    });
    // Half the attenuation distance: the square root of its colour.
    assert_rgb(shadow, [0.25 * 0.5, 0.5_f64.sqrt(), 0.0625]);
}

#[test]
fn black_attenuation_leaves_a_millionth() {
    let shadow = remaining(|build| {
        let material = build.material(glass(1.5, [0.0, 0.5, 1.0], 2.0));
        build.cuboid([-0.5, 1.0, -0.5], [0.5, 2.0, 0.5], material);
    });
    assert_rgb(shadow, [1e-3, 0.5_f64.sqrt(), 1.0]);
}

#[test]
fn nested_solids_absorb_each_on_its_own_stretch() {
    let shadow = remaining(|build| {
        let outer = build.material(glass(1.33, [0.5; 3], 1.0));
        build.cuboid([-0.5, 0.5, -0.5], [0.5, 2.5, 0.5], outer);
        let inner = build.material(glass(1.5, [0.25; 3], 1.0));
        build.cuboid([-0.25, 1.0, -0.25], [0.25, 1.5, 0.25], inner);
    });
    assert_grey(shadow, 0.5_f64.powf(1.5) * 0.25_f64.powf(0.5));
}

#[test]
fn blend_lets_pass_what_it_does_not_cover() {
    let mut veil = matte([1.0; 3]);
    veil.alpha_mode = AlphaMode::Blend;
    veil.base_color.w = 0.25;
    assert_grey(remaining_behind(veil.clone()), 0.75);
    veil.unlit = true;
    assert_grey(remaining_behind(veil.clone()), 0.75);
    // What it covers of a pane is tinted: 3/4 + 1/4 * 1/2.
    let stained = Material {
        base_color: [0.5, 0.5, 0.5, 0.25].into(),
        ..pane([1.0; 3])
    };
    let stained = Material {
        alpha_mode: AlphaMode::Blend,
        ..stained
    };
    assert_grey(remaining_behind(stained), 0.875);
}

#[test]
fn masks_shade_where_they_are_not_cut_out() {
    let mask = |alpha: f32| {
        let mut material = matte([1.0; 3]);
        material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        material.base_color.w = alpha;
        material
    };
    assert_grey(remaining_behind(mask(0.49)), 1.0);
    assert_grey(remaining_behind(mask(0.5)), 0.0);
}

#[test]
fn visibility_and_occlusion_of_single_rays() {
    let mut build = Build::before([0.0; 3]);
    let tinted = build.material(pane([0.5; 3]));
    build.floor(0.0, 1.0, tinted);
    let oracle = build.oracle();
    let above = [0.1, 1.0, 0.1];
    let visible =
        |distance| oracle.visibility_along(above, DOWN, distance, raytree_oracle::Shading::Pbr);
    assert_grey(visible(0.9), 1.0);
    assert_grey(visible(f64::INFINITY), 0.5);
    assert!(oracle.occluded(above, DOWN, 1.1));
    // What lies at the very end does not count.
    assert!(!oracle.occluded(above, DOWN, 1.0));
    assert!(!oracle.occluded(above, UP, f64::INFINITY));
}
