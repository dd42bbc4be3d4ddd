//! What is folded into factors, what is dropped, and what has to stay.

use glam::DVec3;

use super::*;
use crate::features::SceneFeatures;
use crate::model::{Light, LightKind};
use crate::test_scenes::{dielectric, glass, pane, texture, triangles};

/// The first material of a scene with a triangle for each, in which textures of one value become factors.
fn first(scene: &Scene) -> Material {
    let mut scene = scene.clone();
    simplify(&mut scene);
    scene.materials.swap_remove(0)
}

/// A scene of one material with every kind of texture, all of them of this one texel.
fn all_of(texel: [u8; 4]) -> Scene {
    let mut scene = triangles([Material {
        base_color: Vec4::new(0.5, 0.25, 1.0, 0.5),
        alpha_mode: AlphaMode::Blend,
        metallic: 0.5,
        roughness: 0.25,
        emissive: Vec3::new(1.0, 2.0, 4.0),
        transmission: 0.5,
        specular: 0.5,
        specular_color: Vec3::new(2.0, 1.0, 0.5),
        normal_scale: 0.0,
        ..Material::default()
    }]);
    let plain = texture(&mut scene, &[texel; 4]);
    let encoded = texture(&mut scene, &[texel; 4]);
    scene.textures[encoded.texture as usize].srgb = true;
    let [
        base,
        metal,
        normal,
        occlusion,
        emissive,
        transmission,
        specular,
        tint,
    ] = scene.materials[0].texture_slots_mut();
    for slot in [metal, normal, occlusion, transmission, specular] {
        *slot = Some(plain);
    }
    for slot in [base, emissive, tint] {
        *slot = Some(encoded);
    }
    scene
}

#[test]
fn one_value_becomes_part_of_the_factor() {
    let scene = all_of([255, 51, 204, 102]);
    let (before, after) = (&scene.materials[0], first(&scene));
    let [green, blue] = [51.0_f64, 204.0].map(|code| (((code / 255.0) + 0.055) / 1.055).powf(2.4));
    let decoded = Vec3::new(1.0, green as f32, blue as f32);
    let plain = Vec4::new(1.0, 51.0 / 255.0, 204.0 / 255.0, 102.0 / 255.0);
    let expected = Material {
        base_color: before.base_color * decoded.extend(plain.w),
        metallic: 0.5 * plain.z,
        roughness: 0.25 * plain.y,
        emissive: before.emissive * decoded,
        transmission: 0.5,
        specular: 0.5 * plain.w,
        specular_color: before.specular_color * decoded,
        base_color_texture: None,
        metallic_roughness_texture: None,
        normal_texture: None,
        occlusion_texture: None,
        emissive_texture: None,
        transmission_texture: None,
        specular_texture: None,
        specular_color_texture: None,
        ..before.clone()
    };
    assert_eq!(after, expected);
}

#[test]
fn what_then_is_read_by_nothing_is_dropped() {
    let mut scene = all_of([255, 51, 204, 102]);
    scene.geometry.colors = vec![Vec4::ONE; 3];
    simplify(&mut scene);
    let geometry = &scene.geometry;
    assert!(scene.images.is_empty() && scene.textures.is_empty());
    assert!(geometry.uv_sets.is_empty() && geometry.tangents.is_empty());
    assert!(geometry.colors.is_empty());
    let found = SceneFeatures::of(&scene);
    assert!(!found.textures && !found.normal_maps && !found.vertex_colors);
}

#[test]
fn what_is_read_stays_under_its_new_number() {
    let mut scene = triangles([dielectric(), dielectric()]);
    let flat = texture(&mut scene, &[[9; 4]; 2]);
    let unread = texture(&mut scene, &[[1; 4], [2; 4]]);
    let mut varied = texture(&mut scene, &[[3; 4], [4; 4]]);
    scene.geometry.uv_sets = (0..3)
        .map(|set| vec![glam::Vec2::splat(set as f32); 6])
        .collect();
    varied.uv_set = 2;
    scene.materials[0].base_color_texture = Some(flat);
    scene.materials[1].base_color_texture = Some(varied);
    // Not lit by anything of its own.
    scene.materials[1].emissive_texture = Some(unread);
    simplify(&mut scene);
    assert_eq!(scene.materials[0].base_color_texture, None);
    let kept = scene.materials[1].base_color_texture.unwrap();
    assert_eq!((kept.texture, kept.uv_set), (0, 0));
    assert_eq!(scene.materials[1].emissive_texture, None);
    assert_eq!(scene.geometry.uv_sets, [vec![glam::Vec2::splat(2.0); 6]]);
    assert_eq!((scene.textures.len(), scene.textures[0].image), (1, 0));
    assert_eq!(scene.images.len(), 1);
    assert_eq!(scene.images[0].texels, [[3; 4], [4; 4]]);
}

/// In the channels that count: those that a slot reads and a factor above zero lets through.
#[test]
fn one_value_is_judged_by_the_channels_that_show() {
    let folds = |texels: &[[u8; 4]], make: fn(TextureRef) -> Material| {
        let mut scene = triangles([Material::default()]);
        let texture = texture(&mut scene, texels);
        scene.materials[0] = make(texture);
        first(&scene).texture_refs().next().is_none()
    };
    let base = |image| Material {
        base_color_texture: Some(image),
        ..Material::default()
    };
    assert!(
        folds(&[[1, 2, 3, 4], [1, 2, 3, 5]], base),
        "alpha of what is opaque"
    );
    let blend = |image| Material {
        base_color_texture: Some(image),
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    };
    assert!(!folds(&[[1, 2, 3, 4], [1, 2, 3, 5]], blend));
    assert!(!folds(&[[1, 2, 3, 4], [1, 2, 4, 4]], base));
    let rough = |image| Material {
        metallic_roughness_texture: Some(image),
        metallic: 0.0,
        ..Material::default()
    };
    assert!(
        folds(&[[1, 2, 3, 4], [9, 2, 9, 9]], rough),
        "red, and metal without a factor"
    );
    assert!(!folds(&[[1, 2, 3, 4], [1, 3, 3, 4]], rough));
}

#[test]
fn what_has_no_factor_to_go_into_stays() {
    let with = |texel, change: fn(&mut Material, TextureRef)| {
        let mut scene = triangles([Material::default()]);
        let texture = texture(&mut scene, &[texel; 2]);
        change(&mut scene.materials[0], texture);
        first(&scene)
    };
    let occlusion = |m: &mut Material, image| m.occlusion_texture = Some(image);
    assert!(with([254; 4], occlusion).occlusion_texture.is_some());
    assert!(with([255, 0, 0, 0], occlusion).occlusion_texture.is_none());
    let normal = |m: &mut Material, image| m.normal_texture = Some(image);
    assert!(with([128, 128, 255, 255], normal).normal_texture.is_some());
    let flat = |m: &mut Material, image| (m.normal_texture, m.normal_scale) = (Some(image), 0.0);
    assert!(with([9, 9, 255, 255], flat).normal_texture.is_none());
    assert!(
        with([9, 9, 100, 255], flat).normal_texture.is_some(),
        "it points inwards"
    );
}

#[test]
fn what_is_never_seen_through_is_opaque() {
    let mode = |texels: &[[u8; 4]], alpha_mode, others: &[Material]| {
        let materials = [Material::default()];
        let mut scene = triangles(materials.into_iter().chain(others.iter().cloned()));
        let image = texture(&mut scene, texels);
        scene.textures[0].filter = crate::model::Filter::Linear;
        scene.materials[0].alpha_mode = alpha_mode;
        scene.materials[0].base_color_texture = Some(image);
        first(&scene).alpha_mode
    };
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    let (whole, holed) = (
        [[1, 2, 3, 255], [4, 5, 6, 255]],
        [[1, 2, 3, 255], [4, 5, 6, 0]],
    );
    for alpha_mode in [mask, AlphaMode::Blend] {
        assert_eq!(mode(&whole, alpha_mode, &[]), AlphaMode::Opaque);
        assert_eq!(mode(&holed, alpha_mode, &[]), alpha_mode);
        // What is opaque joins the face of a solid that it lies on, what may be seen through does not.
        assert_eq!(mode(&whole, alpha_mode, &[glass()]), alpha_mode);
        assert_eq!(mode(&whole, alpha_mode, &[pane()]), AlphaMode::Opaque);
    }
}

#[test]
fn what_no_longer_transmits_is_seen_from_behind() {
    let closed = |others: &[Material]| {
        let mut scene = triangles([pane()].into_iter().chain(others.iter().cloned()));
        let image = texture(&mut scene, &[[0; 4]]);
        scene.materials[0].transmission_texture = Some(image);
        first(&scene)
    };
    let material = closed(&[]);
    assert_eq!((material.transmission, material.double_sided), (0.0, true));
    assert_eq!(material.transmission_texture, None);
    let beside_glass = closed(&[glass()]);
    assert!(beside_glass.transmission == 1.0 && beside_glass.transmission_texture.is_some());
}

#[test]
fn a_material_that_no_triangle_has_reads_nothing() {
    let mut scene = triangles([dielectric()]);
    let image = texture(&mut scene, &[[1; 4], [2; 4]]);
    scene.materials.push(Material {
        base_color_texture: Some(image),
        ..dielectric()
    });
    simplify(&mut scene);
    assert_eq!(scene.materials.len(), 2);
    assert!(scene.materials[1].base_color_texture.is_none() && scene.images.is_empty());
}

#[test]
fn dark_lights_go_but_for_the_last() {
    let light = |intensity: f64| Light {
        name: intensity.to_string(),
        kind: LightKind::Directional {
            direction: DVec3::X,
        },
        intensity: DVec3::splat(intensity),
    };
    let left = |intensities: &[f64]| {
        let mut scene = Scene {
            lights: intensities.iter().copied().map(light).collect(),
            ..Scene::default()
        };
        simplify(&mut scene);
        scene
            .lights
            .into_iter()
            .map(|light| light.name)
            .collect::<Vec<_>>()
    };
    assert_eq!(left(&[0.0, 1.0, 0.0, 2.0]), ["1", "2"]);
    assert_eq!(left(&[0.0, 0.0]), ["0"], "else the studio would light it");
    assert!(left(&[]).is_empty());
}

/// What is simple stays as it is: a second pass finds nothing.
#[test]
fn once_is_enough() {
    let mut scene = all_of([255, 51, 204, 102]);
    simplify(&mut scene);
    let materials = scene.materials.clone();
    simplify(&mut scene);
    assert_eq!(scene.materials, materials);
}
