//! What counts as needed, and what does not.

use glam::{DVec3, Vec4};

use super::*;
use crate::environment::{Environment, EquirectMap};
use crate::model::{Filter, Light, TextureRef, Volume, WhittedCoefficients};
use crate::test_scenes::{dielectric, glass, pane, texture, triangles};

/// Of a scene whose only triangle has this material.
fn of(material: Material) -> SceneFeatures {
    SceneFeatures::of(&triangles([material]))
}

/// As [`of`], of a material that may read an image of these texels.
fn of_textured(texels: &[[u8; 4]], make: impl FnOnce(TextureRef) -> Material) -> SceneFeatures {
    SceneFeatures::of(&textured(texels, make))
}

fn textured(texels: &[[u8; 4]], make: impl FnOnce(TextureRef) -> Material) -> Scene {
    let mut scene = triangles([Material::default()]);
    let texture = texture(&mut scene, texels);
    scene.materials[0] = make(texture);
    scene
}

/// As [`of`], of a triangle with these vertex colours.
fn of_colored(colors: [Vec4; 3], material: Material) -> SceneFeatures {
    let mut scene = triangles([material]);
    scene.geometry.colors = colors.to_vec();
    SceneFeatures::of(&scene)
}

const TEXELS: [[u8; 4]; 2] = [[10, 200, 30, 255], [200, 10, 60, 128]];
const OPAQUE_TEXELS: [[u8; 4]; 2] = [[10, 200, 30, 255], [200, 10, 60, 255]];

fn mask(cutoff: f32) -> Material {
    Material {
        alpha_mode: AlphaMode::Mask { cutoff },
        ..Material::default()
    }
}

fn blend(alpha: f32) -> Material {
    Material {
        alpha_mode: AlphaMode::Blend,
        base_color: Vec4::new(1.0, 1.0, 1.0, alpha),
        ..Material::default()
    }
}

#[test]
fn nothing_needs_nothing() {
    assert_eq!(
        SceneFeatures::of(&Scene::default()),
        SceneFeatures::default()
    );
}

/// Everything that a material can ask for, and no triangle that has it.
#[test]
fn a_material_that_no_triangle_has_does_not_count() {
    let mut scene = triangles([Material {
        double_sided: true,
        roughness: 1.0,
        ..Material::default()
    }]);
    let plain = SceneFeatures::of(&scene);
    let image = texture(&mut scene, &TEXELS);
    let everything = [
        Material {
            base_color_texture: Some(image),
            normal_texture: Some(image),
            ..mask(0.6)
        },
        blend(0.5),
        Material {
            unlit: true,
            ..Material::default()
        },
        Material {
            priority: 1,
            volume: Some(Volume {
                attenuation_color: Vec3::splat(0.5),
                attenuation_distance: 1.0,
            }),
            ..pane()
        },
        Material {
            whitted: Some(WhittedCoefficients {
                kt: Some(Vec3::ONE),
                ..WhittedCoefficients::default()
            }),
            ..glass()
        },
    ];
    scene.materials.extend(everything.clone());
    assert_eq!(SceneFeatures::of(&scene), plain);

    // The same materials count where triangles have them.
    let mut scene = triangles(everything);
    texture(&mut scene, &TEXELS);
    let found = SceneFeatures::of(&scene);
    let counted = [
        found.mask,
        found.blend,
        found.unlit,
        found.textures,
        found.normal_maps,
        found.mirrors,
        found.transmission,
        found.solids,
        found.absorption,
        found.priorities,
        found.whitted_transmission,
        found.culling,
    ];
    assert_eq!(counted, [true; 12]);
}

#[test]
fn a_mask_counts_where_it_cuts() {
    assert!(!of(mask(0.0)).mask && !of(mask(1.0)).mask);
    assert!(of(mask(1.5)).mask);
    let half = Vec4::new(1.0, 1.0, 1.0, 0.5);
    let faint = |cutoff| Material {
        base_color: half,
        ..mask(cutoff)
    };
    assert!(!of(faint(0.5)).mask && of(faint(0.6)).mask);
    let leaf = |cutoff| {
        of_textured(&TEXELS, |image| Material {
            base_color_texture: Some(image),
            ..mask(cutoff)
        })
    };
    // The lower alpha is 128 / 255.
    assert!(!leaf(0.5).mask && leaf(0.51).mask);
    let colors = [Vec4::ONE, half, Vec4::ONE];
    assert!(!of_colored(colors, mask(0.4)).mask);
    assert!(of_colored(colors, mask(0.6)).mask);
}

#[test]
fn blending_counts_where_alpha_is_not_one() {
    assert!(!of(blend(1.0)).blend && of(blend(0.5)).blend && of(blend(0.0)).blend);
    let image = |texels: &[[u8; 4]]| {
        textured(texels, |image| Material {
            base_color_texture: Some(image),
            ..blend(1.0)
        })
    };
    assert!(!SceneFeatures::of(&image(&OPAQUE_TEXELS)).blend);
    assert!(SceneFeatures::of(&image(&TEXELS)).blend);
    // The weights of four texels add up to 1 but for rounding.
    let mut filtered = image(&OPAQUE_TEXELS);
    filtered.textures[0].filter = Filter::Linear;
    assert!(SceneFeatures::of(&filtered).blend);
    let faint = Vec4::new(1.0, 1.0, 1.0, 0.5);
    assert!(of_colored([Vec4::ONE, Vec4::ONE, faint], blend(1.0)).blend);
    assert!(!of_colored([Vec4::new(0.5, 0.5, 0.5, 1.0); 3], blend(1.0)).blend);
}

/// A slot for a texture, and a material that has one there: with a factor that lets it show or not.
type Slot = (&'static str, fn(TextureRef, bool) -> Material);

const SLOTS: [Slot; 10] = [
    ("base colour", |image, shows| Material {
        base_color: if shows { Vec4::ONE } else { Vec4::W },
        base_color_texture: Some(image),
        ..dielectric()
    }),
    ("alpha", |image, shows| Material {
        base_color: Vec4::W,
        base_color_texture: Some(image),
        ..if shows { blend(1.0) } else { dielectric() }
    }),
    ("roughness", |image, shows| Material {
        roughness: f32::from(shows),
        metallic_roughness_texture: Some(image),
        ..dielectric()
    }),
    ("metallic", |image, shows| Material {
        metallic: f32::from(shows),
        metallic_roughness_texture: Some(image),
        ..dielectric()
    }),
    ("normal", |image, shows| Material {
        normal_texture: Some(image),
        normal_scale: f32::from(shows),
        ..dielectric()
    }),
    ("occlusion", |image, shows| Material {
        occlusion_texture: Some(image),
        occlusion_strength: f32::from(shows),
        ..dielectric()
    }),
    ("emission", |image, shows| Material {
        emissive: Vec3::splat(f32::from(shows)),
        emissive_texture: Some(image),
        ..dielectric()
    }),
    ("transmission", |image, shows| Material {
        transmission: f32::from(shows),
        transmission_texture: Some(image),
        ..dielectric()
    }),
    ("specular", |image, shows| Material {
        specular: f32::from(shows),
        specular_texture: Some(image),
        ..dielectric()
    }),
    ("specular colour", |image, shows| Material {
        specular_color: Vec3::splat(f32::from(shows)),
        specular_color_texture: Some(image),
        ..dielectric()
    }),
];

#[test]
fn a_texture_counts_where_its_factor_lets_it_show() {
    // Blue points outwards, as a normal map's does.
    let texels = [[10, 200, 130, 255], [200, 10, 160, 128]];
    for (name, make) in SLOTS {
        for shows in [true, false] {
            let found = of_textured(&texels, |image| make(image, shows));
            assert_eq!(found.textures, shows, "{name}");
            assert_eq!(found.normal_maps, shows && name == "normal", "{name}");
        }
        let unlit = of_textured(&texels, |image| Material {
            unlit: true,
            ..make(image, true)
        });
        // Normals are a layer of their own, whether lit or not.
        let seen = ["base colour", "alpha", "normal"].contains(&name);
        assert_eq!(unlit.textures, seen, "{name} of an unlit material");
    }
}

#[test]
fn a_normal_map_of_scale_zero_that_points_inwards_counts() {
    let flat = |blue| {
        of_textured(&[[128, 128, blue, 255]], |image| Material {
            normal_texture: Some(image),
            normal_scale: 0.0,
            ..Material::default()
        })
    };
    assert!(!flat(255).normal_maps && !flat(128).normal_maps);
    assert!(flat(127).normal_maps && flat(127).textures);
}

#[test]
fn a_normal_map_needs_tangents() {
    let mut scene = textured(&TEXELS, |image| Material {
        normal_texture: Some(image),
        ..Material::default()
    });
    assert!(SceneFeatures::of(&scene).normal_maps);
    scene.geometry.tangents.clear();
    assert!(!SceneFeatures::of(&scene).normal_maps);
}

#[test]
fn vertex_colors_count_where_they_are_not_white() {
    let red = Vec4::new(1.0, 0.0, 0.0, 1.0);
    let faint = Vec4::new(1.0, 1.0, 1.0, 0.5);
    let has = |color, material| of_colored([Vec4::ONE, Vec4::ONE, color], material).vertex_colors;
    assert!(!of(Material::default()).vertex_colors);
    assert!(!has(Vec4::ONE, Material::default()));
    assert!(has(red, Material::default()));
    // Brighter than white is not white.
    assert!(has(2.0 * Vec4::ONE, Material::default()));
    assert!(
        !has(faint, Material::default()),
        "alpha of an opaque material"
    );
    assert!(has(faint, mask(0.1)) && has(faint, blend(1.0)));
    let cyan = Material {
        base_color: Vec4::new(1.0, 0.0, 0.0, 1.0),
        ..Material::default()
    };
    assert!(!has(red, cyan), "channels that the factor takes out");

    // Of the corners that some triangle has.
    let mut scene = triangles([Material::default()]);
    scene.geometry.colors = vec![Vec4::ONE, Vec4::ONE, Vec4::ONE, red];
    assert!(!SceneFeatures::of(&scene).vertex_colors);
}

#[test]
fn a_mirror_is_smooth_and_reflects() {
    let with = |change: fn(&mut Material)| {
        let mut material = dielectric();
        change(&mut material);
        of(material).mirrors
    };
    assert!(with(|_| ()));
    assert!(!with(|m| m.roughness = ROUGHEST_MIRROR));
    assert!(!with(|m| m.unlit = true));
    assert!(!with(|m| m.specular = 0.0));
    assert!(!with(|m| m.ior = 1.0));
    assert!(with(|m| (m.specular, m.metallic) = (0.0, 0.5)));
    let textured = |roughness, green| {
        of_textured(&[[0, 255, 0, 0], [0, green, 0, 0]], |image| Material {
            roughness,
            metallic_roughness_texture: Some(image),
            ..Material::default()
        })
        .mirrors
    };
    assert!(textured(1.0, 100) && textured(0.3, 255) && textured(0.5, 200));
    assert!(!textured(1.0, 103) && !textured(0.5, 255));
}

#[test]
fn transmission_counts_where_it_has_a_weight() {
    let with = |change: fn(&mut Material)| {
        let mut material = pane();
        change(&mut material);
        of(material).transmission
    };
    assert!(with(|_| ()));
    assert!(!with(|m| m.transmission = 0.0));
    assert!(!with(|m| m.metallic = 1.0));
    assert!(!with(|m| m.unlit = true));
    assert!(!with(|m| m.base_color = Vec4::W));
    let black_glass = of(Material {
        base_color: Vec4::W,
        ..glass()
    });
    assert!(black_glass.solids && black_glass.transmission);
    assert!(!of(pane()).solids && of(glass()).solids);
}

#[test]
fn the_books_transmission_counts_above_zero() {
    let with = |kt| {
        let whitted = Some(WhittedCoefficients {
            kt,
            ..WhittedCoefficients::default()
        });
        of(Material {
            whitted,
            ..dielectric()
        })
        .whitted_transmission
    };
    assert!(with(Some(Vec3::X)) && !with(Some(Vec3::ZERO)) && !with(None));
}

#[test]
fn absorption_counts_of_what_bounds_a_solid() {
    let dim = Some(Volume {
        attenuation_color: Vec3::new(1.0, 0.5, 1.0),
        attenuation_distance: 2.0,
    });
    let with = |volume, transmission| {
        of(Material {
            volume,
            transmission,
            ..dielectric()
        })
        .absorption
    };
    assert!(with(dim, 1.0) && !with(dim, 0.0) && !with(None, 1.0));
    assert!(!of(glass()).absorption);
    let endless = dim.map(|volume| Volume {
        attenuation_distance: f64::INFINITY,
        ..volume
    });
    assert!(!with(endless, 1.0));
    // Under the book's model it is a solid by `kt` alone.
    let book = of(Material {
        volume: dim,
        whitted: Some(WhittedCoefficients {
            kt: Some(Vec3::ONE),
            ..WhittedCoefficients::default()
        }),
        ..dielectric()
    });
    assert!(book.absorption && !book.transmission);
}

#[test]
fn priorities_count_where_solids_differ() {
    let ranked = |priority, material: Material| Material {
        priority,
        ..material
    };
    let has = |materials: [Material; 2]| SceneFeatures::of(&triangles(materials)).priorities;
    assert!(has([glass(), ranked(1, glass())]));
    assert!(!has([ranked(1, glass()), ranked(1, glass())]));
    assert!(!has([glass(), ranked(1, pane())]));
}

#[test]
fn lights_count_where_one_shines() {
    let light = |intensity: f64| Light {
        name: String::new(),
        kind: LightKind::Spot {
            position: DVec3::ZERO,
            direction: DVec3::X,
            range: f64::INFINITY,
            inner_cone_angle: 0.1,
            outer_cone_angle: 0.2,
        },
        intensity: DVec3::new(0.0, intensity, 0.0),
    };
    let of = |intensities: &[f64]| {
        let scene = Scene {
            lights: intensities.iter().copied().map(light).collect(),
            ..Scene::default()
        };
        let found = SceneFeatures::of(&scene);
        (found.lights, found.spots)
    };
    assert_eq!(of(&[]), (0, false));
    assert_eq!(of(&[0.0, 0.0]), (0, false));
    assert_eq!(of(&[1.0]), (1, true));
    assert_eq!(of(&[0.0, 1.0]), (2, true));
}

#[test]
fn an_environment_counts_where_it_is_not_black() {
    let of = |radiance: f32, background| {
        let map = EquirectMap {
            width: 2,
            height: 1,
            texels: vec![[0.0; 3], [0.0, radiance, 0.0]],
        };
        let mut scene = Scene::default();
        scene.surroundings.environment = Some(Environment::new(map, 0.0));
        scene.surroundings.background = background;
        SceneFeatures::of(&scene).environment
    };
    assert!(of(1.0, Background::Environment) && of(1.0, Background::Transparent));
    assert!(!of(0.0, Background::Environment) && !of(0.0, Background::Transparent));
    // Mirrors show the environment, and black is not white.
    assert!(of(0.0, Background::Color(Vec3::ONE)));
    assert!(!of(0.0, Background::Color(Vec3::ZERO)));
    assert!(!SceneFeatures::of(&Scene::default()).environment);
}

#[test]
fn culling_counts_of_what_is_opaque_and_single_sided() {
    assert!(of(Material::default()).culling && !of(pane()).culling);
    let both = Material {
        double_sided: true,
        ..Material::default()
    };
    assert!(!of(both).culling);
}

#[test]
fn many_triangles_are_more_than_a_few() {
    let scene = |count: u64| triangles(vec![Material::default(); count as usize]);
    assert!(!SceneFeatures::of(&scene(FEW_TRIANGLES)).many_triangles);
    assert!(SceneFeatures::of(&scene(FEW_TRIANGLES + 1)).many_triangles);
}
