//! Scenes whose answer is known on paper, rendered by the device, a pixel at a time.
//!
//! All cameras have parallel rays, so that a pixel is one known ray, and all scenes of a shading model share one program: one with
//! everything in it, which leaves to other tests whether leaving out is right.

mod support;

use std::{f64::consts::PI, fs, path::Path};

use glam::{DVec3, Vec3, Vec4};
use raytree::{
    Background, Environment, Feature, Film, Preset, ProgramFeatures, RenderSettings, Scene,
    Shading,
    model::{AlphaMode, LightKind, Material, Volume, WhittedCoefficients},
};
use raytree_scene::environment::EquirectMap;
use raytree_stress::scenes::{Build, matte, parallel, unfiltered};

/// Largest relative error. f32 has 6e-8 a rounding; a pixel takes some hundred.
const TOLERANCE: f64 = 2e-5;

/// A scene with the settings of its picture.
struct Shot {
    scene: Scene,
    settings: RenderSettings,
}

impl Shot {
    /// One pixel: the ray from `from` to `to`.
    fn ray(build: Build, from: Vec3, to: Vec3) -> Self {
        Self::view(build, from, to, 1e-6, 1)
    }

    /// A square view of `pixels` a side.
    fn view(build: Build, from: Vec3, to: Vec3, half: f64, pixels: u32) -> Self {
        let mut settings = RenderSettings::new(pixels, pixels, parallel(from, to, half));
        settings.min_weight = 0.0;
        Self {
            scene: build.0,
            settings,
        }
    }

    fn whitted(mut self) -> Self {
        self.settings.shading = Shading::Whitted;
        self
    }

    fn depth(mut self, max_depth: u32) -> Self {
        self.settings.max_depth = max_depth;
        self
    }

    /// `None` where there is no device.
    fn film(&self) -> Option<Film> {
        let device = support::device()?;
        let features = ProgramFeatures::everything()
            .with(Feature::VertexColors, false)
            .with(Feature::Tolerance, self.settings.tolerance.is_some())
            .with(
                Feature::Environment,
                self.scene.surroundings.environment.is_some(),
            )
            .with(Feature::Whitted, self.settings.shading == Shading::Whitted);
        let bvh = raytree::build_bvh(&self.scene, Preset::Balanced)
            .unwrap_or_else(|error| panic!("{error}"));
        let observer = &mut raytree::unobserved;
        let rendered = raytree_gpu::render_with(
            device,
            &self.scene,
            &bvh,
            &self.settings,
            features,
            observer,
        );
        Some(rendered.unwrap_or_else(|error| panic!("{error}")).film)
    }

    /// Every pixel is this.
    #[track_caller]
    fn shows(&self, expected: [f64; 3]) {
        self.shows_within(expected, TOLERANCE);
    }

    #[track_caller]
    fn shows_within(&self, expected: [f64; 3], tolerance: f64) {
        let Some(film) = self.film() else { return };
        for (index, found) in film.radiance.iter().enumerate() {
            assert!(
                near(*found, expected, tolerance),
                "pixel {index}: {found:?}, on paper {expected:?}"
            );
        }
    }
}

/// Each channel is within `tolerance` of its expected value, relative to it or to a hundredth.
fn near(found: [f32; 3], expected: [f64; 3], tolerance: f64) -> bool {
    found.iter().zip(expected).all(|(found, expected)| {
        (f64::from(*found) - expected).abs() <= tolerance * expected.abs().max(0.01)
    })
}

/// The comparison has to be able to fail.
#[test]
fn a_wrong_value_is_noticed() {
    assert!(near([0.5, 1.0, 0.0], [0.5, 1.0, 0.0], TOLERANCE));
    assert!(!near([0.5001, 1.0, 0.0], [0.5, 1.0, 0.0], TOLERANCE));
    assert!(!near([0.5, 1.0, 1e-6], [0.5, 1.0, 0.0], TOLERANCE));
    assert!(!near([0.5, f32::NAN, 0.0], [0.5, 1.0, 0.0], TOLERANCE));
    assert!(!near([0.5, f32::INFINITY, 0.0], [0.5, 1.0, 0.0], TOLERANCE));
}

const fn at(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

fn grey(value: f64) -> [f64; 3] {
    [value; 3]
}

/// Smooth and clear, of this index; `specular` 0 refracts without reflecting.
fn glass(ior: f32, specular: f32) -> Material {
    let volume = Volume {
        attenuation_color: Vec3::ONE,
        attenuation_distance: f64::INFINITY,
    };
    Material {
        ior,
        specular,
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        volume: Some(volume),
        ..Material::default()
    }
}

/// Shines, and reflects nothing.
fn lamp(radiance: [f32; 3]) -> Material {
    Material {
        emissive: radiance.into(),
        specular: 0.0,
        ..matte([0.0; 3])
    }
}

/// A matte floor at y = 0, seen from above at x.
fn floor_at(x: f32, albedo: [f32; 3], light: LightKind, intensity: f64) -> Shot {
    let mut build = Build::before([0.0; 3]);
    let floor = build.material(Material {
        specular: 0.0,
        ..matte(albedo)
    });
    build.square(Vec3::ZERO, Vec3::Y, 2.0, floor);
    build.light(light, intensity);
    Shot::ray(build, at(x, 1.5, 0.1), at(x, 0.0, 0.1))
}

// Lights

#[test]
fn a_point_light_falls_off_by_cosine_and_square() {
    let albedo = [0.8, 0.5, 0.1];
    for (x, height) in [
        (0.0, 1.0),
        (0.0, 0.25),
        (0.5, 0.5),
        (1.5, 0.5),
        (-1.0, 0.01),
    ] {
        let position = DVec3::new(0.0, height, 0.1_f32.into());
        let light = LightKind::Point {
            position,
            range: f64::INFINITY,
        };
        let square = f64::from(x).powi(2) + height * height;
        let irradiance = 3.0 * height / square.sqrt() / square;
        floor_at(x, albedo, light, 3.0)
            .shows(albedo.map(|albedo| f64::from(albedo) / PI * irradiance));
    }
}

#[test]
fn a_range_ends_a_light_smoothly() {
    for (range, window) in [
        (2.0, 1.0 - 0.0625),
        (1.25, 1.0 - 0.8_f64.powi(4)),
        (1.0, 0.0),
        (0.5, 0.0),
    ] {
        let position = DVec3::new(0.0, 1.0, 0.1_f32.into());
        floor_at(0.0, [1.0; 3], LightKind::Point { position, range }, 1.0).shows(grey(window / PI));
    }
}

#[test]
fn a_directional_light_has_no_distance() {
    for degrees in [0.0_f64, 30.0, 80.0, 89.9, 100.0, 180.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let light = LightKind::Directional {
            direction: DVec3::new(sin, -cos, 0.0),
        };
        floor_at(0.3, [0.5; 3], light, 2.0).shows(grey(cos.max(0.0) / PI));
    }
}

#[test]
fn a_spot_fades_between_its_angles() {
    let (inner, outer) = (0.2_f64, 0.5_f64);
    for x in [0.0, 0.1, 0.3, 0.4, 0.6] {
        let position = DVec3::new(0.0, 1.0, 0.1_f32.into());
        let light = LightKind::Spot {
            position,
            direction: DVec3::NEG_Y,
            range: f64::INFINITY,
            inner_cone_angle: inner,
            outer_cone_angle: outer,
        };
        let cos = 1.0 / (1.0 + f64::from(x).powi(2)).sqrt();
        let share = ((cos - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        floor_at(x, [1.0; 3], light, 1.0).shows(grey(share * share * cos.powi(3) / PI));
    }
}

#[test]
fn lights_add_up() {
    let light = |x: f64| LightKind::Directional {
        direction: DVec3::new(x, -1.0, 0.0).normalize(),
    };
    let mut shot = floor_at(0.3, [1.0; 3], light(0.0), 1.0);
    for (slope, intensity) in [(1.0, 2.0_f64), (-1.0, 3.0)] {
        let kind = light(slope);
        shot.scene.lights.push(raytree::model::Light {
            name: String::new(),
            kind,
            intensity: DVec3::splat(intensity),
        });
    }
    shot.shows(grey((1.0 + 5.0 / 2.0_f64.sqrt()) / PI));
}

/// What is between a light and the floor colours its light: by coverage, by transmission, by kt.
#[test]
fn shadows_are_coloured() {
    let direction = DVec3::NEG_Y;
    let behind = |card: Material| {
        let mut shot = floor_at(0.0, [1.0; 3], LightKind::Directional { direction }, PI);
        let mut build = Build(std::mem::take(&mut shot.scene));
        let card = build.material(card);
        // The camera looks slantwise, past the card.
        build.square(at(0.0, 0.5, 0.0), Vec3::Y, 0.2, card);
        Shot::ray(build, at(1.0, 0.5, 0.0), Vec3::ZERO)
    };
    let base = [0.75, 0.5, 0.25];
    let specular = 0.0;
    let pane = Material {
        transmission: 0.5,
        specular,
        ..matte(base)
    };
    behind(pane.clone()).shows([0.375, 0.25, 0.125]);
    let veil = Material {
        base_color: Vec4::new(1.0, 1.0, 1.0, 0.25),
        alpha_mode: AlphaMode::Blend,
        ..matte([1.0; 3])
    };
    behind(veil.clone()).shows(grey(0.75));
    let both = Material {
        base_color: Vec4::new(0.75, 0.5, 0.25, 0.5),
        alpha_mode: AlphaMode::Blend,
        ..pane.clone()
    };
    behind(both).shows([0.6875, 0.625, 0.5625]);
    behind(Material {
        metallic: 0.5,
        ..pane.clone()
    })
    .shows([0.1875, 0.125, 0.0625]);
    behind(Material {
        unlit: true,
        ..veil
    })
    .shows(grey(0.75));
    behind(Material {
        unlit: true,
        ..pane
    })
    .shows(grey(0.0));
    behind(matte(base)).shows(grey(0.0));
    let kt = Some(Vec3::new(0.5, 0.25, 1.0));
    let whitted = Some(WhittedCoefficients {
        kt,
        ior: Some(1.0),
        ..Default::default()
    });
    // The book has no 1/pi. A solid's absorption counts too, here there is none.
    behind(Material {
        whitted,
        ..matte(base)
    })
    .whitted()
    .shows([0.5 * PI, 0.25 * PI, PI]);
}

// All around

const SKY: [f32; 3] = [0.5, 1.0, 2.0];

fn sky(share: f64) -> [f64; 3] {
    SKY.map(|radiance| share * f64::from(radiance))
}

/// White and diffuse in a white furnace: can't be seen, from normal to grazing incidence.
#[test]
fn a_white_ball_vanishes_in_a_furnace() {
    let mut build = Build::inside(SKY);
    let map = EquirectMap {
        width: 32,
        height: 16,
        texels: vec![SKY; 512],
    };
    build.0.surroundings.environment = Some(Environment::new(map, 0.0));
    let white = build.material(matte([1.0; 3]));
    build.ball(Vec3::ZERO, 1.0, 4, white);
    Shot::view(build, at(0.5, 1.0, 2.0), Vec3::ZERO, 1.1, 24).shows(sky(1.0));
}

/// Reflection and refraction share the light: a ball of glass in a furnace is as bright as the furnace.
#[test]
fn a_ball_of_glass_loses_nothing() {
    let ball = |build: &mut Build| {
        let clear = build.material(glass(1.5, 1.0));
        build.ball(Vec3::ZERO, 1.0, 5, clear);
    };
    let mut build = Build::inside(SKY);
    ball(&mut build);
    let shot = Shot::view(build, at(0.5, 1.0, 2.0), Vec3::ZERO, 0.6, 16);
    // What is lost is what the depth cuts off: F^k of the refracted rays' (1 - F), where F is at most 0.09 this far from the rim.
    shot.depth(12).shows(sky(1.0));
    let mut build = Build::inside(SKY);
    ball(&mut build);
    Shot::view(build, at(0.5, 1.0, 2.0), Vec3::ZERO, 0.6, 16)
        .depth(3)
        .shows_within(sky(1.0), 0.01);
}

/// Fresnel's equations for a dielectric, in vacuum.
fn fresnel(ior: f64, cos_i: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (ior * ior)).sqrt();
    let rs = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    let rp = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    0.5 * (rs * rs + rp * rp)
}

#[test]
fn a_smooth_dielectric_reflects_by_fresnel() {
    let polished = |ior| Material {
        roughness: 0.0,
        ior,
        ..matte([0.0; 3])
    };
    let seen = |material: Material, degrees: f64| {
        let mut build = Build::inside(SKY);
        let material = build.material(material);
        build.square(Vec3::ZERO, Vec3::Y, 1.0, material);
        let (sin, cos) = degrees.to_radians().sin_cos();
        Shot::ray(build, DVec3::new(sin, cos, 0.0).as_vec3(), Vec3::ZERO)
    };
    seen(polished(1.5), 0.0).shows(sky(0.04));
    for degrees in [30.0_f64, 56.31, 75.0, 87.0] {
        for ior in [1.33_f32, 1.5, 2.4] {
            let expected = fresnel(ior.into(), degrees.to_radians().cos());
            seen(polished(ior), degrees).shows_within(sky(expected), 1e-4);
        }
    }
    seen(polished(f32::INFINITY), 40.0).shows(sky(1.0));
    seen(polished(1.0), 40.0).shows(sky(0.0));
    // KHR_materials_specular scales it, and colours it at normal incidence only.
    seen(
        Material {
            specular: 0.5,
            ..polished(1.5)
        },
        0.0,
    )
    .shows(sky(0.02));
    let red = Material {
        specular_color: Vec3::X,
        ..polished(1.5)
    };
    seen(red, 0.0).shows([0.04 * 0.5, 0.0, 0.0]);
}

/// Another colour in every direction.
fn sloping_sky() -> Build {
    let mut build = Build::inside(SKY);
    let map = EquirectMap::from_directions(64, 32, |direction| 0.5 * (direction + 1.0));
    build.0.surroundings.environment = Some(unfiltered(map));
    build
}

/// The pictures are the same, and show something.
#[track_caller]
fn changes_nothing(with: &Shot, without: &Shot) {
    let (Some(with), Some(without)) = (with.film(), without.film()) else {
        return;
    };
    for (index, (with, without)) in with.radiance.iter().zip(&without.radiance).enumerate() {
        assert!(
            *without != [0.0; 3] && near(*with, without.map(f64::from), TOLERANCE),
            "pixel {index}: {with:?}, not {without:?}"
        );
    }
}

#[test]
fn a_parallel_slab_leaves_directions_as_they_are() {
    let mut with_slab = sloping_sky();
    let clear = with_slab.material(glass(1.5, 0.0));
    with_slab.cuboid(at(-1.0, -0.2, -1.0), at(1.0, 0.0, 1.0), clear);
    for from in [at(0.0, 1.0, 0.0), at(0.6, 1.0, 0.3), at(-2.0, 1.0, 1.0)] {
        let [with, without] =
            [with_slab.clone(), sloping_sky()].map(|build| Shot::ray(build, from, Vec3::ZERO));
        changes_nothing(&with, &without);
    }
}

/// .. but shifts what is behind it, by Snell's law.
#[test]
fn a_parallel_slab_shifts_what_is_behind_it() {
    let (ior, thickness, degrees) = (1.5, 0.4, 50.0_f64);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let tan_inside = (sin / ior) / (1.0 - (sin / ior).powi(2)).sqrt();
    let depth = 0.9;
    let with_slab = thickness * tan_inside + (depth - thickness) * sin / cos;
    let without = depth * sin / cos;
    for (slab, lamp_at, seen) in [
        (true, with_slab, 1.0),
        (true, without, 0.0),
        (false, without, 1.0),
        (false, with_slab, 0.0),
    ] {
        let mut build = Build::before([0.0; 3]);
        let (clear, lamp) = (
            build.material(glass(ior as f32, 0.0)),
            build.material(lamp([1.0; 3])),
        );
        if slab {
            build.cuboid(
                at(-2.0, -(thickness as f32), -1.0),
                at(2.0, 0.0, 1.0),
                clear,
            );
        }
        build.square(
            at(lamp_at as f32, -(depth as f32), 0.0),
            Vec3::Y,
            1e-4,
            lamp,
        );
        Shot::ray(build, DVec3::new(-sin, cos, 0.0).as_vec3(), Vec3::ZERO).shows(grey(seen));
    }
}

#[test]
fn a_slab_absorbs_by_the_length_of_the_way() {
    let color = [0.9_f32, 0.5, 0.1];
    for (thickness, degrees) in [(0.1, 0.0_f64), (0.5, 0.0), (0.5, 60.0)] {
        let volume = Some(Volume {
            attenuation_color: color.into(),
            attenuation_distance: 0.25,
        });
        let mut build = Build::inside(SKY);
        let tinted = build.material(Material {
            volume,
            ..glass(1.5, 0.0)
        });
        build.cuboid(
            at(-2.0, -(thickness as f32), -2.0),
            at(2.0, 0.0, 2.0),
            tinted,
        );
        let (sin, cos) = degrees.to_radians().sin_cos();
        let way = thickness / (1.0 - (sin / 1.5_f64).powi(2)).sqrt();
        let expected = [0, 1, 2].map(|k| f64::from(SKY[k]) * f64::from(color[k]).powf(way / 0.25));
        Shot::ray(build, DVec3::new(sin, cos, 0.0).as_vec3(), Vec3::ZERO).shows(expected);
    }
}

#[test]
fn a_solid_of_index_one_is_invisible() {
    let mut build = sloping_sky();
    let nothing = build.material(glass(1.0, 1.0));
    build.ball(Vec3::ZERO, 1.0, 3, nothing);
    let patterned = |mut build: Build| {
        let red = build.material(lamp([1.0, 0.0, 0.0]));
        build.square(at(0.1, -0.3, -1.5), at(0.0, 0.2, 1.0), 0.5, red);
        Shot::view(build, at(0.0, 0.0, 2.0), Vec3::ZERO, 1.2, 16)
    };
    changes_nothing(&patterned(build), &patterned(sloping_sky()));
}

/// Right-angled, seen through one leg: at 45 degrees on the long side, where the critical angle of 1.5 is 41.8 and that of 1.3 is
/// 50.3. One lamp lies where total reflection leads, another where refraction does.
#[test]
fn a_prism_reflects_all_beyond_the_critical_angle() {
    for (ior, expected) in [(1.5, [1.0, 0.0, 0.0]), (1.3, [0.0, 1.0, 0.0])] {
        let mut build = Build::before([0.0; 3]);
        let clear = build.material(glass(ior, 0.0));
        let corner = |x: f32, y: f32| [at(x, y, 0.5), at(x, y, -0.5)];
        let [a, b, c] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
        for [p, q] in [[a, b], [b, c], [c, a]] {
            build.quad([p[0], p[1], q[1], q[0]], clear);
        }
        for (k, [p, q, r]) in [[a, b, c], [a, c, b]].into_iter().enumerate() {
            let normal = if k == 0 { Vec3::Z } else { Vec3::NEG_Z };
            let vertices = [p, q, r].map(|corner| build.vertex(corner[k], normal));
            build.triangle(vertices, clear);
        }
        let (red, green) = (
            build.material(lamp([1.0, 0.0, 0.0])),
            build.material(lamp([0.0, 1.0, 0.0])),
        );
        // In through the leg at x = 0, reflected at (0.5, 0.5) down through the leg at y = 0.
        build.square(at(0.5, -0.5, 0.0), Vec3::Y, 0.3, red);
        build.square(at(2.0, 1.0, 0.0), Vec3::NEG_X, 2.0, green);
        Shot::ray(build, at(-1.0, 0.5, 0.0), at(0.0, 0.5, 0.0)).shows(expected);
    }
}

// Depth

/// Two mirrors that face each other, each shining a little: a geometric series, cut off by depth or weight.
#[test]
fn facing_mirrors_are_a_geometric_series() {
    let reflectance = 0.75_f32;
    let between = |max_depth: u32| {
        let mut build = Build::before([9.0; 3]);
        let base_color = Vec4::new(reflectance, reflectance, reflectance, 1.0);
        let mirror = Material {
            base_color,
            metallic: 1.0,
            roughness: 0.0,
            emissive: Vec3::splat(0.5),
            ..Material::default()
        };
        let mirror = build.material(mirror);
        build.square(Vec3::ZERO, Vec3::Z, 1.0, mirror);
        build.square(Vec3::Z, Vec3::NEG_Z, 1.0, mirror);
        Shot::ray(build, at(0.1, 0.2, 0.25), at(0.1, 0.2, 1.0)).depth(max_depth)
    };
    let sum = |terms: i32| {
        0.5 * (1.0 - f64::from(reflectance).powi(terms)) / (1.0 - f64::from(reflectance))
    };
    for depth in [0, 1, 2, 5, 8, 30] {
        between(depth).shows(grey(sum(depth as i32 + 1)));
    }
    // 0.75^8 is 0.1001, 0.75^9 is 0.0751.
    let mut shot = between(30);
    shot.settings.min_weight = 0.1;
    shot.shows(grey(sum(9)));
}

#[test]
fn alpha_lets_its_share_through_each_time() {
    for cards in [1, 3, 6] {
        let stack = |background| {
            let mut build = Build::before(SKY);
            build.0.surroundings.background = background;
            let base_color = Vec4::new(0.5, 0.5, 0.5, 0.25);
            let veil = Material {
                base_color,
                alpha_mode: AlphaMode::Blend,
                unlit: true,
                ..Material::default()
            };
            let veil = build.material(veil);
            for k in 0..cards {
                build.square(at(0.0, 0.0, -0.1 * k as f32), Vec3::Z, 1.0, veil);
            }
            Shot::ray(build, at(0.1, 0.2, 1.0), at(0.1, 0.2, 0.0))
        };
        let through = 0.75_f64.powi(cards);
        let shown = |sky: f64| through * sky + (1.0 - through) * 0.5;
        stack(Background::Color(SKY.into())).shows(SKY.map(|sky| shown(sky.into())));
        let composited = stack(Background::Transparent);
        composited.shows(grey(shown(0.0)));
        if let Some(film) = composited.film() {
            assert!((f64::from(film.alpha[0]) - (1.0 - through)).abs() < 1e-6);
        }
    }
}

// The rest

#[test]
fn unlit_is_what_it_is() {
    let light = LightKind::Directional {
        direction: DVec3::NEG_Y,
    };
    let mut shot = floor_at(0.0, [1.0; 3], light, 5.0);
    let base_color = Vec4::new(0.75, 0.5, 0.25, 0.1);
    shot.scene.materials[0] = Material {
        base_color,
        unlit: true,
        emissive: Vec3::ONE,
        ..Material::default()
    };
    shot.shows([0.75, 0.5, 0.25]);
    let shot = shot.whitted();
    shot.shows([0.75, 0.5, 0.25]);
}

/// Eq. 14.32 with every term, all numbers the author's own.
#[test]
fn the_book_s_equation_term_by_term() {
    let (ka, kd, n) = (0.1, 0.6, 5.0);
    let (ks, kt) = (Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.05, 0.1, 0.2));
    let whitted = WhittedCoefficients {
        ka: Some(ka),
        kd: Some(kd),
        ks: Some(ks),
        n: Some(n),
        kt: Some(kt),
        ior: Some(1.0),
    };
    let base = [1.0, 0.5, 0.25];
    let background = [0.25, 0.5, 0.75];
    let mut build = Build::before(background);
    build.0.surroundings.ambient = Vec3::splat(0.5);
    let floor = build.material(Material {
        whitted: Some(whitted),
        emissive: Vec3::splat(0.125),
        ..matte(base)
    });
    build.square(Vec3::ZERO, Vec3::Y, 1.0, floor);
    let (sin, cos) = 40.0_f64.to_radians().sin_cos();
    build.light(
        LightKind::Directional {
            direction: DVec3::new(sin, -cos, 0.0),
        },
        2.0,
    );
    // Seen from straight above, the half vector is at half the light's angle.
    let highlight = 20.0_f64.to_radians().cos().powf(n.into());
    let expected = [0, 1, 2].map(|k| {
        let (od, sky) = (f64::from(base[k]), f64::from(background[k]));
        let ambient = f64::from(ka) * od * 0.5;
        let lit = 2.0 * (f64::from(kd) * od * cos + f64::from(ks[k]) * highlight);
        0.125 + ambient + lit + f64::from(ks[k]) * sky + f64::from(kt[k]) * sky
    });
    Shot::ray(build, Vec3::Y, Vec3::ZERO)
        .whitted()
        .shows(expected);
}

/// What the book's model derives from glTF's factors.
#[test]
fn the_book_s_equation_from_gltf() {
    let alpha = 0.8_f64.powi(2);
    let n = 2.0 / (alpha * alpha) - 2.0;
    let mut build = Build::before([0.0; 3]);
    let base_color = Vec4::new(1.0, 0.5, 0.25, 1.0);
    let floor = Material {
        base_color,
        metallic: 0.25,
        roughness: 0.8,
        ior: 1.5,
        ..Material::default()
    };
    let floor = build.material(floor);
    build.square(Vec3::ZERO, Vec3::Y, 1.0, floor);
    let (sin, cos) = 60.0_f64.to_radians().sin_cos();
    build.light(
        LightKind::Directional {
            direction: DVec3::new(sin, -cos, 0.0),
        },
        1.0,
    );
    let highlight = 30.0_f64.to_radians().cos().powf(n);
    let expected =
        [1.0, 0.5, 0.25].map(|od| 0.75 * od * cos + (0.75 * 0.04 + 0.25 * od) * highlight);
    Shot::ray(build, Vec3::Y, Vec3::ZERO)
        .whitted()
        .shows(expected);
}

#[test]
fn the_mean_of_a_constant_is_that_constant() {
    for samples in [1, 3, 4, 16, 61] {
        let mut shot = Shot::view(Build::inside(SKY), Vec3::Z, Vec3::ZERO, 1.0, 8);
        shot.settings.samples = samples;
        shot.shows_within(sky(1.0), 1e-6);
    }
}

/// Camera rays see the background, others the environment.
#[test]
fn backgrounds_are_for_the_camera() {
    for (background, seen, alpha) in [
        (Background::Environment, sky(1.0), 0.0),
        (
            Background::Color(Vec3::new(0.1, 0.2, 0.3)),
            [0.1, 0.2, 0.3],
            0.0,
        ),
        (Background::Transparent, grey(0.0), 0.0),
    ] {
        let mut build = Build::inside(SKY);
        build.0.surroundings.background = background;
        let mirror = build.material(Material {
            roughness: 0.0,
            ..Material::default()
        });
        build.square(Vec3::ZERO, Vec3::Y, 0.5, mirror);
        let beside = Shot::ray(build.clone(), at(0.9, 1.0, 0.0), at(0.9, 0.0, 0.0));
        beside.shows(seen.map(|channel| f64::from(channel as f32)));
        if let Some(film) = beside.film() {
            assert_eq!(film.alpha, [alpha]);
        }
        Shot::ray(build, Vec3::Y, Vec3::ZERO).shows(sky(1.0));
    }
}

/// Where two triangles of a flat surface meet, rays start at one and lie in the other: it is behind them too. (At y = 0 nothing is
/// rounded, so that distance is 0 and origins are not moved.)
#[test]
fn a_seam_is_no_obstacle() {
    for (sx, sz) in [(0.0, 0.0), (0.25, -0.25), (-0.5, 0.5)] {
        let mut build = Build::before([0.0; 3]);
        let floor = build.material(Material {
            specular: 0.0,
            ..matte([1.0; 3])
        });
        build.square(Vec3::ZERO, Vec3::Y, 1.0, floor);
        build.light(
            LightKind::Directional {
                direction: DVec3::new(0.6, -0.8, 0.0),
            },
            PI,
        );
        Shot::ray(build, at(sx, 1.0, sz), at(sx, 0.0, sz)).shows(grey(0.8));
    }
}

/// A glTF file: a box on a floor, under a lamp, all of it scaled and then moved. Its numbers are all exact in f32.
fn placed_scene(folder: &Path, scale: f64, place: [f64; 3]) -> Scene {
    let mut build = Build::default();
    build.square(Vec3::ZERO, Vec3::Y, 0.75, 0);
    build.cuboid(at(-0.25, 0.0, -0.5), at(0.125, 0.625, 0.25), 0);
    let geometry = &build.0.geometry;
    let positions: &[u8] = bytemuck::cast_slice(&geometry.positions);
    let indices: Vec<u32> = geometry
        .triangles
        .iter()
        .flat_map(|triangle| triangle.vertices)
        .collect();
    let name = format!("box-{scale}");
    fs::write(
        folder.join(format!("{name}.bin")),
        [positions, bytemuck::cast_slice(&indices)].concat(),
    )
    .expect("a writable folder");
    let (vertices, indices, middle) = (geometry.positions.len(), indices.len(), positions.len());
    let text = serde_json::json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 3.0 * scale * scale, "range": 4.0 * scale }] } },
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "children": [1, 2, 3], "scale": [scale, scale, scale], "translation": place },
            { "mesh": 0 },
            { "translation": [0.5, 1.5, 0.75], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "translation": [0.25, 0.5, 2.5], "camera": 0 },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.75, "znear": 0.125 } }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.5, "roughnessFactor": 0.25 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "buffers": [{ "uri": format!("{name}.bin"), "byteLength": middle + 4 * indices }],
        "bufferViews": [
            { "buffer": 0, "byteLength": middle },
            { "buffer": 0, "byteOffset": middle, "byteLength": 4 * indices },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3", "min": [-0.75, 0.0, -0.75], "max": [0.75, 0.625, 0.75] },
            { "bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR" },
        ],
    });
    let path = folder.join(format!("{name}.gltf"));
    fs::write(&path, text.to_string()).expect("a writable folder");
    support::import(&path)
}

/// Where a scene lies and how large it is changes no bit of its picture.
#[test]
fn a_scene_looks_the_same_wherever_and_however_large() {
    let Some(device) = support::device() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a writable folder for temporary files");
    let picture = |scene: &Scene, camera| {
        let settings = RenderSettings::new(64, 48, camera);
        support::render(device, scene, &settings).film.radiance
    };
    let placed = |scale, place| {
        let scene = placed_scene(folder.path(), scale, place);
        picture(&scene, support::camera(&scene))
    };
    let at_home = placed(1.0, [0.0; 3]);
    let lit = at_home.iter().filter(|colour| **colour != [0.0; 3]).count();
    assert!(lit > 300, "only {lit} pixels are lit");
    assert!(placed(1024.0, [0.0; 3]) == at_home);
    assert!(placed(1.0 / 1024.0, [0.0; 3]) == at_home);
    assert!(placed(64.0, [-300.0, 77.5, 4096.0]) == at_home);
    // Nor where the scale is no power of two.
    assert!(placed(1.5, [0.1; 3]) == at_home);
    // The comparison has to be able to fail.
    let scene = placed_scene(folder.path(), 1.0, [0.0; 3]);
    let mut camera = support::camera(&scene);
    camera.position.x += 1e-3;
    assert!(picture(&scene, camera) != at_home);
}
