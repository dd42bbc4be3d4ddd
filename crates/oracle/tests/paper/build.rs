//! Scenes made by hand, one ray at a time, and comparison.

use glam::{DVec3, Vec2, Vec3, Vec4};
use raytree_oracle::{Oracle, Settings, Shading};
use raytree_scene::environment::{Environment, EquirectMap};
use raytree_scene::model::{
    Background, Camera, Filter, Image, Light, LightKind, Material, Projection, Scene, Texture,
    TextureRef, Triangle, Volume, Wrap,
};

/// A scene under construction. Every vertex has a normal, a tangent, a white colour and a UV in set 0.
#[derive(Clone, Default)]
pub struct Build {
    pub scene: Scene,
}

impl Build {
    /// No geometry, no light, and what every ray sees that hits nothing.
    pub fn before(background: [f32; 3]) -> Self {
        let mut build = Self::default();
        build.scene.geometry.uv_sets.push(Vec::new());
        build.scene.surroundings.background = Background::Color(background.into());
        build
    }

    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// A rectangle (or any flat quadrangle), its corners counter-clockwise; UV runs from (0, 0) at the first over (1, 0)
    /// at the second to (1, 1) at the third.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], material: u32) {
        let [a, b, c, d] = corners.map(Vec3::from);
        let normal = (b - a).cross(d - a).normalize();
        let tangent = (b - a).normalize();
        let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let first = self.scene.geometry.positions.len() as u32;
        for (position, uv) in [a, b, c, d].into_iter().zip(uvs) {
            self.vertex(position, normal, tangent, uv.into());
        }
        self.triangle([first, first + 1, first + 2], material);
        self.triangle([first, first + 2, first + 3], material);
    }

    /// The square `|x| <= half, |z| <= half` at height `y`, its front up.
    pub fn floor(&mut self, y: f32, half: f32, material: u32) {
        let h = half;
        self.quad([[-h, y, h], [h, y, h], [h, y, -h], [-h, y, -h]], material);
    }

    /// The same, its front down.
    pub fn ceiling(&mut self, y: f32, half: f32, material: u32) {
        let h = half;
        self.quad([[-h, y, -h], [h, y, -h], [h, y, h], [-h, y, h]], material);
    }

    /// A box, its fronts out.
    pub fn cuboid(&mut self, min: [f32; 3], max: [f32; 3], material: u32) {
        let corner = |i: usize| -> [f32; 3] {
            std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] })
        };
        const SIDES: [[usize; 4]; 6] = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        for side in SIDES {
            self.quad(side.map(corner), material);
        }
    }

    /// A sphere of `slices` meridians and `stacks` parallels, with smooth normals and shared vertices.
    pub fn sphere(
        &mut self,
        centre: [f32; 3],
        radius: f32,
        slices: u32,
        stacks: u32,
        material: u32,
    ) {
        let first = self.scene.geometry.positions.len() as u32;
        for stack in 0..=stacks {
            let theta = std::f32::consts::PI * stack as f32 / stacks as f32;
            for slice in 0..slices {
                let phi = std::f32::consts::TAU * slice as f32 / slices as f32;
                let normal = Vec3::new(
                    theta.sin() * phi.cos(),
                    theta.cos(),
                    -theta.sin() * phi.sin(),
                );
                let tangent = Vec3::new(-phi.sin(), 0.0, -phi.cos());
                self.vertex(
                    Vec3::from(centre) + radius * normal,
                    normal,
                    tangent,
                    Vec2::ZERO,
                );
            }
        }
        let index = |stack: u32, slice: u32| first + stack * slices + slice % slices;
        for stack in 0..stacks {
            for slice in 0..slices {
                let [a, b] = [index(stack, slice), index(stack + 1, slice)];
                let [c, d] = [index(stack + 1, slice + 1), index(stack, slice + 1)];
                self.triangle([a, b, c], material);
                self.triangle([a, c, d], material);
            }
        }
    }

    pub fn light(&mut self, kind: LightKind, intensity: f64) {
        let intensity = DVec3::splat(intensity);
        self.scene.lights.push(Light {
            name: String::new(),
            kind,
            intensity,
        });
    }

    pub fn point_light(&mut self, position: [f64; 3], intensity: f64) {
        let range = f64::INFINITY;
        self.light(
            LightKind::Point {
                position: position.into(),
                range,
            },
            intensity,
        );
    }

    /// A texture of an image given row by row from the top; returns the use of it as it is.
    pub fn texture(
        &mut self,
        rows: &[&[[u8; 4]]],
        wrap: Wrap,
        filter: Filter,
        srgb: bool,
    ) -> TextureRef {
        self.scene.images.push(Image {
            name: String::new(),
            width: rows[0].len() as u32,
            height: rows.len() as u32,
            texels: rows.concat(),
        });
        let image = self.scene.images.len() as u32 - 1;
        self.scene.textures.push(Texture {
            image,
            wrap_u: wrap,
            wrap_v: wrap,
            filter,
            srgb,
        });
        let texture = self.scene.textures.len() as u32 - 1;
        TextureRef {
            texture,
            uv_set: 0,
            transform: TextureRef::IDENTITY,
        }
    }

    pub fn oracle(&self) -> Oracle<'_> {
        Oracle::new(&self.scene)
    }

    /// The radiance along one ray, nothing left out for its weight.
    pub fn radiance(&self, origin: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
        self.shaded(origin, direction, Shading::Pbr)
    }

    pub fn shaded(&self, origin: [f64; 3], direction: [f64; 3], shading: Shading) -> [f64; 3] {
        let settings = Settings {
            shading,
            ..one_ray()
        };
        self.oracle()
            .radiance(&looking(origin, direction), &settings, 0, 0)
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, tangent: Vec3, uv: Vec2) {
        let geometry = &mut self.scene.geometry;
        geometry.positions.push(position);
        geometry.normals.push(normal);
        geometry.tangents.push(tangent.extend(1.0));
        geometry.colors.push(Vec4::ONE);
        geometry.uv_sets[0].push(uv);
    }

    fn triangle(&mut self, vertices: [u32; 3], material: u32) {
        self.scene.geometry.triangles.push(Triangle {
            vertices,
            material,
            node: 0,
        });
    }
}

/// One ray through the middle of a picture of one pixel, followed far, whatever its weight.
pub fn one_ray() -> Settings {
    Settings {
        max_depth: 24,
        min_weight: 0.0,
        ..Settings::new(1, 1)
    }
}

/// A camera whose middle ray starts at `origin` in `direction`.
pub fn looking(origin: [f64; 3], direction: [f64; 3]) -> Camera {
    let forward = DVec3::from(direction).normalize();
    let right = forward.any_orthonormal_vector();
    Camera {
        name: String::new(),
        position: origin.into(),
        right,
        up: right.cross(forward),
        forward,
        projection: Projection::Orthographic {
            xmag: 1.0,
            ymag: 1.0,
        },
    }
}

/// Diffuse and nothing else: no Fresnel reflection at any angle.
pub fn matte(base: [f32; 3]) -> Material {
    Material {
        metallic: 0.0,
        specular: 0.0,
        base_color: rgba(base),
        ..Material::default()
    }
}

/// Its own colour whatever the light.
pub fn unlit(base: [f32; 3]) -> Material {
    Material {
        unlit: true,
        base_color: rgba(base),
        ..Material::default()
    }
}

/// A smooth metal.
pub fn mirror(base: [f32; 3]) -> Material {
    Material {
        roughness: 0.0,
        base_color: rgba(base),
        ..Material::default()
    }
}

/// A smooth thin wall of index 1.5.
pub fn pane(base: [f32; 3]) -> Material {
    Material {
        metallic: 0.0,
        transmission: 1.0,
        ..mirror(base)
    }
}

/// A smooth solid; `color` is what remains of white light after `distance`.
pub fn glass(ior: f32, color: [f32; 3], distance: f64) -> Material {
    let volume = Volume {
        attenuation_color: color.into(),
        attenuation_distance: distance,
    };
    Material {
        ior,
        volume: Some(volume),
        ..pane([1.0; 3])
    }
}

/// A solid that absorbs nothing.
pub fn clear(ior: f32) -> Material {
    glass(ior, [1.0; 3], f64::INFINITY)
}

/// Every level of the environment is `texel(column, row)` of `width` by `height`.
pub fn environment(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> Environment {
    let texels = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
    let texels = texels.map(|(i, j)| texel(i, j)).collect();
    let map = EquirectMap {
        width,
        height,
        texels,
    };
    Environment {
        radiance: map.clone(),
        rough: std::array::from_fn(|_| map.clone()),
        irradiance: map,
        rotation: 0.0,
    }
}

fn rgba(base: [f32; 3]) -> Vec4 {
    Vec3::from(base).extend(1.0)
}

pub const UP: [f64; 3] = [0.0, 1.0, 0.0];
pub const DOWN: [f64; 3] = [0.0, -1.0, 0.0];

/// A direction in the plane of x and y, down, by `angle` from the vertical towards +x.
pub fn down_by(angle: f64) -> [f64; 3] {
    [angle.sin(), -angle.cos(), 0.0]
}

#[track_caller]
pub fn assert_rgb(found: [f64; 3], expected: [f64; 3]) {
    assert_rgb_within(found, expected, 1e-9);
}

#[track_caller]
pub fn assert_rgb_within(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let near = (0..3).all(|k| (found[k] - expected[k]).abs() <= tolerance);
    assert!(near, "found {found:?}, expected {expected:?}");
}

#[track_caller]
pub fn assert_grey(found: [f64; 3], expected: f64) {
    assert_rgb(found, [expected; 3]);
}
