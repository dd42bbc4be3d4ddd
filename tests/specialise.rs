//! A picture never depends on what its program could do, nor on what was left out of its scene for not showing: the program of a
//! scene without what can't show gives the same bytes as one with everything does of the scene as its file says it (on GPUs the same
//! but for rounding). The judge is the renderer itself; what it must not do is differ.

mod support;

#[path = "support/alike.rs"]
mod alike;

#[path = "support/everything.rs"]
mod everything;

use std::path::Path;

use alike::{Alike, Words};
use everything::{everything, filled};
use glam::{DVec3, Vec2, Vec3, Vec4};
use raytree::{
    Device, Environment, Feature, Film, ProgramFeatures, RenderSettings, Rendering, Scene, Shading,
    model::{
        AlphaMode, Filter, Image, Light, LightKind, Material, Texture, TextureRef, Volume,
        WhittedCoefficients, Wrap,
    },
};
use raytree_gpu::Rendered;
use raytree_scene::environment::EquirectMap;
use raytree_stress::scenes::{Build, clear_glass, matte, pinhole, unfiltered};

fn render_with_everything(
    device: &Device,
    scene: Scene,
    settings: &RenderSettings,
    special: ProgramFeatures,
) -> Rendered {
    let scene = filled(scene);
    let bvh = raytree::build_bvh(&scene, raytree::Preset::default()).unwrap();
    raytree_gpu::render_with(
        device,
        &scene,
        &bvh,
        settings,
        everything(settings, special),
        &mut raytree::unobserved,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

fn simplified(mut scene: Scene) -> Scene {
    raytree::simplify(&mut scene);
    scene
}

/// In how many of its words a film is not the same as another, if in any.
fn difference(device: &Device, expected: &Film, actual: &Film) -> Option<String> {
    Alike::on(device).difference(&Words::of(expected), &Words::of(actual))
}

/// What differs between the special program's picture of the simplified scene and the general one's of the scene as it is, and the
/// former.
fn compare(
    device: &Device,
    scene: Scene,
    settings: &RenderSettings,
) -> (Option<String>, Rendering) {
    let special = support::render(device, &simplified(scene.clone()), settings);
    let general = render_with_everything(device, scene, settings, special.features);
    assert_ne!(special.features, general.features, "nothing is left out");
    let counted = Alike::on(device).counted(general.counters, special.counters);
    let differing = difference(device, &general.film, &special.film);
    (differing.or(counted), special)
}

fn settings(scene: &Scene, shading: Shading) -> RenderSettings {
    let mut settings = RenderSettings::new(48, 36, support::camera(scene));
    settings.max_depth = 5;
    settings.shading = shading;
    settings.aovs = true;
    settings.counters = true;
    settings
}

#[test]
fn every_own_scene_is_the_same_by_a_program_that_could_do_more() {
    let Some(device) = support::device() else {
        return;
    };
    let mut faults = Vec::new();
    for path in support::own_scenes() {
        let mut scene = import(&path);
        raytree::light_if_dark(&mut scene);
        for shading in [Shading::Pbr, Shading::Whitted] {
            let (found, _) = compare(device, scene.clone(), &settings(&scene, shading));
            let name = support::stem(&path);
            faults.extend(found.map(|found| format!("{name}, {shading:?}: {found}")));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn import(path: &Path) -> Scene {
    raytree::import_unsimplified(path).unwrap_or_else(|error| panic!("{error}"))
}

/// Squares side by side, seen from above under a light and an environment, and a corner of a box beneath them: whatever lets light
/// through shows it.
fn squares(materials: impl IntoIterator<Item = Material>) -> Scene {
    let mut build = Build::before([0.2, 0.3, 0.4]);
    let floor = build.material(Material {
        base_color: Vec4::new(0.2, 0.5, 0.8, 1.0),
        roughness: 0.2,
        double_sided: true,
        ..Material::default()
    });
    build.square(-0.3 * Vec3::Z, Vec3::Z, 1.0, floor);
    for (material, k) in materials.into_iter().zip(0_u16..) {
        let material = build.material(material);
        let (column, row) = (f32::from(k % 5), f32::from(k / 5));
        let middle = Vec3::new(0.4 * column - 0.8, 0.6 - 0.4 * row, 0.05 * column);
        let normal = if k % 2 == 0 {
            Vec3::Z
        } else {
            Vec3::new(0.3, 0.2, -1.0)
        };
        build.square(middle, normal, 0.18, material);
    }
    let vertices = build.0.geometry.positions.len();
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let uv = (0..vertices).map(|vertex| 1.7 * corners[vertex % 4]);
    build.0.geometry.uv_sets = vec![uv.collect()];
    build.0.geometry.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); vertices];
    build.0.geometry.colors = vec![Vec4::ONE; vertices];
    for (x, intensity) in [(0.4, 3.0), (-0.6, 0.0)] {
        let direction = DVec3::new(x, 0.3, -1.0).normalize();
        build.light(LightKind::Directional { direction }, intensity);
    }
    build.0.surroundings.environment = Some(gradient());
    build.0
}

fn gradient() -> Environment {
    let texel = |k: u8| [0.1 * f32::from(k), 0.3, 0.8 - 0.1 * f32::from(k)];
    unfiltered(EquirectMap {
        width: 2,
        height: 4,
        texels: (0..8).map(texel).collect(),
    })
}

fn from_above(shading: Shading) -> RenderSettings {
    let mut settings = settings(&Scene::default(), shading);
    settings.camera = pinhole(Vec3::new(0.3, -0.6, 2.4), Vec3::ZERO, 0.8);
    settings
}

/// A texture of the scene that has this texel everywhere.
fn texture(scene: &mut Scene, texel: [u8; 4], srgb: bool) -> TextureRef {
    scene.images.push(Image {
        name: format!("{texel:?}"),
        width: 3,
        height: 2,
        texels: vec![texel; 6],
    });
    scene.textures.push(Texture {
        image: scene.images.len() as u32 - 1,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::MirroredRepeat,
        // Filtered, the weights' sum is rounded: crates/scene/simplify.rs.
        filter: Filter::Nearest,
        srgb,
    });
    TextureRef {
        texture: scene.textures.len() as u32 - 1,
        uv_set: 0,
        transform: TextureRef::IDENTITY,
    }
}

/// Of all kinds but solids, which keep some of the rest from being left out.
fn materials() -> Vec<Material> {
    let plain = Material {
        base_color: Vec4::new(0.9, 0.8, 0.7, 1.0),
        metallic: 0.3,
        roughness: 0.35,
        specular_color: Vec3::new(1.0, 0.9, 0.8),
        ..Material::default()
    };
    let of = |change: fn(&mut Material)| {
        let mut material = plain.clone();
        change(&mut material);
        material
    };
    vec![
        plain.clone(),
        of(|m| m.double_sided = true),
        of(|m| m.transmission = 0.7),
        of(|m| (m.transmission, m.metallic) = (0.7, 1.0)),
        of(|m| m.alpha_mode = AlphaMode::Blend),
        of(|m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.4 }),
        of(|m| m.emissive = Vec3::new(0.1, 0.2, 0.3)),
        of(|m| m.unlit = true),
        of(|m| m.normal_scale = 0.0),
        of(|m| (m.specular, m.metallic) = (0.0, 0.0)),
        of(|m| m.roughness = 1.0),
        of(|m| m.base_color = Vec4::new(0.0, 0.0, 0.0, 1.0)),
    ]
}

/// Each material with a texture of one value wherever one can be, but for the normal.
fn textured(texels: impl Iterator<Item = [u8; 4]> + Clone) -> Scene {
    let mut scene = squares(materials());
    let mut texels = texels.cycle();
    let mut next = |scene: &mut Scene, srgb| {
        Some(texture(
            scene,
            texels.next().expect("it goes on for ever"),
            srgb,
        ))
    };
    for k in 1..scene.materials.len() {
        let mut m = scene.materials[k].clone();
        m.base_color_texture = next(&mut scene, true);
        m.metallic_roughness_texture = next(&mut scene, false);
        m.occlusion_texture = next(&mut scene, false);
        m.emissive_texture = next(&mut scene, true);
        m.transmission_texture = next(&mut scene, false);
        m.specular_texture = next(&mut scene, false);
        m.specular_color_texture = next(&mut scene, true);
        scene.materials[k] = m;
    }
    scene
}

fn assert_same(device: &Device, what: &str, scene: &Scene) -> ProgramFeatures {
    let mut features = ProgramFeatures::default();
    for shading in [Shading::Pbr, Shading::Whitted] {
        let (found, special) = compare(device, scene.clone(), &from_above(shading));
        assert_eq!(found, None, "{what}, {shading:?}");
        features = special.features;
    }
    features
}

/// Factors instead of textures, whatever the codes: the host decodes as the shaders do.
#[test]
fn textures_of_one_value_may_be_factors() {
    let Some(device) = support::device() else {
        return;
    };
    // 84 textures, each of four codes: all 256, and the ends once more.
    let codes = |k: u8| {
        let code = k.wrapping_mul(4);
        [code, code + 1, code + 2, code + 3]
    };
    let ends = [[0; 4], [255; 4]].into_iter();
    let found = assert_same(
        device,
        "all codes",
        &textured((0..64).map(codes).chain(ends)),
    );
    // Occlusion has no factor to go into.
    assert!(found.has(Feature::Textures));
    for texel in [
        [255; 4],
        [255, 255, 255, 0],
        [0, 0, 0, 255],
        [255, 200, 100, 130],
    ] {
        let what = format!("{texel:?}");
        let found = assert_same(device, &what, &textured([texel].into_iter()));
        assert_eq!(found.has(Feature::Textures), texel[0] == 0, "{what}");
    }
}

/// What a material names without effect, with glass beside it and without.
#[test]
fn what_cannot_show_may_go() {
    let Some(device) = support::device() else {
        return;
    };
    for with_glass in [false, true] {
        let glass = Material {
            volume: Some(Volume {
                attenuation_color: Vec3::ONE,
                attenuation_distance: f64::INFINITY,
            }),
            transmission: 1.0,
            metallic: 0.0,
            roughness: 0.0,
            ..Material::default()
        };
        let others = with_glass.then_some(glass);
        let mut scene = squares(materials().into_iter().chain(others));
        let image = texture(&mut scene, [90, 130, 200, 0], false);
        scene.images[0].texels[2] = [200, 20, 220, 255];
        for m in &mut scene.materials[1..] {
            m.occlusion_strength = 0.0;
            m.emissive = Vec3::ZERO;
            m.specular = 0.0;
            (m.emissive_texture, m.occlusion_texture) = (Some(image), Some(image));
            (m.specular_texture, m.specular_color_texture) = (Some(image), Some(image));
        }
        // Never seen: no triangle has it.
        scene.materials.push(Material {
            alpha_mode: AlphaMode::Mask { cutoff: 2.0 },
            unlit: true,
            base_color_texture: Some(image),
            ..Material::default()
        });
        let found = assert_same(device, &format!("glass: {with_glass}"), &scene);
        let left_out = [
            Feature::Textures,
            Feature::VertexColors,
            Feature::Mask,
            Feature::Blend,
            Feature::ManyLights,
        ];
        assert_eq!(left_out.map(|feature| found.has(feature)), [false; 5]);
    }
}

/// `extras.whitted.kt` alone makes a solid, and what fills it absorbs.
#[test]
fn solids_of_the_book_absorb() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = squares([Material {
        whitted: Some(WhittedCoefficients {
            kt: Some(Vec3::splat(0.8)),
            ..WhittedCoefficients::default()
        }),
        volume: Some(Volume {
            attenuation_color: Vec3::new(0.9, 0.5, 0.2),
            attenuation_distance: 0.2,
        }),
        ..Material::default()
    }]);
    assert!(assert_same(device, "kt", &scene).has(Feature::Absorption));
}

/// What a program keeps of a slot beside its sum lies elsewhere in each of these: faces in contact, traversals that may be suspended, lights that
/// are left.
#[test]
fn slots_have_room_for_what_a_program_leaves() {
    let Some(device) = support::device() else {
        return;
    };
    for in_contact in [true, false] {
        for is_large in [true, false] {
            for lights in [1, 3_u16] {
                let scene = blocks(in_contact, is_large, lights);
                let what = format!("{in_contact} {is_large} {lights}");
                let found = assert_same(device, &what, &scene);
                let expected = [in_contact, is_large, lights > 1];
                let features = [Feature::Contact, Feature::LongRays, Feature::ManyLights];
                assert_eq!(features.map(|feature| found.has(feature)), expected);
            }
        }
    }
}

/// Two blocks of glass, one on the other or above it, and a ball.
fn blocks(in_contact: bool, is_large: bool, lights: u16) -> Scene {
    let mut build = Build::before([0.2, 0.3, 0.4]);
    let glass = build.material(clear_glass(1.5));
    let water = build.material(clear_glass(1.3));
    let stone = build.material(matte([0.7, 0.5, 0.3]));
    build.square(-0.6 * Vec3::Z, Vec3::Z, 1.5, stone);
    let gap = if in_contact { 0.0 } else { 0.05 };
    build.cuboid(Vec3::new(-0.5, -0.4, -0.5), Vec3::new(0.3, 0.4, 0.0), glass);
    let low = Vec3::new(-0.3, -0.5, gap);
    build.cuboid(low, Vec3::new(0.5, 0.3, 0.4 + gap), water);
    let levels = if is_large { 4 } else { 1 };
    build.ball(Vec3::new(0.8, 0.5, 0.0), 0.25, levels, glass);
    for k in 0..lights {
        let direction = DVec3::new(0.3 * f64::from(k) - 0.2, 0.3, -1.0).normalize();
        build.light(LightKind::Directional { direction }, 2.0);
    }
    build.0.surroundings.environment = Some(gradient());
    build.0
}

#[test]
fn a_black_environment_hides_a_background() {
    let Some(device) = support::device() else {
        return;
    };
    let mut scene = squares(materials());
    scene.surroundings.environment = Some(unfiltered(EquirectMap {
        width: 1,
        height: 1,
        texels: vec![[0.0; 3]],
    }));
    assert!(assert_same(device, "before blue", &scene).has(Feature::Environment));
    scene.surroundings.background = raytree::Background::Environment;
    assert!(!assert_same(device, "black", &scene).has(Feature::Environment));
}

/// The comparison has to be able to fail: a program without what a scene needs gives another picture, and so does a scene without
/// what shows.
#[test]
fn what_shows_is_missed() {
    let Some(device) = support::device() else {
        return;
    };
    let scene = squares(materials());
    let settings = from_above(Shading::Pbr);
    let (found, special) = compare(device, scene.clone(), &settings);
    assert_eq!(found, None);
    let bvh = raytree::build_bvh(&scene, raytree::Preset::default()).unwrap();
    for feature in [
        Feature::Culling,
        Feature::Unlit,
        Feature::Reflection,
        Feature::Transmission,
        Feature::Lights,
        Feature::Environment,
    ] {
        let features = special.features.with(feature, false);
        let less = raytree_gpu::render_with(
            device,
            &scene,
            &bvh,
            &settings,
            features,
            &mut raytree::unobserved,
        )
        .unwrap_or_else(|error| panic!("{error}"));
        assert!(
            special.features.has(feature)
                && difference(device, &special.film, &less.film).is_some(),
            "{feature:?} is not missed"
        );
    }
    let mut darker = scene;
    darker.materials[1].base_color.x *= 0.999;
    let other = support::render(device, &darker, &settings);
    assert!(difference(device, &special.film, &other.film).is_some());
}

/// Where drivers round in their own ways, a last bit counts for nothing, but what is more does, and so do many of them.
#[test]
fn rounding_is_no_difference_and_more_is_one() {
    let mut film = Film::new(50, 40);
    film.radiance.fill([0.5; 3]);
    let with = |count: usize, factor: f32| {
        let mut other = film.clone();
        for value in other.radiance.as_flattened_mut().iter_mut().take(count) {
            *value *= factor;
        }
        let words = [&film, &other].map(Words::of);
        [Alike::Equal, Alike::Rounded].map(|judge| judge.difference(&words[0], &words[1]))
    };
    let rounded = 1.0 + f32::EPSILON;
    assert_eq!(with(0, 2.0), [None, None]);
    assert!(matches!(with(1, rounded), [Some(_), None]));
    assert!(matches!(with(6000, rounded), [Some(_), None]));
    assert!(matches!(with(10, 1.01), [Some(_), None]), "rays at edges");
    assert!(matches!(with(20, 1.01), [Some(_), Some(_)]));
    assert!(matches!(with(20, f32::NAN), [Some(_), Some(_)]));

    let counted = |shadow| {
        let mut counters = raytree::Counters::default();
        counters.rays.shadow = shadow;
        Some(counters)
    };
    let judged = |judge: Alike, shadow| judge.counted(counted(10_000), counted(shadow)).is_some();
    assert!(judged(Alike::Equal, 10_001) && !judged(Alike::Rounded, 10_001));
    assert!(judged(Alike::Rounded, 10_100));
}

/// .. and a scene that is lit by more lights than one differs by the last of them.
#[test]
fn a_light_that_shines_is_not_dropped() {
    let Some(device) = support::device() else {
        return;
    };
    let mut scene = squares(materials());
    let dim = Light {
        intensity: DVec3::splat(1e-3),
        ..scene.lights[0].clone()
    };
    scene.lights.push(dim);
    let found = assert_same(device, "three lights", &scene);
    assert!(found.has(Feature::ManyLights));
}
