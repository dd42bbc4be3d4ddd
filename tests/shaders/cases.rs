//! For each feature, what to render without it and what to render with it, alike but for that as far as can be.

use glam::{DMat3, DVec3, Vec2, Vec3, Vec4};
use raytree::{
    Camera, Feature, Numerics, ProgramFeatures, RenderSettings, Scene, SceneFeatures, Shading,
    Tolerance,
    model::{
        AlphaMode, Filter, Image, LightKind, Material, Texture, TextureRef, Volume,
        WhittedCoefficients, Wrap,
    },
};
use raytree_scene::{
    environment::EquirectMap,
    instances::{Instance, Placement, SharedMesh},
};
use raytree_stress::scenes::{Build, clear_glass, matte, parallel, pinhole, unfiltered};

/// A scene and how to render it.
pub struct Case {
    scene: Scene,
    settings: RenderSettings,
}

impl Case {
    /// A scene's own program.
    pub fn features(&self) -> ProgramFeatures {
        ProgramFeatures::of(&SceneFeatures::of(&self.scene), &self.settings)
    }
}

fn case(build: Build, change: impl FnOnce(&mut RenderSettings)) -> Case {
    let mut settings = RenderSettings::new(8, 8, pinhole(Vec3::Z, Vec3::ZERO, 0.5));
    change(&mut settings);
    Case {
        scene: build.0,
        settings,
    }
}

/// Squares one above the other, one of each material, as a file may have them: with all attributes, and an image.
fn squares(materials: &[Material]) -> Build {
    let mut build = Build::before([0.0; 3]);
    for (material, height) in materials.iter().zip(0_u16..) {
        let material = build.material(material.clone());
        let middle = 0.5 * f32::from(height) * Vec3::Z;
        build.square(middle, Vec3::Z, 0.5, material);
    }
    let vertices = build.0.geometry.positions.len();
    build.0.geometry.uv_sets = vec![vec![Vec2::ZERO; vertices]];
    build.0.geometry.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); vertices];
    build.0.images.push(Image {
        name: "two texels".to_owned(),
        width: 2,
        height: 1,
        // Blue as a normal map has it, out of the surface.
        texels: vec![[10, 20, 130, 255], [200, 210, 220, 0]],
    });
    build.0.textures.push(Texture {
        image: 0,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Linear,
        srgb: false,
    });
    build
}

/// Neither mirrors nor transmits, and both its sides are seen.
fn plain() -> Material {
    Material {
        double_sided: true,
        ..matte([1.0; 3])
    }
}

fn image() -> Option<TextureRef> {
    Some(TextureRef {
        texture: 0,
        uv_set: 0,
        transform: TextureRef::IDENTITY,
    })
}

fn mask(alpha: f32) -> Material {
    Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color: Vec4::new(1.0, 1.0, 1.0, alpha),
        ..plain()
    }
}

fn blend(alpha: f32) -> Material {
    Material {
        alpha_mode: AlphaMode::Blend,
        ..mask(alpha)
    }
}

fn mirror() -> Material {
    Material {
        metallic: 1.0,
        roughness: 0.0,
        ..plain()
    }
}

/// Lets light through and reflects none.
fn pane(transmission: f32) -> Material {
    Material {
        transmission,
        ..plain()
    }
}

fn glass(attenuation: f32, priority: i32) -> Material {
    Material {
        volume: Some(Volume {
            attenuation_color: Vec3::splat(attenuation),
            attenuation_distance: 1.0,
        }),
        priority,
        ..clear_glass(1.5)
    }
}

fn lit(mut build: Build, intensities: &[f64]) -> Build {
    let direction = DVec3::NEG_Z;
    for &intensity in intensities {
        build.light(LightKind::Directional { direction }, intensity);
    }
    build
}

fn surrounded(radiance: f32) -> Build {
    let mut build = squares(&[plain()]);
    build.0.surroundings.environment = Some(unfiltered(EquirectMap {
        width: 1,
        height: 1,
        texels: vec![[radiance; 3]],
    }));
    build
}

fn colored(color: Vec4) -> Build {
    let mut build = squares(&[plain()]);
    build.0.geometry.colors = vec![color; build.0.geometry.positions.len()];
    build
}

/// Two squares of glass, the second this far above the first.
fn stacked(distance: f32) -> Build {
    let mut build = Build::before([0.0; 3]);
    for (index, height) in [(1.5, 0.0), (1.3, distance)] {
        let material = build.material(clear_glass(index));
        build.square(height * Vec3::Z, Vec3::Z, 0.5, material);
    }
    build
}

/// The first of the squares' triangles where it is, the second as a mesh that is seen in two places.
fn placed(mut build: Build) -> Build {
    let vertices = build.0.geometry.positions.len() as u32;
    build.0.meshes = vec![SharedMesh {
        name: "half".to_owned(),
        triangles: 1..2,
        vertices: 0..vertices,
    }];
    build.0.instances = [0.0, 1.0]
        .map(|height| Instance {
            mesh: 0,
            node: 0,
            placement: Placement {
                linear: DMat3::IDENTITY,
                translation: height * DVec3::Z,
            },
            bounds: (DVec3::splat(-2.0), DVec3::splat(2.0)),
        })
        .to_vec();
    build
}

/// Without the feature, and with it.
pub fn pair(feature: Feature) -> [Case; 2] {
    let of = |build| case(build, |_| ());
    let made_of = |materials: [Material; 2]| materials.map(|material| of(squares(&[material])));
    let set = |changes: [fn(&mut RenderSettings); 2]| {
        changes.map(|change| case(squares(&[plain()]), change))
    };
    match feature {
        Feature::Orthographic => [pinhole(Vec3::Z, Vec3::ZERO, 0.5), orthographic()]
            .map(|camera| case(squares(&[plain()]), |settings| settings.camera = camera)),
        Feature::Culling => made_of([plain(), matte([1.0; 3])]),
        Feature::Mask => made_of([mask(0.6), mask(0.4)]),
        Feature::Blend => made_of([blend(1.0), blend(0.4)]),
        Feature::Unlit => [false, true].map(|unlit| of(squares(&[Material { unlit, ..plain() }]))),
        Feature::Textures => [None, image()].map(|base_color_texture| {
            of(squares(&[Material {
                base_color_texture,
                ..plain()
            }]))
        }),
        Feature::NormalMaps => [0.0, 1.0].map(|normal_scale| {
            of(squares(&[Material {
                base_color_texture: image(),
                normal_texture: image(),
                normal_scale,
                ..plain()
            }]))
        }),
        Feature::VertexColors => [colored(Vec4::ONE), colored(Vec4::X)].map(of),
        Feature::Branches => made_of([plain(), mirror()]),
        Feature::Reflection => made_of([blend(0.4), mirror()]),
        Feature::Transmission => made_of([pane(0.0), pane(0.5)]),
        Feature::Solids => made_of([pane(0.5), glass(1.0, 0)]),
        Feature::Absorption => made_of([glass(1.0, 0), glass(0.5, 0)]),
        Feature::Priorities => {
            [0, 1].map(|priority| of(squares(&[glass(1.0, 0), glass(1.0, priority)])))
        }
        Feature::Contact => [stacked(0.5), stacked(0.0)].map(of),
        Feature::StraightOn => {
            [&[][..], &[1.0]].map(|lights| of(lit(squares(&[blend(0.4)]), lights)))
        }
        Feature::TransparentShadows => {
            [1.0, 0.4].map(|alpha| of(lit(squares(&[blend(alpha)]), &[1.0])))
        }
        Feature::Lights => [0.0, 1.0].map(|intensity| of(lit(squares(&[plain()]), &[intensity]))),
        Feature::ManyLights => {
            [&[1.0][..], &[1.0, 1.0]].map(|lights| of(lit(squares(&[plain()]), lights)))
        }
        Feature::Environment => [0.0, 1.0].map(|radiance| of(surrounded(radiance))),
        // Without mirrors `pbr` spawns no rays: alike but for the model is what reflects.
        Feature::Whitted => [Shading::Pbr, Shading::Whitted]
            .map(|shading| case(squares(&[mirror()]), |settings| settings.shading = shading)),
        Feature::Instances => {
            let placed = || placed(squares(&[plain()]));
            let copied = Build(placed().0.copied().into_owned());
            [copied, placed()].map(of)
        }
        Feature::LongRays => [1, 300].map(|count| of(squares(&vec![plain(); count]))),
        Feature::Tolerance => set([
            |_| (),
            |settings| settings.tolerance = Some(Tolerance::absolute(0.01)),
        ]),
        Feature::Counters => set([|_| (), |settings| settings.counters = true]),
        Feature::Watertight => set([|settings| settings.numerics.watertight = false, |_| ()]),
        Feature::PaddedBoxes => set([|settings| settings.numerics.padded_boxes = false, |_| ()]),
        Feature::ErrorBounds => set([
            |settings| settings.numerics = Numerics::book(1e-4),
            |settings| {
                settings.numerics = Numerics {
                    error_bounds: true,
                    ..Numerics::book(1e-4)
                }
            },
        ]),
    }
}

fn orthographic() -> Camera {
    parallel(Vec3::Z, Vec3::ZERO, 1.0)
}

/// What the book's own coefficients make a solid of, under its model alone.
pub fn book_glass() -> [Case; 2] {
    let material = Material {
        whitted: Some(WhittedCoefficients {
            kt: Some(Vec3::ONE),
            ..WhittedCoefficients::default()
        }),
        transmission: 0.0,
        ..glass(0.5, 0)
    };
    [Shading::Pbr, Shading::Whitted].map(|shading| {
        case(squares(std::slice::from_ref(&material)), |settings| {
            settings.shading = shading;
        })
    })
}
