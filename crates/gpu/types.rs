//! Structs shared with the shaders: each mirrors the one of the same name in `shaders/types.wgsl`, where the fields are
//! explained. `tests/shaders.rs` compares sizes and offsets with naga's reflection of the WGSL.

use bytemuck::{Pod, Zeroable};

use crate::batch::TILE_PIXELS;

/// How many media the stack of a ray can tell apart.
pub const MEDIA: usize = 255;

/// How many textures a material can have.
pub const MATERIAL_TEXTURES: usize = 8;

/// Codes of 8 bits.
pub const SRGB_CODES: usize = 256;

/// How many levels of the environment there are: the map, four of rising roughness, the irradiance.
pub const ENVIRONMENT_LEVELS: usize = 6;

/// One level of the environment map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct EnvironmentLevel {
    pub offset: u32,
    pub width: u32,
    pub height: u32,
    pub unused: u32,
}

/// What is the same for all invocations of a dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Frame {
    pub ray_start: [f32; 3],
    pub sample: u32,
    pub camera_right: [f32; 3],
    pub max_depth: u32,
    pub camera_up: [f32; 3],
    pub light_count: u32,
    pub camera_forward: [f32; 3],
    pub min_weight: f32,
    pub start_right: [f32; 3],
    pub start_t: f32,
    pub start_up: [f32; 3],
    pub start_depth: f32,
    pub ambient: [f32; 3],
    pub unused: u32,
    pub background: [f32; 3],
    pub background_kind: u32,
    pub branch_bound: [f32; 3],
    pub order_count: u32,
    pub picture_size: [f32; 2],
    pub sample_offset: [f32; 2],
    pub window_origin: [u32; 2],
    pub window_size: [u32; 2],
    pub tile_columns: u32,
    pub first_tile: u32,
    pub tile_count: u32,
    pub tile_stride: u32,
    pub slot_count: u32,
    pub stack_capacity: u32,
    pub step_budget: u32,
    pub vertex_words: u32,
    pub uv_word: u32,
    pub color_word: u32,
    pub tangent_word: u32,
    pub rotation_cos: f32,
    pub rotation_sin: f32,
    pub max_rays: u32,
    pub camera_media: [u32; 2],
    pub zero: u32,
    pub tolerance: f32,
    pub item_words: u32,
    pub texture_kinds: u32,
    pub negligible: u32,
    pub beside_stack_words: u32,
    pub unused_0: u32,
    pub unused_1: u32,
    pub branch_mean: [f32; 3],
    pub light_share: f32,
    pub environment: [EnvironmentLevel; ENVIRONMENT_LEVELS],
}

/// A triangle but for its corners' positions, material and node.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct LeafTriangle {
    pub vertices: [u32; 3],
    pub entry: u32,
}

/// A material's use of a texture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct TextureUse {
    pub row_u: [f32; 3],
    pub offset: u32,
    pub row_v: [f32; 3],
    pub uv_set: u32,
    pub width: u32,
    pub height: u32,
    pub flags: u32,
    pub unused: u32,
}

impl TextureUse {
    /// No texture.
    pub const NONE: Self = Self {
        row_u: [0.0; 3],
        offset: u32::MAX,
        row_v: [0.0; 3],
        uv_set: 0,
        width: 0,
        height: 0,
        flags: 0,
        unused: 0,
    };
}

/// A resolved material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Material {
    pub base_color: [f32; 4],
    pub emissive: [f32; 3],
    pub alpha_cutoff: f32,
    pub specular_color: [f32; 3],
    pub specular: f32,
    pub metallic: f32,
    pub roughness: f32,
    pub transmission: f32,
    pub ior: f32,
    pub normal_scale: f32,
    pub occlusion_strength: f32,
    pub flags: u32,
    pub medium: u32,
    pub whitted_ks: [f32; 3],
    pub whitted_n: f32,
    pub whitted_kt: [f32; 3],
    pub whitted_ka: f32,
    pub whitted_kd: f32,
    pub unused_0: u32,
    pub unused_1: u32,
    pub unused_2: u32,
}

/// A punctual light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Light {
    pub position: [f32; 3],
    pub kind: u32,
    pub direction: [f32; 3],
    pub inverse_range: f32,
    pub intensity: [f32; 3],
    pub spot_scale: f32,
    pub spot_cos_outer: f32,
    pub nearest: f32,
    pub unused_0: u32,
    pub unused_1: u32,
}

/// What fills a solid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Medium {
    pub absorption: [f32; 3],
    pub ior: f32,
    pub priority: u32,
    pub unused_0: u32,
    pub unused_1: u32,
    pub unused_2: u32,
}

/// A pixel's progress between dispatches.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Slot {
    pub radiance: [f32; 4],
    pub rays: u32,
    pub common_rays: u32,
    pub dropped_storage: u32,
    pub dropped_budget: u32,
}

/// How many entries a list of slots has.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct WorkList {
    pub workgroups: u32,
    pub parts: u32,
    pub workgroups_z: u32,
    pub zero: u32,
    pub lengths: [PartLength; LIST_PARTS as usize],
}

/// How many entries a part of a list has.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct PartLength {
    pub entries: u32,
    pub padding: [u32; 15],
}

/// Of the same name in `shaders/types.wgsl`.
pub const LIST_PARTS: u32 = 16;

impl WorkList {
    /// Without entries.
    pub const EMPTY: Self = Self {
        workgroups: 0,
        parts: LIST_PARTS,
        workgroups_z: 1,
        zero: 0,
        lengths: [PartLength {
            entries: 0,
            padding: [0; 15],
        }; LIST_PARTS as usize],
    };

    /// Where entries lie in its queue, part by part: `place_in_list` of `shaders/work_lists.wgsl`.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        let lengths = self.lengths.map(|part| part.entries);
        lengths.into_iter().zip(0..).flat_map(|(length, part)| {
            let place =
                move |k| (k / TILE_PIXELS * LIST_PARTS + part) * TILE_PIXELS + k % TILE_PIXELS;
            (0..length).map(move |k| place(k) as usize)
        })
    }

    /// Entries of all parts.
    #[must_use]
    pub fn length(&self) -> u32 {
        self.lengths.iter().map(|part| part.entries).sum()
    }
}

/// A ray for the probe kernel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct ProbeRay {
    pub origin: [f32; 3],
    pub t_max: f32,
    pub direction: [f32; 3],
    pub shadow: u32,
}

/// What the probe kernel found.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct ProbeHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub triangle: u32,
}

/// A ray for the secondary kernel, and how another one leaves what it hits.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct SecondaryRay {
    pub origin: [f32; 3],
    pub leaving: u32,
    pub direction: [f32; 3],
    pub unused_0: u32,
    pub next: [f32; 3],
    pub unused_1: u32,
}

/// [`SecondaryRay::leaving`]: `next` is the second ray's direction, scene space.
pub const LEAVING_ALONG: u32 = 0;
/// [`SecondaryRay::leaving`]: `next` is the direction's components along two tangents and the geometric normal of the hit.
pub const LEAVING_ABOUT_NORMAL: u32 = 1;
/// [`SecondaryRay::leaving`]: the mirrored direction.
pub const LEAVING_MIRRORED: u32 = 2;

/// What the secondary kernel found.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct SecondaryHit {
    pub position: [f32; 3],
    pub triangle: u32,
    pub origin: [f32; 3],
    pub t: f32,
    pub direction: [f32; 3],
    pub next_triangle: u32,
    pub ng: [f32; 3],
    pub back: u32,
    pub ns: [f32; 3],
    pub unused: u32,
}

/// First-hit layers of a pixel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs, reason = "explained in shaders/types.wgsl")]
pub struct Aov {
    pub position: [f32; 3],
    pub depth: f32,
    pub geometric_normal: [f32; 3],
    pub material: u32,
    pub shading_normal: [f32; 3],
    pub node: u32,
    pub albedo: [f32; 3],
    pub unused: u32,
}
