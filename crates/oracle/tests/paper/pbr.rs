//! The model `pbr` at lights, on paper.

use std::f64::consts::PI;

use raytree_scene::model::{LightKind, Material};

use crate::build::*;

/// A floor of `material`, lit and seen straight from above: all cosines are 1.
fn straight_on(material: Material) -> [f64; 3] {
    let mut build = Build::before([0.0; 3]);
    build.light(
        LightKind::Directional {
            direction: DOWN.into(),
        },
        1.0,
    );
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    build.radiance([0.1, 1.0, 0.2], DOWN)
}

#[test]
fn rough_metal_straight_on() {
    // D = 1/(pi alpha^2), V = 1/4, F = base; r = 0.5: alpha^2 = 1/16.
    let metal = Material {
        base_color: [1.0, 0.5, 0.25, 1.0].into(),
        roughness: 0.5,
        ..Material::default()
    };
    assert_rgb(
        straight_on(metal),
        [1.0, 0.5, 0.25].map(|base| base * 16.0 / (4.0 * PI)),
    );
}

#[test]
fn rough_dielectric_straight_on() {
    let plastic = Material {
        specular: 1.0,
        roughness: 1.0,
        ..matte([0.5; 3])
    };
    assert_grey(straight_on(plastic), 0.5 / PI * 0.96 + 0.04 / (4.0 * PI));
}

#[test]
fn mixtures_are_weighted_by_metallic_and_transmission() {
    let mixed = Material {
        specular: 1.0,
        metallic: 0.25,
        transmission: 0.5,
        ..matte([0.5; 3])
    };
    let diffuse = 0.75 * 0.5 * 0.5 / PI * 0.96;
    let specular = (0.75 * 0.04 + 0.25 * 0.5) / (4.0 * PI);
    assert_grey(straight_on(mixed), diffuse + specular);
}

#[test]
fn smooth_surfaces_show_no_highlight_of_a_light_without_size() {
    let polished = Material {
        specular: 1.0,
        roughness: 0.03,
        ..matte([0.0; 3])
    };
    assert_grey(straight_on(polished.clone()), 0.0);
    let barely_rough = Material {
        roughness: 0.032,
        ..polished
    };
    assert!(straight_on(barely_rough)[0] > 1.0);
}

#[test]
fn brdf_is_reciprocal() {
    // L / cos(light) stays the same when light and camera change places.
    let (a, b) = (0.3_f64, 1.1_f64);
    let seen = |light: f64, camera: f64| {
        let mut build = Build::before([0.0; 3]);
        let direction = [-light.sin(), -light.cos(), 0.0];
        build.light(
            LightKind::Directional {
                direction: direction.into(),
            },
            1.0,
        );
        let material = Material {
            specular: 1.0,
            metallic: 0.5,
            roughness: 0.5,
            ..matte([0.5; 3])
        };
        let material = build.material(material);
        build.floor(0.0, 8.0, material);
        build.radiance([-camera.sin(), camera.cos(), 0.0], down_by(camera))[0] / light.cos()
    };
    assert!((seen(a, b) - seen(b, a)).abs() < 1e-9);
    assert!(seen(a, b) > 0.0);
}

#[test]
fn a_half_rough_metal_is_half_a_mirror() {
    // smooth(0.25) = 1/2: half of what the ray brings; the other half would come from the environment, of which there
    // is none.
    let mut build = Build::before([1.0; 3]);
    let material = build.material(Material {
        roughness: 0.25,
        ..mirror([0.5; 3])
    });
    build.floor(0.0, 1.0, material);
    assert_grey(build.radiance([0.1, 1.0, 0.2], DOWN), 0.25);
}

#[test]
fn an_infinite_index_reflects_all_and_an_index_of_one_nothing() {
    let mut build = Build::before([1.0; 3]);
    let chrome = build.material(Material {
        ior: f32::INFINITY,
        ..pane([1.0; 3])
    });
    build.floor(0.0, 1.0, chrome);
    let picture = build
        .oracle()
        .render(&looking([0.1, 1.0, 0.2], DOWN), &one_ray());
    assert_grey(picture.at(0, 0), 1.0);
    assert_eq!((picture.rays.reflection, picture.rays.refraction), (1, 0));
    build.scene.materials[0].ior = 1.0;
    let picture = build
        .oracle()
        .render(&looking([0.1, 1.0, 0.2], DOWN), &one_ray());
    assert_grey(picture.at(0, 0), 1.0);
    assert_eq!((picture.rays.reflection, picture.rays.refraction), (0, 1));
}
