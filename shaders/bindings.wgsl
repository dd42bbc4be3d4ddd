// Every binding of every kernel. A program keeps only those that it reaches. No kernel reaches more than 10 storage buffers,
// which is all that SwiftShader has.

@group(0) @binding(0) var<uniform> frame: Frame;

// The scene.
@group(0) @binding(1) var<storage, read> nodes: array<vec4u>; // CWBVH, 5 a node
@group(0) @binding(2) var<storage, read> leaf_vertices: array<f32>; // 12 a triangle, in leaf order: corners, unit normal
@group(0) @binding(3) var<storage, read> leaf_triangles: array<LeafTriangle>; // in leaf order
@group(0) @binding(4) var<storage, read> attributes: array<f32>; // normals, then uv sets, then colours, then tangents
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var<storage, read> texels: array<u32>; // 256 floats that decode sRGB, images (RGBA8), environment (3 floats)
@group(0) @binding(7) var<storage, read> lights: array<Light>;
@group(0) @binding(8) var<uniform> media: array<Medium, MEDIA>; // in the order of their rank: README.md, "Media"
@group(0) @binding(9) var<uniform> samples: array<vec4f, SAMPLE_PAIRS>; // offsets from the middle of a pixel, pixels: two each

// What a kernel writes.
@group(1) @binding(0) var<storage, read_write> slots: array<Slot>;
@group(1) @binding(1) var<storage, read_write> ray_stack: array<vec4u>; // see ray_stack.wgsl
@group(1) @binding(2) var<storage, read_write> counters: array<atomic<u32>>; // see counters.wgsl
@group(1) @binding(3) var<storage, read_write> aovs: array<Aov>;
@group(1) @binding(4) var<storage, read> probe_rays: array<ProbeRay>;
@group(1) @binding(5) var<storage, read_write> probe_hits: array<ProbeHit>;
@group(1) @binding(6) var<storage, read> piece_arguments: array<u32>;
@group(1) @binding(7) var<storage, read_write> piece_results: array<u32>;
@group(1) @binding(8) var<storage, read> secondary_rays: array<SecondaryRay>;
@group(1) @binding(9) var<storage, read_write> secondary_hits: array<SecondaryHit>;
