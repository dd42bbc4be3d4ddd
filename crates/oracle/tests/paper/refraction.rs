//! Mirrors, panes and solids.

use raytree_oracle::{Settings, Shading};
use raytree_scene::model::{Material, Volume, WhittedCoefficients};

use crate::build::*;

#[test]
fn facing_mirrors_are_a_geometric_series() {
    let mut build = Build::before([0.0; 3]);
    let shining = Material {
        emissive: [1.0; 3].into(),
        ..mirror([0.5; 3])
    };
    let material = build.material(shining);
    build.floor(0.0, 1.0, material);
    build.ceiling(1.0, 1.0, material);
    let settings = Settings {
        max_depth: 8,
        min_weight: 0.0,
        ..one_ray()
    };
    let picture = build
        .oracle()
        .render(&looking([0.2, 0.5, 0.1], DOWN), &settings);
    // 1 + 1/2 + ... + 1/2^8.
    assert_grey(picture.at(0, 0), 2.0 - 0.5_f64.powi(8));
    assert_eq!((picture.rays.reflection, picture.ended.depth), (8, 1));
}

#[test]
fn metals_follow_schlick() {
    let mut build = Build::before([1.0; 3]);
    let gold = build.material(mirror([1.0, 0.5, 0.25]));
    build.floor(0.0, 1.0, gold);
    let grazing = (1.0 - 60_f64.to_radians().cos()).powi(5);
    let expected = [1.0, 0.5, 0.25].map(|f0| f0 + (1.0 - f0) * grazing);
    let found = build.radiance([-(0.75_f64.sqrt()), 0.5, 0.0], down_by(60_f64.to_radians()));
    assert_rgb(found, expected);
}

#[test]
fn a_thin_pane_reflects_and_lets_the_rest_straight_through() {
    let mut build = Build::before([0.0; 3]);
    let stained = build.material(pane([0.5, 1.0, 0.25]));
    let (red, white) = (
        build.material(unlit([1.0, 0.0, 0.0])),
        build.material(unlit([1.0; 3])),
    );
    build.floor(0.0, 4.0, stained);
    build.ceiling(2.0, 4.0, red);
    build.floor(-2.0, 4.0, white);
    let share = 0.96;
    assert_rgb(
        build.radiance([0.1, 1.0, 0.1], DOWN),
        [0.04 + 0.5 * share, share, 0.25 * share],
    );
}

#[test]
fn a_pane_is_the_same_from_behind() {
    let mut build = Build::before([1.0; 3]);
    let stained = build.material(pane([0.5; 3]));
    build.floor(0.0, 4.0, stained);
    assert_grey(build.radiance([0.1, 1.0, 0.1], DOWN), 0.04 + 0.48);
    assert_grey(build.radiance([0.1, -1.0, 0.1], UP), 0.04 + 0.48);
}

/// Reflectance of unpolarised light at glass, by the textbook's formulas of the two angles.
fn fresnel(theta: f64, n: f64) -> f64 {
    let theta_t = (theta.sin() / n).asin();
    let s = ((theta - theta_t).sin() / (theta + theta_t).sin()).powi(2);
    let p = ((theta - theta_t).tan() / (theta + theta_t).tan()).powi(2);
    0.5 * (s + p)
}

#[test]
fn an_absorbing_slab_is_the_sum_of_all_its_echoes() {
    let (n, thickness) = (1.5, 0.25);
    let mut build = Build::before([1.0; 3]);
    let slab = build.material(glass(1.5, [0.5, 0.25, 1.0], 1.0));
    build.cuboid([-50.0, -(thickness as f32), -50.0], [50.0, 0.0, 50.0], slab);
    for degrees in [0.01_f64, 30.0, 56.3, 75.0] {
        let theta = degrees.to_radians();
        let r = fresnel(theta, n);
        let way = thickness / (theta.sin() / n).asin().cos();
        let expected = [0.5_f64, 0.25, 1.0].map(|color| {
            let a = color.powf(way);
            let echoes = 1.0 / (1.0 - r * r * a * a);
            r + (1.0 - r).powi(2) * r * a * a * echoes + (1.0 - r).powi(2) * a * echoes
        });
        assert_rgb(build.radiance([0.1, 1.0, 0.2], down_by(theta)), expected);
    }
}

#[test]
fn a_clear_sphere_before_a_constant_background_is_invisible() {
    let mut build = Build::before([0.75; 3]);
    let sphere = build.material(clear(1.5));
    build.sphere([0.0; 3], 0.5, 48, 24, sphere);
    for offset in [0.0, 0.1, 0.25, 0.4] {
        let found = build.radiance([offset, 2.0, 0.03], DOWN);
        assert_rgb_within(found, [0.75; 3], 1e-6);
    }
}

/// A solid that only refracts, under the book's model.
fn bending(ior: f32) -> Material {
    let only_kt = WhittedCoefficients {
        ka: Some(0.0),
        kd: Some(0.0),
        ks: Some([0.0; 3].into()),
        kt: Some([1.0; 3].into()),
        ..WhittedCoefficients::default()
    };
    Material {
        ior,
        whitted: Some(only_kt),
        ..Material::default()
    }
}

/// A floor at -2 that shows where on the x axis a ray arrives: radiance is `x / 4 + 1/2`.
fn ruler(build: &mut Build) {
    let white = build.material(unlit([1.0; 3]));
    let first = build.scene.geometry.positions.len();
    build.floor(-2.0, 2.0, white);
    for i in first..first + 4 {
        let brightness = build.scene.geometry.positions[i].x / 4.0 + 0.5;
        build.scene.geometry.colors[i] = [brightness, brightness, brightness, 1.0].into();
    }
}

fn arrival_x(build: &Build, theta: f64) -> f64 {
    let found = build.shaded([-(theta.tan()), 1.0, 0.1], down_by(theta), Shading::Whitted);
    (found[0] - 0.5) * 4.0
}

/// How far to the side a ray gets in a layer of index `n`.
fn sideways(theta: f64, n: f64, thickness: f64) -> f64 {
    thickness * (theta.sin() / n).asin().tan()
}

#[test]
fn a_slab_displaces_by_snells_law() {
    let mut build = Build::before([0.0; 3]);
    ruler(&mut build);
    let slab = build.material(bending(1.5));
    build.cuboid([-3.0, -1.0, -3.0], [3.0, 0.0, 3.0], slab);
    let theta = 0.7;
    let expected = sideways(theta, 1.5, 1.0) + theta.tan();
    assert!((arrival_x(&build, theta) - expected).abs() < 1e-9);
}

#[test]
fn glass_in_water_bends_by_the_relative_index() {
    let mut build = Build::before([0.0; 3]);
    ruler(&mut build);
    let water = build.material(bending(1.25));
    let glass = build.material(bending(1.75));
    build.cuboid([-3.0, -1.5, -3.0], [3.0, 0.0, 3.0], water);
    build.cuboid([-2.5, -1.0, -2.5], [2.5, -0.5, 2.5], glass);
    let theta = 0.7;
    let expected =
        sideways(theta, 1.25, 1.0) + sideways(theta, 1.75, 0.5) + sideways(theta, 1.0, 0.5);
    assert!((arrival_x(&build, theta) - expected).abs() < 1e-9);
}

#[test]
fn glass_in_oil_of_the_same_index_vanishes() {
    let mut oil = Build::before([1.0; 3]);
    let material = oil.material(glass(1.5, [0.5; 3], 1.0));
    oil.cuboid([-3.0, -1.5, -3.0], [3.0, 0.0, 3.0], material);
    let mut both = oil.clone();
    let other = both.material(glass(1.5, [0.5; 3], 1.0));
    both.cuboid([-1.0, -1.0, -1.0], [1.0, -0.5, 1.0], other);
    let (origin, direction) = ([0.1, 1.0, 0.1], down_by(0.3));
    assert_rgb(
        both.radiance(origin, direction),
        oil.radiance(origin, direction),
    );
}

#[test]
fn a_right_angled_prism_turns_light_by_total_reflection() {
    // Down into the top, reflected at the hypotenuse (45 degrees, above the critical 41.8), out towards +x.
    let prism = |material: Material| {
        let mut build = Build::before([0.0; 3]);
        let material = build.material(material);
        build.floor(1.0, 1.0, material);
        build.quad(
            [
                [1.0, -1.0, 1.0],
                [1.0, -1.0, -1.0],
                [1.0, 1.0, -1.0],
                [1.0, 1.0, 1.0],
            ],
            material,
        );
        build.quad(
            [
                [-1.0, 1.0, -1.0],
                [1.0, -1.0, -1.0],
                [1.0, -1.0, 1.0],
                [-1.0, 1.0, 1.0],
            ],
            material,
        );
        let white = build.material(unlit([1.0; 3]));
        build.quad(
            [
                [2.0, -1.0, -1.0],
                [2.0, -1.0, 1.0],
                [2.0, 1.0, 1.0],
                [2.0, 1.0, -1.0],
            ],
            white,
        );
        build
    };
    let (origin, direction) = ([0.1, 3.0, 0.2], DOWN);
    // 4 % are lost at either leg, but for what echoes between them.
    let expected = 0.96 * 0.96 / (1.0 - 0.04 * 0.04);
    assert_grey(prism(clear(1.5)).radiance(origin, direction), expected);
    // All of kt is reflected.
    let book = prism(bending(1.5)).shaded(origin, direction, Shading::Whitted);
    assert_grey(book, 1.0);
    // Below the critical angle (index 1.4: 45.6 degrees) nothing is, without ks.
    let book = prism(bending(1.4)).shaded(origin, direction, Shading::Whitted);
    assert_grey(book, 0.0);
}

#[test]
fn an_open_solid_is_infinitely_deep() {
    let mut build = Build::before([1.0; 3]);
    let ocean = build.material(glass(1.5, [0.5, 1.0, 1.0], 1.0));
    build.floor(0.0, 1.0, ocean);
    assert_rgb(build.radiance([0.1, 1.0, 0.1], DOWN), [0.04, 1.0, 1.0]);
}

#[test]
fn leaving_a_solid_never_entered_changes_nothing() {
    let mut build = Build::before([1.0; 3]);
    let above = build.material(glass(1.5, [0.5; 3], 1.0));
    build.ceiling(-1.0, 4.0, above);
    assert_grey(build.radiance([0.1, 0.2, 0.3], down_by(0.4)), 1.0);
}

#[test]
fn a_camera_inside_a_solid_sees_through_it() {
    let mut build = Build::before([1.0; 3]);
    let around = build.material(glass(1.5, [0.5; 3], 1.0));
    build.cuboid([-1.0; 3], [1.0; 3], around);
    // 1.2 down to the first face, then 2 from face to face for each echo, 4 % of each staying inside.
    let expected = 0.5_f64.powf(1.2) * 0.96 / (1.0 - 0.04 * 0.25);
    assert_grey(build.radiance([0.1, 0.2, 0.3], DOWN), expected);
}

#[test]
fn rough_glass_gathers_from_all_around_without_rays() {
    let mut build = Build::before([0.0; 3]);
    build.scene.surroundings.ambient = [1.0; 3].into();
    let frosted = Material {
        roughness: 1.0,
        ..clear(1.5)
    };
    let material = build.material(frosted);
    build.cuboid([-1.0; 3], [1.0; 3], material);
    let picture = build
        .oracle()
        .render(&looking([0.1, 3.0, 0.2], DOWN), &one_ray());
    assert_eq!((picture.rays.reflection, picture.rays.refraction), (0, 0));
    // AB of Karis' fit at r = 1, cos = 1: q = (0, 0.015, 0.468, -0.018), a = 0.015.
    let reflected = 0.04 * (0.468 - 1.04 * 0.015) + (1.04 * 0.015 - 0.018);
    assert_grey(picture.at(0, 0), reflected + 0.96);
}

#[test]
fn volume_without_transmission_is_opaque() {
    let mut build = Build::before([1.0; 3]);
    let volume = Volume {
        attenuation_color: [0.5; 3].into(),
        attenuation_distance: 1.0,
    };
    let material = build.material(Material {
        volume: Some(volume),
        ..matte([1.0; 3])
    });
    build.cuboid([-1.0; 3], [1.0; 3], material);
    assert_grey(build.radiance([0.1, 3.0, 0.2], DOWN), 0.0);
}
