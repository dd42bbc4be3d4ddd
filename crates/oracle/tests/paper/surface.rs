//! Normals, sides, colours.

use raytree_oracle::{FirstHit, Settings, Shading};
use raytree_scene::model::{Filter, Material, Wrap};

use crate::build::*;

fn first_hit(build: &Build, origin: [f64; 3], direction: [f64; 3]) -> Option<FirstHit> {
    build
        .oracle()
        .first_hit(&looking(origin, direction), &Settings::new(1, 1), 0, 0)
}

#[test]
fn backs_of_single_sided_opaque_surfaces_are_culled() {
    let seen_from_below = |material: Material| {
        let mut build = Build::before([0.0; 3]);
        let material = build.material(material);
        build.floor(0.0, 1.0, material);
        assert!(first_hit(&build, [0.1, 1.0, 0.2], DOWN).is_some());
        first_hit(&build, [0.1, -1.0, 0.2], UP).is_some()
    };
    assert!(!seen_from_below(matte([1.0; 3])));
    assert!(seen_from_below(Material {
        double_sided: true,
        ..matte([1.0; 3])
    }));
    assert!(seen_from_below(pane([1.0; 3])));
}

#[test]
fn the_books_kt_transmits_under_the_books_model_only() {
    let mut build = Build::before([0.0; 3]);
    let kt = raytree_scene::model::WhittedCoefficients {
        kt: Some([0.5; 3].into()),
        ..Default::default()
    };
    let material = build.material(Material {
        whitted: Some(kt),
        ..matte([1.0; 3])
    });
    build.floor(0.0, 1.0, material);
    let hit = |shading| build.oracle().closest_hit([0.1, -1.0, 0.2], UP, shading);
    assert!(hit(Shading::Pbr).is_none());
    assert!(hit(Shading::Whitted).is_some());
}

#[test]
fn normals_face_the_ray() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(Material {
        double_sided: true,
        ..matte([1.0; 3])
    });
    build.floor(0.0, 1.0, material);
    let above = first_hit(&build, [0.1, 1.0, 0.2], DOWN).unwrap();
    assert_eq!(
        (above.geometric_normal, above.shading_normal, above.hit.back),
        (UP, UP, false)
    );
    let below = first_hit(&build, [0.1, -1.0, 0.2], UP).unwrap();
    assert_eq!(
        (below.geometric_normal, below.shading_normal, below.hit.back),
        (DOWN, DOWN, true)
    );
    assert_rgb(above.position, [0.1, 0.0, 0.2]);
}

#[test]
fn shading_normals_are_interpolated() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(matte([1.0; 3]));
    build.floor(0.0, 1.0, material);
    // (1, 1, 0) at the two corners of x = -1, (1, -1, 0) mirrored at those of x = 1: in the middle straight up.
    let tilts = [-1.0_f32, 1.0, 1.0, -1.0];
    for (normal, x) in build.scene.geometry.normals.iter_mut().zip(tilts) {
        *normal = glam::Vec3::new(x, 1.0, 0.0).normalize();
    }
    let at = |x: f64| {
        first_hit(&build, [x, 1.0, 0.1], DOWN)
            .unwrap()
            .shading_normal
    };
    assert_rgb(at(0.0), UP);
    // Halfway to the corner: (1/2, 1) before normalisation.
    assert_rgb_within(at(0.5), [1.0 / 5_f64.sqrt(), 2.0 / 5_f64.sqrt(), 0.0], 1e-6);
}

#[test]
fn shading_normals_that_face_away_give_way() {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(matte([1.0; 3]));
    build.floor(0.0, 1.0, material);
    build
        .scene
        .geometry
        .normals
        .fill(glam::Vec3::new(1.0, 0.1, 0.0).normalize());
    let from_the_left = first_hit(&build, [-0.5, 0.5, 0.1], [0.5, -0.5, 0.0]).unwrap();
    assert_eq!(from_the_left.shading_normal, UP);
    let from_the_right = first_hit(&build, [0.5, 0.5, 0.1], [-0.5, -0.5, 0.0]).unwrap();
    assert!(from_the_right.shading_normal[0] > 0.9);
    build.scene.geometry.normals.fill(glam::Vec3::ZERO);
    assert_eq!(
        first_hit(&build, [0.1, 0.5, 0.1], DOWN)
            .unwrap()
            .shading_normal,
        UP
    );
}

/// The shading normal of a floor (tangent +x, normal +y) with a normal map of one texel, from above or below.
fn mapped(texel: [u8; 3], scale: f32, handedness: f32, direction: [f64; 3]) -> [f64; 3] {
    let mut build = Build::before([0.0; 3]);
    let [r, g, b] = texel;
    let map = build.texture(&[&[[r, g, b, 255]]], Wrap::Repeat, Filter::Linear, false);
    let material = Material {
        normal_texture: Some(map),
        normal_scale: scale,
        double_sided: true,
        ..matte([1.0; 3])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    for tangent in &mut build.scene.geometry.tangents {
        tangent.w = handedness;
    }
    first_hit(&build, [0.1, -direction[1], 0.2], direction)
        .unwrap()
        .shading_normal
}

#[test]
fn normal_maps_tilt_along_tangent_and_bitangent() {
    let unit = |x: f64, y: f64, z: f64| [x, y, z].map(|k| k / (x * x + y * y + z * z).sqrt());
    let value = |byte: u8| 2.0 * f64::from(byte) / 255.0 - 1.0;
    let (x, y, z) = (value(180), value(90), value(230));
    // cross(normal, tangent) = cross(+y, +x) = -z.
    assert_rgb(mapped([180, 90, 230], 1.0, 1.0, DOWN), unit(x, z, -y));
    assert_rgb(mapped([180, 90, 230], 1.0, -1.0, DOWN), unit(x, z, y));
    assert_rgb(
        mapped([180, 90, 230], 0.5, 1.0, DOWN),
        unit(0.5 * x, z, -0.5 * y),
    );
    assert_rgb(mapped([180, 90, 230], 1.0, 1.0, UP), unit(-x, -z, y));
}

#[test]
fn vanishing_tangents_leave_the_normal() {
    let mut build = Build::before([0.0; 3]);
    let map = build.texture(
        &[&[[255, 128, 128, 255]]],
        Wrap::Repeat,
        Filter::Linear,
        false,
    );
    let material = build.material(Material {
        normal_texture: Some(map),
        ..matte([1.0; 3])
    });
    build.floor(0.0, 1.0, material);
    for useless in [glam::Vec4::ZERO, glam::Vec4::new(0.0, 1.0, 0.0, 1.0)] {
        build.scene.geometry.tangents.fill(useless);
        assert_eq!(
            first_hit(&build, [0.1, 1.0, 0.2], DOWN)
                .unwrap()
                .shading_normal,
            UP
        );
    }
}

#[test]
fn base_is_factor_times_vertex_colour_times_texture() {
    let mut build = Build::before([0.0; 3]);
    let texture = build.texture(&[&[[51, 255, 0, 255]]], Wrap::Repeat, Filter::Linear, false);
    let material = Material {
        base_color_texture: Some(texture),
        ..unlit([0.5, 0.5, 1.0])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    // Red rises from 0 at x = -1 to 1 at x = 1.
    for (color, red) in build
        .scene
        .geometry
        .colors
        .iter_mut()
        .zip([0.0, 1.0, 1.0, 0.0])
    {
        *color = [red, 0.5, 1.0, 1.0].into();
    }
    let expected = [0.5 * 0.75 * 0.2, 0.25, 0.0];
    assert_rgb(build.radiance([0.5, 1.0, 0.1], DOWN), expected);
    assert_rgb(
        first_hit(&build, [0.5, 1.0, 0.1], DOWN).unwrap().base,
        expected,
    );
}

#[test]
fn hits_know_their_material_and_node() {
    let mut build = Build::before([0.0; 3]);
    let (a, b) = (
        build.material(unlit([1.0; 3])),
        build.material(unlit([0.0; 3])),
    );
    build.floor(-1.0, 1.0, a);
    build.floor(0.0, 1.0, b);
    build.scene.geometry.triangles[2].node = 5;
    build.scene.geometry.triangles[3].node = 5;
    let hit = first_hit(&build, [0.1, 1.0, 0.2], DOWN).unwrap();
    assert_eq!((hit.material, hit.node, hit.alpha), (1, 5, 1.0));
}

#[test]
fn unlit_is_its_base_colour_and_nothing_else() {
    let mut build = Build::before([1.0; 3]);
    build.point_light([0.0, 1.0, 0.0], 100.0);
    build.scene.surroundings.ambient = [1.0; 3].into();
    let material = Material {
        emissive: [1.0; 3].into(),
        transmission: 1.0,
        ..unlit([0.25, 0.5, 1.0])
    };
    let material = build.material(material);
    build.floor(0.0, 1.0, material);
    let picture = build
        .oracle()
        .render(&looking([0.1, 0.5, 0.2], DOWN), &one_ray());
    assert_rgb(picture.at(0, 0), [0.25, 0.5, 1.0]);
    assert_eq!(
        picture.rays,
        raytree_oracle::Rays {
            primary: 1,
            ..Default::default()
        }
    );
}
