//! Cameras and lights.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;
use raytree_scene::model::{Camera, LightKind, Projection, Scene};
use serde_json::{Value, json};

use crate::builder::*;

/// The triangle four times as large (frame: origin (2, 2, 0) without camera, scale 1/4), and a node with `fields`.
fn beside(fields: Value) -> Gltf {
    let mut file = Gltf::triangle();
    file.json["nodes"][0]["scale"] = json!([4, 4, 4]);
    file.push("nodes", fields);
    file
}

fn camera(lens: Value, fields: Value) -> Gltf {
    let mut file = beside(fields);
    file.json["nodes"][1]["camera"] = json!(0);
    file.push("cameras", lens);
    file
}

fn perspective(yfov: f64) -> Value {
    json!({ "type": "perspective", "perspective": { "yfov": yfov, "znear": 0.1, "aspectRatio": 1.5 } })
}

#[test]
fn a_camera_without_transform_looks_along_minus_z() {
    let scene = camera(perspective(0.5), json!({})).import();
    let expected = Camera {
        name: "camera 0".to_owned(),
        // The point of the triangle's box that is nearest to it is where it stands.
        position: DVec3::ZERO,
        right: DVec3::X,
        up: DVec3::Y,
        forward: DVec3::NEG_Z,
        projection: Projection::Perspective {
            yfov: 0.5,
            aspect: Some(1.5),
        },
    };
    assert_eq!(scene.cameras, [expected]);
}

#[test]
fn a_narrow_camera_has_the_origin_where_it_looks() {
    // An eighth of a turn to the right: along +x and -z.
    let turn = -0.5 * FRAC_PI_4;
    let origin = |x: f64, lens: Value| {
        let node = json!({ "translation": [x, 1, 2], "rotation": [0, turn.sin(), 0, turn.cos()] });
        camera(lens, node).import().frame.origin.rounded()
    };
    let parallel = |ymag: f64| json!({ "type": "orthographic", "orthographic": { "xmag": 1, "ymag": ymag, "znear": 0.1, "zfar": 9 } });
    let (nearest, looked_at) = (DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
    for (x, lens, expected) in [
        (-1.0, perspective(0.5), nearest),
        (-1.0, perspective(1e-5), looked_at),
        (-1.0, parallel(0.1), nearest),
        (-1.0, parallel(1e-5), looked_at),
        // It looks past the triangle.
        (-9.0, perspective(1e-5), nearest),
    ] {
        let found = origin(x, lens.clone());
        assert!((found - expected).length() < 1e-12, "{x}, {lens}: {found}");
    }
}

#[test]
fn cameras_follow_their_nodes_but_not_their_scale() {
    let turn = FRAC_PI_4.sin();
    // A quarter turn about y: -z becomes -x, x becomes -z.
    let node = json!({ "rotation": [0, turn, 0, turn], "translation": [6, 2, 8], "scale": [3, 5, 7], "name": "eye" });
    let scene = camera(perspective(0.5), node).import();
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "eye");
    assert_eq!(
        scene.frame.to_world(camera.position),
        DVec3::new(6.0, 2.0, 8.0)
    );
    assert!((camera.forward - DVec3::NEG_X).length() < 1e-12);
    assert!((camera.right - DVec3::NEG_Z).length() < 1e-12);
    assert!((camera.up - DVec3::Y).length() < 1e-12);
}

#[test]
fn orthographic_sizes_are_in_scene_space() {
    let lens = json!({ "name": "plan", "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0, "zfar": 1 } });
    let scene = camera(lens, json!({})).import();
    assert_eq!(
        scene.cameras[0].projection,
        Projection::Orthographic {
            xmag: 0.5,
            ymag: 0.25
        }
    );
    assert_eq!(scene.cameras[0].name, "plan");
}

#[test]
fn cameras_come_in_the_order_of_their_nodes_and_only_from_the_scene() {
    let mut file = Gltf::triangle();
    file.push("cameras", perspective(0.5));
    for name in ["first", "unseen", "second"] {
        file.push("nodes", json!({ "camera": 0, "name": name }));
    }
    file.json["scenes"] = json!([{ "nodes": [3, 1, 0] }]);
    let names: Vec<_> = file
        .import()
        .cameras
        .into_iter()
        .map(|camera| camera.name)
        .collect();
    assert_eq!(names, ["first", "second"]);
}

#[test]
fn impossible_cameras_are_errors() {
    for yfov in [0.0, -1.0, 3.15] {
        assert!(
            camera(perspective(yfov), json!({}))
                .error()
                .contains("camera 0: yfov is")
        );
    }
    let ortho = |xmag: f64, ymag: f64| json!({ "type": "orthographic", "orthographic": { "xmag": xmag, "ymag": ymag, "znear": 0, "zfar": 1 } });
    for (xmag, ymag, field) in [(0.0, 1.0, "xmag"), (1.0, 0.0, "ymag"), (-1.0, 1.0, "xmag")] {
        assert!(
            camera(ortho(xmag, ymag), json!({}))
                .error()
                .contains(&format!("camera 0: {field} is"))
        );
    }
    for lens in [
        json!({}),
        json!({ "type": "perspective" }),
        json!({ "type": "fisheye", "fisheye": {} }),
    ] {
        assert!(
            camera(lens, json!({}))
                .error()
                .contains("camera 0: is neither")
        );
    }
    assert!(
        camera(
            json!({ "type": "perspective", "perspective": {} }),
            json!({})
        )
        .error()
        .contains("yfov is missing")
    );
}

#[test]
fn a_camera_of_scale_zero_is_left_out() {
    let scene = camera(perspective(0.5), json!({ "scale": [0, 0, 0] })).import();
    assert!(scene.cameras.is_empty());
    assert!(warnings(&scene)[0].starts_with("node 1: its scale is zero, so its camera"));
}

#[test]
fn a_mirrored_camera_stays_right_handed() {
    let scene = camera(perspective(0.5), json!({ "scale": [-1, 1, 1] })).import();
    assert_eq!(
        (scene.cameras[0].right, scene.cameras[0].up),
        (DVec3::X, DVec3::Y)
    );
    assert_eq!(scene.warnings.len(), 1);
}

fn light(light: Value, mut fields: Value) -> Gltf {
    fields["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    let mut file = beside(fields);
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    file
}

fn only_light(scene: &Scene) -> (&LightKind, DVec3) {
    assert_eq!(scene.lights.len(), 1);
    (&scene.lights[0].kind, scene.lights[0].intensity)
}

#[test]
fn directional_lights_keep_their_irradiance() {
    let sun = json!({ "type": "directional", "color": [1, 0.5, 0], "intensity": 3, "name": "sun" });
    let turn = FRAC_PI_4.sin();
    // A quarter turn about x: -z becomes y... and twice as large changes nothing.
    let scene = light(
        sun,
        json!({ "rotation": [turn, 0, 0, turn], "scale": [2, 2, 2] }),
    )
    .import();
    let (kind, intensity) = only_light(&scene);
    assert_eq!(intensity, DVec3::new(3.0, 1.5, 0.0));
    assert_eq!(scene.lights[0].name, "sun");
    let LightKind::Directional { direction } = kind else {
        panic!("{kind:?}")
    };
    assert!((direction - DVec3::Y).length() < 1e-12);
}

#[test]
fn point_lights_are_in_scene_space() {
    let lamp = json!({ "type": "point", "intensity": 32, "range": 8 });
    let scene = light(
        lamp,
        json!({ "translation": [2, 6, 4], "scale": [3, 3, 3] }),
    )
    .import();
    let (kind, intensity) = only_light(&scene);
    assert_eq!(
        *kind,
        LightKind::Point {
            position: DVec3::new(0.0, 1.0, 1.0),
            range: 2.0
        }
    );
    // At a world distance d: 32 / d^2; in scene space d / 4, so 32 / 16 = 2.
    assert_eq!(intensity, DVec3::splat(2.0));
    assert_eq!(scene.lights[0].name, "light 0");
}

#[test]
fn spot_lights_and_the_defaults() {
    let scene = light(json!({ "type": "spot", "spot": {} }), json!({})).import();
    let (kind, intensity) = only_light(&scene);
    let expected = LightKind::Spot {
        position: DVec3::new(-0.5, -0.5, 0.0),
        direction: DVec3::NEG_Z,
        range: f64::INFINITY,
        inner_cone_angle: 0.0,
        outer_cone_angle: FRAC_PI_4,
    };
    assert_eq!(*kind, expected);
    assert_eq!(intensity, DVec3::splat(1.0 / 16.0));

    let wide = json!({ "innerConeAngle": 0.25, "outerConeAngle": std::f32::consts::FRAC_PI_2 });
    let scene = light(json!({ "type": "spot", "spot": wide }), json!({})).import();
    let LightKind::Spot {
        inner_cone_angle,
        outer_cone_angle,
        ..
    } = only_light(&scene).0
    else {
        panic!()
    };
    assert_eq!((*inner_cone_angle, *outer_cone_angle), (0.25, FRAC_PI_2));
}

#[test]
fn impossible_lights_are_errors() {
    let spot = |inner: f64, outer: f64| json!({ "type": "spot", "spot": { "innerConeAngle": inner, "outerConeAngle": outer } });
    let broken = [
        (spot(0.5, 0.5), "cone angles"),
        (spot(-0.1, 0.5), "cone angles"),
        (spot(0.0, 1.6), "cone angles"),
        (json!({ "type": "point", "range": 0 }), "range is 0"),
        (
            json!({ "type": "point", "intensity": -1 }),
            "must be within 0 and",
        ),
        (
            json!({ "type": "point", "color": [1, -1, 1] }),
            "must be within 0 and",
        ),
        (
            json!({ "type": "point", "color": [1, 1] }),
            "color is not a list of 3",
        ),
        (
            json!({ "type": "point", "intensity": 1e300 }),
            "must be within 0 and",
        ),
        (json!({ "type": "area" }), "its type is not one of"),
        (json!({}), "its type is not one of"),
    ];
    for (json, problem) in broken {
        let message = light(json, json!({})).error();
        assert!(
            message.contains("light 0: ") && message.contains(problem),
            "{message}"
        );
    }
    let mut file = light(json!({ "type": "point" }), json!({}));
    file.json["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = json!(1);
    assert!(
        file.error()
            .contains("node 1: names a light that is not there")
    );
}

#[test]
fn lights_of_nodes_outside_the_scene_are_not_lit() {
    let mut file = light(json!({ "type": "point" }), json!({}));
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    assert!(file.import().lights.is_empty());
}
