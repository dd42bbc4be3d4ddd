// Meshes that several nodes share lie in the scene once, in a space of their own. A ray that comes to a place of such a mesh goes on
// in the mesh's hierarchy, along its own line in the mesh's space; triangles are brought to scene space before anything is asked of
// them, so that what they share with their neighbours, and all that follows, is as if each had been copied.

// The place of a mesh: corner -> high + (low + linear corner). Parts of the translation are added last and first: what is
// rounded is hardly more than the sum.
struct Placement {
    row_x: vec3f, // of the linear part
    row_y: vec3f,
    row_z: vec3f,
    high: vec3f, // the translation, rounded
    low: vec3f, // .. and what rounding took away
    normal_x: vec3f, // rows of the inverse transpose, up to a positive factor
    normal_y: vec3f,
    normal_z: vec3f,
    half: vec3f, // half the sides of the mesh's box, scene space, as far as the axes of its own space reach
    slant: f32, // bound of how far a normal that was brought to scene space may be turned, radians
    first: u32, // what the number of a triangle is counted from (Hit.triangle)
    mirrored: bool,
    still: bool, // the scene's own
}

const INSTANCE_WORDS: u32 = 10u;

// In `leaf_vertices` an entry that is no triangle but a place of a mesh has this for its normal's x, and the instance's number for
// the first coordinate.
const INSTANCE_NORMAL: f32 = 2.0;

// A group of children that are places of meshes, on the traversal's stack: with its first leaf.
const INSTANCE_GROUP: u32 = 0x80000000u;

// What the hit at hand lies on: an instance, plus 1; 0 for a triangle of the scene's own. Beside Hit, so that programs without
// instances have nothing of it.
var<private> met: u32;

// Likewise: whose triangles are traversed, where, and how far beside its line the ray may run in the mesh's space, in lengths of it.
var<private> within: u32;
var<private> placement: Placement;
var<private> box_pad: vec3f;

// Children of the node at hand that are instances, and how high the stack was when the scene's own triangles were left.
var<private> instance_bits: u32;
var<private> entered_height: u32;

fn instance_word(instance: u32, word: u32) -> vec4u {
    return textureLoad(instances, table_place((instance - 1u) * INSTANCE_WORDS + word));
}

// `instance` as in `met`.
fn load_placement(instance: u32) -> Placement {
    let x = bitcast<vec4f>(instance_word(instance, 0u));
    let y = bitcast<vec4f>(instance_word(instance, 1u));
    let z = bitcast<vec4f>(instance_word(instance, 2u));
    let low = bitcast<vec4f>(instance_word(instance, 3u));
    let normal_x = bitcast<vec4f>(instance_word(instance, 7u));
    let normal_y = bitcast<vec4f>(instance_word(instance, 8u));
    let normal_z = bitcast<vec4f>(instance_word(instance, 9u));
    return Placement(
        x.xyz, y.xyz, z.xyz, vec3f(x.w, y.w, z.w), low.xyz, normal_x.xyz, normal_y.xyz, normal_z.xyz,
        vec3f(normal_x.w, normal_y.w, normal_z.w), low.w, instance_first(instance), instance_mirrored(instance), false,
    );
}

// Where all stays as it is, to the bit.
fn placement_of_scene() -> Placement {
    let x = vec3f(1.0, 0.0, 0.0);
    let y = vec3f(0.0, 1.0, 0.0);
    let z = vec3f(0.0, 0.0, 1.0);
    return Placement(x, y, z, vec3f(0.0), vec3f(0.0), x, y, z, vec3f(0.0), 0.0, 0u, false, true);
}

fn instance_mirrored(instance: u32) -> bool {
    return (instance_word(instance, 4u).w & 1u) != 0u;
}

fn instance_first(instance: u32) -> u32 {
    return instance_word(instance, 5u).w;
}

// The instance, as in `met`, that an entry of `leaf_vertices` stands for.
fn leaf_instance(leaf: u32) -> u32 {
    return bitcast<u32>(leaf_vertex_word(3u * leaf).x) + 1u;
}

// Where the mesh's hierarchy begins.
fn instance_root(instance: u32) -> u32 {
    return instance_word(instance, 6u).w;
}

fn instance_node(instance: u32) -> u32 {
    return instance_word(instance, 4u).w >> 1u;
}

fn placed_vector(vector: vec3f) -> vec3f {
    return vec3f(dot(placement.row_x, vector), dot(placement.row_y, vector), dot(placement.row_z, vector));
}

// Not of unit length.
fn placed_normal(normal: vec3f) -> vec3f {
    return vec3f(dot(placement.normal_x, normal), dot(placement.normal_y, normal), dot(placement.normal_z, normal));
}

fn placed_point(point: vec3f) -> vec3f {
    return placement.high + (placement.low + placed_vector(point));
}

// A triangle of the mesh that `placement` places, counter-clockwise from the front again.
fn placed(corners: Vertices) -> Vertices {
    let first = placed_point(corners.v0);
    let second = placed_point(corners.v1);
    let third = placed_point(corners.v2);
    let e1 = select(second, third, placement.mirrored) - first;
    let e2 = select(third, second, placement.mirrored) - first;
    // Of the corners as they have been rounded: of a small triangle a normal that is right for those of the mesh is not theirs, and a
    // flat ray that leaves a neighbour sees it where it is not. Only of slivers is what they span noise.
    var normal = cross(e1, e2);
    if (placement.still || is_sliver(e1, e2, normal)) {
        normal = placed_normal(corners.normal);
    }
    return Vertices(first, select(second, third, placement.mirrored), select(third, second, placement.mirrored), normal);
}

// The angle between its edges is within 3.6 degrees of 0 or 180: their product has lost 4 bits.
fn is_sliver(e1: vec3f, e2: vec3f, across: vec3f) -> bool {
    return 256.0 * dot(across, across) < dot(e1, e1) * dot(e2, e2);
}

// How far a triangle's plane, by its normal, may lie beside its corners. (The host makes normals of the scene's own triangles from
// their corners.)
fn placed_error(v0: vec3f, e1: vec3f, e2: vec3f) -> vec3f {
    let across = cross(e1, e2);
    let longest = max(length(e1), length(e2));
    if (is_sliver(e1, e2, across)) {
        // Corners were rounded apart from it, and it was turned a little.
        return gamma(3.0) * (abs(v0) + abs(e1) + abs(e2)) + gamma(10.0) * placement.half + vec3f(placement.slant * longest);
    }
    // Three roundings of each product and their difference, in relation to what is left.
    return vec3f(gamma(6.0) * length(e1) * length(e2) / max(length(across), 1e-30) * longest);
}

// The triangle of a hit, in scene space; its normal of unit length.
fn met_positions(leaf: u32) -> Vertices {
    var corners = leaf_positions(leaf);
    if (HAS_INSTANCES) {
        if (met != 0u) {
            placement = load_placement(met);
            corners = placed(corners);
            corners.normal = normalize_or(corners.normal, vec3f(0.0));
        }
    }
    return corners;
}

// .. and its vertices, in the same order.
fn met_vertices(leaf: u32) -> vec3u {
    let vertices = leaf_triangle(leaf).vertices;
    if (HAS_INSTANCES) {
        return select(vertices, vertices.xzy, met != 0u && placement.mirrored);
    }
    return vertices;
}

// The number of a triangle of the mesh at hand, from its entry.
fn met_number(entry: u32) -> u32 {
    return (entry & LEAF_TRIANGLE) + instance_first(met);
}

// What a ray keeps for the box tests of a mesh. `t` counts as in scene space.
//
// How far off the ray is: its origin by the way from the mesh (2 roundings), the matrix (1) and the product (3), its direction
// by 4 over the way to the mesh. And by how much a triangle that it hits may lie beside the mesh's: corners are off by 5 roundings of
// what the mesh spans and one of where it is, and the triangle's test sees them with 8 more of their distance. All are brought
// to the mesh's space by the inverse, with signs that don't cancel.
fn ray_within(instance: u32, origin: vec3f, direction: vec3f) -> BoxRay {
    within = instance;
    placement = load_placement(instance);
    let x = bitcast<vec3f>(instance_word(instance, 4u).xyz);
    let y = bitcast<vec3f>(instance_word(instance, 5u).xyz);
    let z = bitcast<vec3f>(instance_word(instance, 6u).xyz);
    let way = (origin - placement.high) - placement.low;
    let ray = box_ray(
        vec3f(dot(x, way), dot(y, way), dot(z, way)),
        vec3f(dot(x, direction), dot(y, direction), dot(z, direction)),
    );
    let reach = gamma(32.0) * (abs(way) + abs(placement.high) + placement.half);
    box_pad = vec3f(dot(abs(x), reach), dot(abs(y), reach), dot(abs(z), reach)) * abs(ray.inverse);
    return ray;
}

// Back in scene space.
fn ray_without(origin: vec3f, direction: vec3f) -> BoxRay {
    within = 0u;
    placement = placement_of_scene();
    box_pad = vec3f(0.0);
    return box_ray(origin, direction);
}
