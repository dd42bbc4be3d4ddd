// Every binding of every kernel. A program keeps only those that it reaches. No kernel reaches more than 10 storage buffers,
// which is all that SwiftShader has.

@group(0) @binding(0) var<uniform> frame: Frame;

// The scene, in tables: textures of 32-bit words that are read texel by texel (tables.wgsl). A program reads 10 at most.
@group(0) @binding(1) var nodes: texture_storage_2d<rgba32uint, read>; // CWBVH, 5 texels a node
@group(0) @binding(2) var leaf_vertices: texture_storage_2d<rgba32uint, read>; // in leaf order, 3 texels a triangle: corners, unit normal; or an instance: instances.wgsl
@group(0) @binding(3) var leaf_triangles: texture_storage_2d<rgba32uint, read>; // LeafTriangle, in leaf order
@group(0) @binding(4) var leaf_materials: texture_storage_2d<r32uint, read>; // in leaf order, one word a triangle
@group(0) @binding(5) var leaf_nodes: texture_storage_2d<r32uint, read>; // .. of the scene's tree, not of the hierarchy
@group(0) @binding(6) var attributes: texture_storage_2d<rgba32uint, read>; // frame.vertex_words texels a vertex: normal, then uv sets, colour, tangent
@group(0) @binding(7) var materials: texture_storage_2d<rgba32uint, read>; // Material
@group(0) @binding(8) var texture_uses: texture_storage_2d<rgba32uint, read>; // TextureUse, MATERIAL_TEXTURES for each material
@group(0) @binding(9) var texels: texture_storage_2d<r32uint, read>; // of all images, RGBA8: one word each
@group(0) @binding(10) var environment: texture_storage_2d<rgba32uint, read>; // of all levels of the environment map: one colour each
@group(0) @binding(11) var lights: texture_storage_2d<rgba32uint, read>; // Light
@group(0) @binding(14) var instances: texture_storage_2d<rgba32uint, read>; // INSTANCE_WORDS texels each: instances.wgsl

@group(0) @binding(12) var<uniform> media: array<Medium, MEDIA>; // in the order of their rank: README.md, "Media"
@group(0) @binding(13) var<uniform> decoded_srgb: array<vec4f, SRGB_CODES / 4>; // of each code of 8 bits (IEC 61966-2-1)

// What a kernel writes.
@group(1) @binding(0) var<storage, read_write> state: array<vec4u>; // of every slot, and what the rays on the list hit: state.wgsl
@group(1) @binding(1) var<storage, read_write> counters: array<atomic<u32>>; // see counters.wgsl
@group(1) @binding(2) var<storage, read_write> aovs: array<Aov>;
@group(1) @binding(3) var<storage, read> probe_rays: array<ProbeRay>;
@group(1) @binding(4) var<storage, read_write> probe_hits: array<ProbeHit>;
@group(1) @binding(5) var<storage, read> piece_arguments: array<u32>;
@group(1) @binding(6) var<storage, read_write> piece_results: array<u32>;
@group(1) @binding(7) var<storage, read> secondary_rays: array<SecondaryRay>;
@group(1) @binding(8) var<storage, read_write> secondary_hits: array<SecondaryHit>;

// The list that a kernel reads and the one that it writes: they change places after each iteration (work_lists.wgsl).
@group(2) @binding(0) var<storage, read> list_in: array<vec4u>; // a WorkList: part_length
@group(2) @binding(1) var<storage, read> queue_in: array<u32>;
@group(2) @binding(2) var<storage, read_write> list_out: WorkList;
@group(2) @binding(3) var<storage, read_write> queue_out: array<u32>;
