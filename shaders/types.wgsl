// Structs shared with the host. crates/gpu/types.rs mirrors each; tests/shaders.rs compares the layouts.

// One level of the environment map inside `environment`.
struct EnvironmentLevel {
    offset: u32, // of the first texel in `environment`
    width: u32,
    height: u32,
    unused: u32,
}

// What is the same for all invocations of a dispatch.
struct Frame {
    ray_start: vec3f, // of the ray through the picture's middle: its place at t = 0
    sample: u32, // of each pixel, that this dispatch is for
    camera_right: vec3f, // to the picture's right edge (perspective: at unit distance along forward)
    max_depth: u32,
    camera_up: vec3f, // to the picture's upper edge
    light_count: u32,
    camera_forward: vec3f,
    min_weight: f32,
    start_right: vec3f, // from ray_start to that of the ray at the picture's right edge; 0 for a pinhole that rays start from
    start_t: f32, // where camera rays begin: at the camera, or -T_MAX where nothing lies behind it
    start_up: vec3f, // .. at the upper edge
    start_depth: f32, // of ray_start before the camera
    ambient: vec3f,
    unused: u32,
    background: vec3f,
    background_kind: u32, // BACKGROUND_*
    branch_bound: vec3f, // what any spawned ray could bring: tolerance.wgsl
    order_count: u32, // slots with an order, in a program with a tolerance; 0: each takes the first sample of its pixel
    picture_size: vec2f, // of the whole picture, pixels
    sample_offset: vec2f, // from the middle of each pixel to that sample, pixels
    window_origin: vec2u, // of the part that is rendered
    window_size: vec2u,
    tile_columns: u32, // 8x8 tiles across the window
    first_tile: u32, // of this batch
    tile_count: u32, // of this batch: one workgroup each
    tile_stride: u32, // coprime to tile_count: workgroup g renders tile first_tile + g * tile_stride mod tile_count
    slot_count: u32, // 64 * tile_count
    stack_capacity: u32, // work items a slot
    step_budget: u32, // node visits and triangle tests after which a ray is left to the next iteration
    vertex_words: u32, // texels of a vertex in `attributes`; the normal is the first
    uv_word: u32, // which of them the uv sets begin with, two in each
    color_word: u32,
    tangent_word: u32,
    rotation_cos: f32, // of the environment about +Y
    rotation_sin: f32,
    max_rays: u32, // of a sample's tree, shadow rays left out
    camera_media: vec2u, // what the camera is in: media.wgsl
    zero: u32, // always 0, which compilers can't know: precise.wgsl
    tolerance: f32, // without HAS_ERROR_BOUNDS: hits nearer than this, in lengths of the ray's direction, are ignored
    item_words: u32, // of an item on the ray stack, as many as are in use: the last one only where a ray may have media, or holes behind it
    texture_kinds: u32, // bit k: some material has texture k, of the eight below
    negligible: u32, // what is, as a code, where no order says it: tolerance.wgsl
    beside_stack_words: u32, // of a slot beside its stack: contact_word
    unused_0: u32,
    unused_1: u32,
    branch_mean: vec3f, // what spawned rays bring in the mean, which is shown where one is left out: tolerance.wgsl
    light_share: f32, // of what is negligible, what is of a light: 1, or 0 where it is tried what branches bring
    @align(16) environment: array<EnvironmentLevel, 6>, // radiance, roughness 1/4, 2/4, 3/4, 1, irradiance
}

const BACKGROUND_ENVIRONMENT: u32 = 0u;
const BACKGROUND_COLOR: u32 = 1u;
const BACKGROUND_TRANSPARENT: u32 = 2u;

// A triangle but for its corners' positions, material and node: what traversal reads at every test lies apart. In both the
// vertices are turned so that the first is the one opposite to the longest edge (crates/gpu/upload.rs).
struct LeafTriangle {
    vertices: vec3u, // their records in `attributes`, which vertices that are equal share
    entry: u32, // its index in the scene, with LEAF_* flags; 0 for an instance
}

// Flags that traversal needs, in the upper bits of `LeafTriangle.entry`.
const LEAF_CULLED: u32 = 0x80000000u; // radiance rays don't see its back
const LEAF_TRANSPARENT: u32 = 0x40000000u; // may let light through: blended, masked or transmitting
const LEAF_TRIANGLE: u32 = 0x3fffffffu;

// A material's use of a texture: an image with the way to read it.
struct TextureUse {
    row_u: vec3f, // u' = dot(row_u, (u, v, 1))
    offset: u32, // of the first texel in `texels`; NO_TEXTURE for none
    row_v: vec3f,
    uv_set: u32,
    width: u32,
    height: u32,
    flags: u32, // wrap in u: bits 0-1, in v: bits 2-3, TEXTURE_*
    unused: u32,
}

const SRGB_CODES: u32 = 256u;
const NO_TEXTURE: u32 = 0xffffffffu;

// Which of the eight that a material may have is which.
const BASE_COLOR_TEXTURE: u32 = 0u;
const METALLIC_ROUGHNESS_TEXTURE: u32 = 1u;
const NORMAL_TEXTURE: u32 = 2u;
const OCCLUSION_TEXTURE: u32 = 3u;
const EMISSIVE_TEXTURE: u32 = 4u;
const TRANSMISSION_TEXTURE: u32 = 5u;
const SPECULAR_TEXTURE: u32 = 6u;
const SPECULAR_COLOR_TEXTURE: u32 = 7u;
const MATERIAL_TEXTURES: u32 = 8u; // how many there are

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    alpha_cutoff: f32,
    specular_color: vec3f,
    specular: f32,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    ior: f32, // IOR_INFINITE stands for infinity
    normal_scale: f32,
    occlusion_strength: f32,
    flags: u32, // MATERIAL_*
    medium: u32, // of the solid that it bounds, an index into `media` plus 1; 0 for none
    whitted_ks: vec3f, // these five hold where the flag of the same name is set
    whitted_n: f32,
    whitted_kt: vec3f,
    whitted_ka: f32,
    whitted_kd: f32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
}

const MATERIAL_MASK: u32 = 1u;
const MATERIAL_BLEND: u32 = 2u;
const MATERIAL_UNLIT: u32 = 4u;
const MATERIAL_KA: u32 = 8u;
const MATERIAL_KD: u32 = 16u;
const MATERIAL_KS: u32 = 32u;
const MATERIAL_N: u32 = 64u;
const MATERIAL_KT: u32 = 128u;

const IOR_INFINITE: f32 = 1e30;

const WRAP_REPEAT: u32 = 0u;
const WRAP_MIRRORED: u32 = 1u;
const WRAP_CLAMP: u32 = 2u;
const TEXTURE_NEAREST: u32 = 16u;
const TEXTURE_SRGB: u32 = 32u;

struct Light {
    position: vec3f,
    kind: u32, // LIGHT_*
    direction: vec3f, // in which it shines
    inverse_range: f32, // 0 for no range
    intensity: vec3f,
    spot_scale: f32, // 1 / (cos inner - cos outer)
    spot_cos_outer: f32,
    nearest: f32, // nearer to it the irradiance would be above LARGEST_RADIANCE
    unused_0: u32,
    unused_1: u32,
}

const LIGHT_DIRECTIONAL: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const LIGHT_SPOT: u32 = 2u;

const MEDIA: u32 = 255u; // that a byte of the medium stack can name

// What fills a solid.
struct Medium {
    absorption: vec3f, // sigma, per unit of scene space
    ior: f32,
    priority: u32, // where solids overlap the highest counts
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
}

// A pixel's progress between kernels, or, in a program with a tolerance, that of a sample: it then holds its order, if it has one, until
// it begins, and the last two words are what tolerance.wgsl says.
struct Slot {
    radiance: vec4f, // sum over the samples; alpha in w
    rays: u32, // traced so far, of all kinds
    common_rays: u32, // of the current sample's tree, see ray_tree.wgsl
    dropped_storage: u32, // branches that ended for want of room
    dropped_budget: u32,
}

// How many entries a list has: the arguments of an indirect dispatch over it, and the lengths of its parts.
struct WorkList {
    workgroups: atomic<u32>, // of the longest part
    parts: u32, // LIST_PARTS
    workgroups_z: u32, // 1
    zero: u32, // always 0: loop_end of state.wgsl
    lengths: array<PartLength, LIST_PARTS>,
}

// Far enough from the next that two threads of a processor don't wait for each other: a cache line.
struct PartLength {
    @size(64) entries: atomic<u32>,
}

const LIST_PARTS: u32 = 16u;

// What the probe kernel traces, and what it finds.
struct ProbeRay {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    shadow: u32,
}

struct ProbeHit {
    t: f32,
    u: f32,
    v: f32,
    triangle: u32,
}

// What the secondary kernel traces: a ray, and how another one leaves the surface that it hits.
struct SecondaryRay {
    origin: vec3f,
    leaving: u32, // LEAVING_*: what `next` means
    direction: vec3f,
    unused_0: u32,
    next: vec3f,
    unused_1: u32,
}

const LEAVING_ALONG: u32 = 0u; // `next` is the second ray's direction, scene space
const LEAVING_ABOUT_NORMAL: u32 = 1u; // .. its components along two tangents and the geometric normal of the hit
const LEAVING_MIRRORED: u32 = 2u; // the mirrored direction; `next` is not read

// .. and what it finds.
struct SecondaryHit {
    position: vec3f, // of the first hit
    triangle: u32, // that the first ray hits; NO_HIT for none, and then nothing else is set
    origin: vec3f, // of the second ray
    t: f32, // where the second ray hits
    direction: vec3f, // of the second ray
    next_triangle: u32, // that it hits, NO_HIT for none
    ng: vec3f, // of the first hit, towards the first ray
    back: u32, // the first hit is seen from behind
    ns: vec3f,
    unused: u32,
}

// First-hit layers of a pixel.
struct Aov {
    position: vec3f,
    depth: f32, // along the camera's forward axis, scene space; negative for none
    geometric_normal: vec3f,
    material: u32,
    shading_normal: vec3f,
    node: u32,
    albedo: vec3f,
    unused: u32,
}
