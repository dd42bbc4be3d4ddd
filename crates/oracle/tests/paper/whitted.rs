//! The model `whitted`: numbers by hand.

use raytree_oracle::{Settings, Shading};
use raytree_scene::model::{LightKind, Material, WhittedCoefficients};

use crate::build::*;

/// A floor of `material` in front of a grey background, with ambient light of 1/2 and a light of 2 from 60 degrees.
fn floor(material: Material) -> Build {
    let mut build = Build::before([0.25; 3]);
    build.scene.surroundings.ambient = [0.5; 3].into();
    let direction = [-(0.75_f64.sqrt()), -0.5, 0.0];
    build.light(
        LightKind::Directional {
            direction: direction.into(),
        },
        2.0,
    );
    let material = build.material(material);
    build.floor(0.0, 8.0, material);
    build
}

fn straight_down(build: &Build) -> [f64; 3] {
    build.shaded([0.1, 1.0, 0.2], DOWN, Shading::Whitted)
}

#[test]
fn the_equation_with_the_books_own_numbers() {
    let book = WhittedCoefficients {
        ka: Some(0.5),
        kd: Some(0.75),
        ks: Some([0.25, 0.5, 1.0].into()),
        n: Some(6.0),
        kt: None,
        ior: None,
    };
    let material = Material {
        base_color: [0.5, 0.25, 1.0, 1.0].into(),
        emissive: [1.0, 0.0, 0.0].into(),
        whitted: Some(book),
        ..Material::default()
    };
    // Half-way vector at 30 degrees: cos^6 = (3/4)^3. The mirror ray sees the background.
    let highlight = 0.421875;
    let channel = |od: f64, ks: f64, em: f64| {
        em + 0.5 * od * 0.5 + 2.0 * (0.75 * od * 0.5 + ks * highlight) + ks * 0.25
    };
    let expected = [
        channel(0.5, 0.25, 1.0),
        channel(0.25, 0.5, 0.0),
        channel(1.0, 1.0, 0.0),
    ];
    assert_rgb(straight_down(&floor(material)), expected);
}

#[test]
fn coefficients_derived_from_gltf() {
    // r = 1/2: alpha^2 = 1/16, n = 30. ior 1.5: F0 = 0.04.
    let material = Material {
        base_color: [0.5, 0.5, 0.5, 1.0].into(),
        metallic: 0.25,
        transmission: 0.5,
        roughness: 0.5,
        ..Material::default()
    };
    let (kd, ks, kt) = (0.375, 0.75 * 0.04 + 0.25 * 0.5, 0.75 * 0.5 * 0.5);
    let highlight = 0.75_f64.powi(15);
    let expected = kd * 0.5 * 0.5 + 2.0 * (kd * 0.5 * 0.5 + ks * highlight) + ks * 0.25 + kt * 0.25;
    assert_grey(straight_down(&floor(material)), expected);
}

#[test]
fn fully_rough_highlights_are_constant() {
    let material = Material {
        base_color: [0.5, 0.5, 0.5, 1.0].into(),
        ..Material::default()
    };
    // n = 0; ks = base.
    assert_grey(straight_down(&floor(material)), 2.0 * 0.5 + 0.5 * 0.25);
}

#[test]
fn the_exponent_of_smooth_surfaces_is_a_million() {
    let mut build = floor(mirror([1.0; 3]));
    // A half-way vector a thousandth off the normal.
    let (sin, cos) = 2e-3_f64.sin_cos();
    let direction = [sin, -cos, 0.0];
    build.scene.lights[0].kind = LightKind::Directional {
        direction: direction.into(),
    };
    let expected = 2.0 * 1e-3_f64.cos().powf(1e6) + 0.25;
    assert_rgb_within(straight_down(&build), [expected; 3], 1e-6);
    assert!(expected > 1.4);
}

#[test]
fn lights_below_the_horizon_are_left_out_highlight_and_all() {
    let book = WhittedCoefficients {
        n: Some(0.0),
        ..WhittedCoefficients::default()
    };
    let mut build = floor(Material {
        whitted: Some(book),
        ..mirror([1.0; 3])
    });
    let direction = [0.0, 1.0, 0.0];
    build.scene.lights[0].kind = LightKind::Directional {
        direction: direction.into(),
    };
    assert_grey(straight_down(&build), 0.25);
}

#[test]
fn both_rays_are_spawned_whatever_the_roughness() {
    let material = Material {
        metallic: 0.0,
        transmission: 1.0,
        ..Material::default()
    };
    let build = floor(material);
    let settings = Settings {
        shading: Shading::Whitted,
        ..one_ray()
    };
    let picture = build
        .oracle()
        .render(&looking([0.1, 1.0, 0.2], DOWN), &settings);
    assert_eq!((picture.rays.reflection, picture.rays.refraction), (1, 1));
}

#[test]
fn the_books_index_also_sets_the_derived_reflection() {
    // ior 3: F0 = 1/4.
    let book = WhittedCoefficients {
        ior: Some(3.0),
        ..WhittedCoefficients::default()
    };
    let dark = Material {
        specular: 1.0,
        ..matte([0.0; 3])
    };
    let mut build = floor(Material {
        whitted: Some(book),
        ..dark
    });
    build.scene.lights.clear();
    assert_grey(straight_down(&build), 0.25 * 0.25);
}

#[test]
fn shadows_let_kt_through() {
    let book = WhittedCoefficients {
        kt: Some([0.5, 0.25, 1.0].into()),
        ..Default::default()
    };
    let mut build = Build::before([0.0; 3]);
    build.point_light([0.0, 3.0, 0.0], 9.0);
    let floor = build.material(matte([1.0; 3]));
    build.floor(0.0, 1.0, floor);
    let blocker = build.material(Material {
        whitted: Some(book),
        ..matte([1.0; 3])
    });
    build.cuboid([-0.5, 1.0, -0.5], [0.5, 2.0, 0.5], blocker);
    let found = build.shaded([-0.7, 0.5, 0.0], [0.7, -0.5, 0.0], Shading::Whitted);
    assert_rgb(found, [0.25, 0.0625, 1.0]);
    // The other model knows nothing of kt.
    assert_grey(build.radiance([-0.7, 0.5, 0.0], [0.7, -0.5, 0.0]), 0.0);
}
