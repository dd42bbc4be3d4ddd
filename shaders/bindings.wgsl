// Every binding of every kernel. A program keeps only those that it reaches.

@group(0) @binding(0) var<uniform> frame: Frame;

// The scene.
@group(0) @binding(1) var<storage, read> nodes: array<vec4u>; // CWBVH, 5 a node
@group(0) @binding(2) var<storage, read> leaf_vertices: array<f32>; // 9 a triangle, in leaf order
@group(0) @binding(3) var<storage, read> leaf_triangles: array<u32>; // leaf order -> triangle, with LEAF_* flags
@group(0) @binding(4) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(5) var<storage, read> normals: array<f32>; // 3 a vertex
@group(0) @binding(6) var<storage, read> attributes: array<f32>; // uv sets, then colours, then tangents
@group(0) @binding(7) var<storage, read> materials: array<Material>;
@group(0) @binding(8) var<storage, read> media: array<Medium>;
@group(0) @binding(9) var<storage, read> textures: array<Texture>;
@group(0) @binding(10) var<storage, read> texels: array<u32>; // 256 floats that decode sRGB, then RGBA8
@group(0) @binding(11) var<storage, read> lights: array<Light>;
@group(0) @binding(12) var<storage, read> environment: array<f32>; // 3 a texel
@group(0) @binding(13) var<storage, read> samples: array<vec2f>; // offsets from the middle of a pixel, pixels

// What a kernel writes.
@group(1) @binding(0) var<storage, read_write> slots: array<Slot>;
@group(1) @binding(1) var<storage, read_write> ray_stack: array<vec4u>; // see ray_stack.wgsl
@group(1) @binding(2) var<storage, read_write> counters: array<atomic<u32>>; // see counters.wgsl
@group(1) @binding(3) var<storage, read_write> aovs: array<Aov>;
@group(1) @binding(4) var<storage, read> probe_rays: array<ProbeRay>;
@group(1) @binding(5) var<storage, read_write> probe_hits: array<ProbeHit>;
