//! The scene as everything after the importer sees it: flat lists, all special cases of the file resolved.
//!
//! # Spaces
//!
//! - *World space*: metres, right-handed, Y up, as in the file.
//! - *Scene space*: `(world - frame.origin) * frame.scale`, computed in f64, the difference in double-double ([`Place`]), and
//!   rounded to f32 once. The scale makes the longest side of the scene's bounding box 1, so the renderer's arithmetic is the
//!   same wherever the scene lies and however large it is. The origin is the box's point nearest to the file's first camera, so
//!   that f32's roundings, which grow with the distance from the origin, look equally small from there wherever they are.
//!   **Everything in [`Scene`] is in scene space**: positions, cameras, light positions, ranges, intensities (inverse
//!   square), attenuation distances.
//!
//! Meshes that nodes share ([`Scene::meshes`]) have spaces of their own, from which each instance leads into scene space.
//!
//! Colours are linear, Rec. 709 primaries.

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::environment::Environment;
use crate::instances::{Instance, RepeatedMesh, SharedMesh};
use crate::place::Place;

/// A scene ready to render: world-space geometry, resolved materials, lights, cameras and surroundings.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// How scene space relates to world space.
    pub frame: Frame,
    /// All triangles of all meshes, each in its place; behind them those of the meshes that nodes share, in spaces of their own.
    pub geometry: Geometry,
    /// The meshes that nodes share.
    pub meshes: Vec<SharedMesh>,
    /// Where they are shown.
    pub instances: Vec<Instance>,
    /// Meshes that more than one node shows: whether these share them, and why not.
    pub repeated: Vec<RepeatedMesh>,
    /// The materials; never empty where there is a triangle (glTF's default material is added where a primitive names none).
    pub materials: Vec<Material>,
    /// What materials sample: an image with a sampler and an encoding.
    pub textures: Vec<Texture>,
    /// Decoded images, each once, however many textures use it.
    pub images: Vec<Image>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// The cameras of the file, in the order of the nodes that carry them.
    pub cameras: Vec<Camera>,
    /// Names of the nodes that carry triangles; [`Triangle::node`] points here. "node 7" where the file gives none.
    pub nodes: Vec<String>,
    /// What a ray sees and what a surface gathers where there is no geometry.
    pub surroundings: Surroundings,
    /// The files that the scene was read from besides its own: buffers and images that lie beside it. Whoever writes pictures
    /// must not overwrite them.
    pub files: Vec<std::path::PathBuf>,
    /// What the importer had to leave out or mend.
    pub warnings: Vec<Warning>,
}

/// Scene space from world space: `scene = (world - origin) * scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The point of the scene's bounding box that is nearest to the file's first camera: the camera itself where it is inside,
    /// the middle of the box where there is no camera; and where that camera's field is so narrow (below 1e-3 rad) that it sees
    /// but one spot, the point it looks at. World space, metres.
    pub origin: Place,
    /// Scene units a metre: 1 over the longest side of the scene's bounding box.
    pub scale: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            origin: Place::ORIGIN,
            scale: 1.0,
        }
    }
}

impl Frame {
    /// The frame in which `extent` metres are 1. An extent of 0, or beyond all measure, leaves metres.
    #[must_use]
    pub fn new(origin: Place, extent: f64) -> Self {
        let scale = extent.recip();
        let usable = scale.is_normal() && scale > 0.0;
        Self {
            origin,
            scale: if usable { scale } else { 1.0 },
        }
    }

    /// A point from world space into scene space.
    #[must_use]
    pub fn to_scene(&self, world: impl Into<Place>) -> DVec3 {
        self.to_scene_by([world.into().since(self.origin)])
    }

    /// The point at the sum of `steps`, metres from the frame's origin, in scene space.
    ///
    /// Its last ten bits, counted from the largest of the steps, are rounded away. They are noise, but noise decides ties: the
    /// middle between two f32 numbers is a frequent value (an average of two file's coordinates ends there), and would become
    /// the one or the other by how large the scene is, and the picture with it.
    #[must_use]
    pub fn to_scene_by<const N: usize>(&self, steps: [DVec3; N]) -> DVec3 {
        let (sum, reach) = steps
            .into_iter()
            .fold((DVec3::ZERO, DVec3::ZERO), |(sum, reach), step| {
                (sum + step, reach.max(step.abs()))
            });
        // Adding and taking away a large number leaves multiples of its last place.
        let grid = (reach * self.scale).map(|reach| 1536.0 * power_of_two_below(reach));
        (sum * self.scale + grid) - grid
    }

    /// A point from scene space into world space, metres.
    #[must_use]
    pub fn to_world(&self, scene: DVec3) -> DVec3 {
        self.origin.moved(scene / self.scale).rounded()
    }
}

/// The largest power of two that is at most `x`; `x` positive and finite. 0 for 0 and subnormal numbers.
fn power_of_two_below(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    f64::from_bits(x.to_bits() & !MANTISSA)
}

/// Triangles and the attributes of their vertices. Attribute lists are as long as `positions`, or empty where no material
/// of the scene reads them.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Scene space, but for vertices of shared meshes ([`SharedMesh`]).
    pub positions: Vec<Vec3>,
    /// Shading normals, unit length. Where the file gives none, the triangle's own (its vertices are then not shared).
    pub normals: Vec<Vec3>,
    /// xyz: unit tangent, w: +1 or -1, with bitangent = w * cross(normal, tangent). Empty if no material has a normal map.
    pub tangents: Vec<Vec4>,
    /// UV sets, each as long as `positions`; only the sets that some texture reads, renumbered ([`TextureRef::uv_set`]).
    pub uv_sets: Vec<Vec<Vec2>>,
    /// Linear RGBA vertex colours. Empty if no mesh has any; (1, 1, 1, 1) for vertices without.
    pub colors: Vec<Vec4>,
    /// Counter-clockwise seen from the front, also where a node's transform mirrors.
    pub triangles: Vec<Triangle>,
}

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the vertex attributes, counter-clockwise seen from the front.
    pub vertices: [u32; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::nodes`].
    pub node: u32,
}

/// A material with every factor resolved (glTF 2.0 section 3.9 and the KHR_materials extensions that we support).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The file's name for it, or "material 3".
    pub name: String,
    /// Linear RGBA factor.
    pub base_color: Vec4,
    /// sRGB-encoded RGBA, multiplied in.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; alpha of the microfacet model is its square.
    pub roughness: f32,
    /// Linear; G multiplies roughness, B metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Linear, tangent space, `xyz * 2 - 1`.
    pub normal_texture: Option<TextureRef>,
    /// Scales x and y of the normal map.
    pub normal_scale: f32,
    /// Linear; R is how much of the ambient light arrives.
    pub occlusion_texture: Option<TextureRef>,
    /// 0 (no occlusion) to 1 (all of it).
    pub occlusion_strength: f32,
    /// Emitted radiance, factor times KHR_materials_emissive_strength.
    pub emissive: Vec3,
    /// sRGB-encoded RGB, multiplied in.
    pub emissive_texture: Option<TextureRef>,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// Back faces are seen. Where false they are culled for radiance rays (not for shadow rays, nor where the material
    /// transmits light).
    pub double_sided: bool,
    /// KHR_materials_unlit: shows its base colour, takes part in no lighting.
    pub unlit: bool,
    /// KHR_materials_transmission factor, 0 to 1.
    pub transmission: f32,
    /// Linear; R multiplies transmission.
    pub transmission_texture: Option<TextureRef>,
    /// Index of refraction against vacuum, at least 1. [`f32::INFINITY`] for the file's 0, which means: reflects all.
    pub ior: f32,
    /// KHR_materials_specular factor, 0 to 1.
    pub specular: f32,
    /// Linear; A multiplies specular.
    pub specular_texture: Option<TextureRef>,
    /// Linear, may exceed 1.
    pub specular_color: Vec3,
    /// sRGB-encoded RGB, multiplied in.
    pub specular_color_texture: Option<TextureRef>,
    /// KHR_materials_volume with a thickness above zero: the surface bounds a solid. `None`: a thin wall, light goes
    /// straight through.
    pub volume: Option<Volume>,
    /// `extras.priority`: where solids overlap, the medium of the highest priority is there (Schmidt and Budge 2002). 0 without.
    pub priority: i32,
    /// The book's own coefficients (`extras.whitted`), used by the `whitted` model in place of those derived from the
    /// factors above.
    pub whitted: Option<WhittedCoefficients>,
}

/// What fills a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// What remains of white light after `attenuation_distance`.
    pub attenuation_color: Vec3,
    /// Scene space; infinite for a clear medium.
    pub attenuation_distance: f64,
}

/// Coefficients of eq. 14.32 (Foley et al.), from `extras.whitted`. Those the author leaves out keep the derived value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WhittedCoefficients {
    /// Ambient reflection.
    pub ka: Option<f32>,
    /// Diffuse reflection.
    pub kd: Option<f32>,
    /// Specular reflection, of lights and of the reflected ray.
    pub ks: Option<Vec3>,
    /// Exponent of the highlight, at least 0.
    pub n: Option<f32>,
    /// Transmission of the refracted ray. Above zero it makes the surface bound a solid of index `ior`.
    pub kt: Option<Vec3>,
    /// Index of refraction, at least 1.
    pub ior: Option<f32>,
}

/// glTF 3.9.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Alpha below the cutoff: not there. Otherwise opaque.
    Mask {
        /// 0 and above.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

impl Default for Material {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: "default".to_owned(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            transmission: 0.0,
            transmission_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            volume: None,
            priority: 0,
            whitted: None,
        }
    }
}

impl Material {
    /// Which of [`Self::texture_slots`] is the normal map's.
    pub(crate) const NORMAL_SLOT: usize = 2;

    /// Every texture that the material reads.
    pub fn texture_refs(&self) -> impl Iterator<Item = &TextureRef> {
        self.texture_slots().into_iter().flatten()
    }

    /// The textures by what they are for: base colour, metallic-roughness, normal, occlusion, emission, transmission, specular,
    /// specular colour.
    #[must_use]
    pub fn texture_slots(&self) -> [Option<&TextureRef>; 8] {
        [
            self.base_color_texture.as_ref(),
            self.metallic_roughness_texture.as_ref(),
            self.normal_texture.as_ref(),
            self.occlusion_texture.as_ref(),
            self.emissive_texture.as_ref(),
            self.transmission_texture.as_ref(),
            self.specular_texture.as_ref(),
            self.specular_color_texture.as_ref(),
        ]
    }

    /// As [`Self::texture_slots`].
    pub(crate) fn texture_slots_mut(&mut self) -> [&mut Option<TextureRef>; 8] {
        [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.occlusion_texture,
            &mut self.emissive_texture,
            &mut self.transmission_texture,
            &mut self.specular_texture,
            &mut self.specular_color_texture,
        ]
    }
}

/// A material's use of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Index into [`Geometry::uv_sets`].
    pub uv_set: u32,
    /// KHR_texture_transform as an affine map: `u' = m[0] u + m[1] v + m[2]`, `v' = m[3] u + m[4] v + m[5]`.
    pub transform: [f32; 6],
}

impl TextureRef {
    /// The transform that changes nothing.
    pub const IDENTITY: [f32; 6] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
}

/// An image with the way to read it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: u32,
    /// Beyond [0, 1] in u.
    pub wrap_u: Wrap,
    /// Beyond [0, 1] in v.
    pub wrap_v: Wrap,
    /// Between texel centres (glTF's magFilter; there are no mip maps).
    pub filter: Filter,
    /// The colour channels are sRGB-encoded and decoded before filtering; alpha never is.
    pub srgb: bool,
}

/// glTF sampler wrapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wrap {
    /// Again and again.
    #[default]
    Repeat,
    /// Again and again, every other time mirrored.
    MirroredRepeat,
    /// The edge texel goes on.
    ClampToEdge,
}

/// glTF sampler filtering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Filter {
    /// The texel that the point lies in.
    Nearest,
    /// Bilinear between the four nearest texel centres.
    #[default]
    Linear,
}

/// A decoded image: 8 bits a channel, RGBA, row by row from the top. glTF's (0, 0) is the upper left corner.
#[derive(Clone, PartialEq, Eq)]
pub struct Image {
    /// The file's name for it, its URI, or "image 2".
    pub name: String,
    /// Texels, at least 1.
    pub width: u32,
    /// Texels, at least 1.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<[u8; 4]>,
}

/// A code of 8 bits to linear (IEC 61966-2-1), rounded to f32 once: the table that the renderer uploads.
#[must_use]
pub fn srgb_to_linear(code: u8) -> f32 {
    let c = f64::from(code) / 255.0;
    let linear = if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({:?}, {}x{})", self.name, self.width, self.height)
    }
}

/// A KHR_lights_punctual light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The file's name for it, or "light 0".
    pub name: String,
    /// What kind, and where.
    pub kind: LightKind,
    /// Colour times intensity. Directional: irradiance (W/m^2, glTF's lux). Point and spot: W/sr (glTF's candela) times
    /// `frame.scale` squared, so that intensity over squared distance, both in scene space, is the irradiance.
    pub intensity: DVec3,
}

impl Light {
    /// It is not dark.
    #[must_use]
    pub fn shines(&self) -> bool {
        self.intensity.max_element() > 0.0
    }
}

/// The kinds of KHR_lights_punctual. Scene space throughout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Infinitely far away.
    Directional {
        /// Unit vector in which the light travels.
        direction: DVec3,
    },
    /// Shines alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
        /// Beyond it there is no light; infinite if the file gives none.
        range: f64,
    },
    /// Shines into a cone.
    Spot {
        /// Where it is.
        position: DVec3,
        /// Unit vector of the cone's axis, away from the light.
        direction: DVec3,
        /// Beyond it there is no light; infinite if the file gives none.
        range: f64,
        /// Full intensity up to here; radians from the axis, 0 <= inner < outer.
        inner_cone_angle: f64,
        /// None from here on; radians from the axis, at most pi/2.
        outer_cone_angle: f64,
    },
}

/// A camera, scene space. It looks along `forward`; the three axes are orthonormal and right-handed
/// (`right x up = -forward`).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The node's name, else the camera's, else "camera 0".
    pub name: String,
    /// Where it is.
    pub position: DVec3,
    /// To the right in the picture.
    pub right: DVec3,
    /// Up in the picture.
    pub up: DVec3,
    /// Into the picture.
    pub forward: DVec3,
    /// How points are projected.
    pub projection: Projection,
}

/// How a camera projects. Clipping planes are ignored: a ray tracer needs none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians, in (0, pi).
        yfov: f64,
        /// Width over height that the author had in mind. The picture's own size decides; this picks the default size.
        aspect: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the width of the view, scene space, positive. Gives way to the picture's own aspect.
        xmag: f64,
        /// Half the height of the view, scene space, positive.
        ymag: f64,
    },
}

/// Where rays end that hit nothing, and the light that comes from everywhere.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// What camera rays see that hit nothing.
    pub background: Background,
    /// Constant radiance that arrives from every direction at diffuse surfaces and rough lobes (`Ia` in eq. 14.32).
    pub ambient: Vec3,
    /// Light from all around by direction.
    pub environment: Option<Environment>,
}

/// What camera rays see that hit nothing. Reflected and refracted rays see the environment where there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// The environment where there is one, else black.
    #[default]
    Environment,
    /// A linear colour. Also what reflected and refracted rays see where there is no environment.
    Color(Vec3),
    /// Black with alpha 0: to be composited.
    Transparent,
}

/// Something in the file that was left out or mended; the picture may differ from what its author meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where: "mesh 2 'wheel', primitive 0", "extension KHR_materials_sheen".
    pub place: String,
    /// What, and what it means for the picture.
    pub text: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tie_falls_the_same_way_at_every_size() {
        // 1 + 2^-24 lies in the middle between two f32; of an extent of 3, to make a third inexact.
        let tie = 3.0 * (1.0 + 2_f64.powi(-24));
        for size in (-12..=12).map(|k| 10_f64.powi(k)) {
            let frame = Frame::new(Place::ORIGIN, 3.0 * size);
            for noise in [0.0, 1e-15, -1e-15] {
                let point = DVec3::splat(tie * size * (1.0 + noise));
                assert_eq!(frame.to_scene(point).as_vec3(), Vec3::ONE, "{size:e}");
            }
        }
    }

    #[test]
    fn what_is_rounded_away_is_noise() {
        let frame = Frame::new(DVec3::splat(1e6).into(), 2.0);
        let point = DVec3::new(1e6 + 0.123_456_789, 1e6, 1e6 - 1e-9);
        let expected = 0.5 * (point - DVec3::splat(1e6));
        let error = (frame.to_scene(point) - expected).abs();
        assert!(error.cmple(2_f64.powi(-43) * expected.abs()).all());
        assert_eq!(frame.to_world(expected), point);
        assert_eq!(frame.to_scene(DVec3::splat(1e6)), DVec3::ZERO);
    }

    #[test]
    fn a_frame_without_extent_leaves_metres() {
        for extent in [0.0, f64::INFINITY, f64::NAN, -1.0, 1e-320] {
            assert_eq!(Frame::new(Place::ORIGIN, extent).scale, 1.0);
        }
    }
}
