// Ray against triangle and ray against the eight boxes of a CWBVH node.

const NO_HIT: u32 = 0xffffffffu;

struct Hit {
    t: f32,
    triangle: u32, // its number among all that are seen; NO_HIT for none
    leaf: u32, // the same triangle in leaf order
    back: bool, // seen from behind
}

// A ray's line and a triangle. t is a quotient that only few of those tested are asked for.
struct TriangleHit {
    height: f32, // of the plane over the ray's origin
    slope: f32, // by how much the ray gains on it per unit of t; above 0: seen from behind
    valid: bool, // the line meets the triangle
}

fn distance_to(found: TriangleHit) -> f32 {
    return found.height / found.slope;
}

// The plane that a ray's triangle tests look at: across its direction, sheared along the axis that it runs along most
// (Woop, Benthin and Wald 2013). Rows of the map from space, relative to the ray's origin.
struct View {
    row_x: vec3f,
    row_y: vec3f,
}

fn view_along(direction: vec3f) -> View {
    let size = abs(direction);
    if (size.z >= size.x && size.z >= size.y) {
        return View(vec3f(1.0, 0.0, -direction.x / direction.z), vec3f(0.0, 1.0, -direction.y / direction.z));
    }
    if (size.x >= size.y) {
        return View(vec3f(-direction.y / direction.x, 1.0, 0.0), vec3f(-direction.z / direction.x, 0.0, 1.0));
    }
    return View(vec3f(1.0, -direction.x / direction.y, 0.0), vec3f(0.0, -direction.z / direction.y, 1.0));
}

// Edge functions in two dimensions. A vertex has the same place in the plane in every triangle that it belongs to, and at an edge
// two products are compared that both triangles that share it compare, the other way round: a ray slips through neither edges nor
// vertices. (Edge functions in space, dot(d, cross(a, b)), hold at edges only: close to a vertex they are differences of products
// with the distance to the origin, and their signs are noise.) Compared, not subtracted: into a difference GPUs' drivers fuse one of
// the two products unrounded, which of them depends on the triangle, and one ray of 500 at an edge of a ball slips through.
fn intersect_triangle(origin: vec3f, direction: vec3f, view: View, corners: Vertices) -> TriangleHit {
    let a = corners.v0 - origin;
    let b = corners.v1 - origin;
    let c = corners.v2 - origin;
    let x = vec3f(dot(view.row_x, a), dot(view.row_x, b), dot(view.row_x, c));
    let y = vec3f(dot(view.row_y, a), dot(view.row_y, b), dot(view.row_y, c));
    // Their differences are twice the areas that the ray spans with edges 1-2, 2-0 and 0-1.
    let ahead = x.zxy * y.yzx;
    let behind = y.zxy * x.yzx;
    // The host's normal, from f64: of a sliver the cross product of the edges is noise in f32, and t with it. And a plane across an
    // axis has the same one whatever triangle spans it: of two faces in one place t is equal, and the lower index wins everywhere.
    let slope = dot(corners.normal, direction);
    // All of one sign: inside. (Zero lies on an edge and belongs to both sides.)
    let valid = (all(ahead >= behind) || all(ahead <= behind)) && slope != 0.0;
    if (HAS_INSTANCES) {
        // One that has shrunk to a point where its mesh was placed has a normal, but nothing to hit.
        return TriangleHit(dot(corners.normal, a), slope, valid && any(ahead != behind));
    }
    return TriangleHit(dot(corners.normal, a), slope, valid);
}

// Moeller and Trumbore 1997: what the HAS_WATERTIGHT test is measured against. Neighbours compute different numbers for the
// edge that they share.
fn moeller_trumbore(origin: vec3f, direction: vec3f, v0: vec3f, v1: vec3f, v2: vec3f) -> TriangleHit {
    let e1 = v1 - v0;
    let e2 = v2 - v0;
    let p = cross(direction, e2);
    let determinant = dot(e1, p);
    if (determinant == 0.0) {
        return TriangleHit(0.0, 0.0, false);
    }
    let from_v0 = origin - v0;
    let q = cross(from_v0, e1);
    let u = dot(from_v0, p) / determinant;
    let v = dot(direction, q) / determinant;
    let inside = min(u, v) >= 0.0 && u + v <= 1.0;
    return TriangleHit(-dot(e2, q), -determinant, inside);
}

// Weights of vertices 1 and 2 where the ray meets the triangle's plane (Moeller and Trumbore 1997): once for a hit, from the
// triangle's own edges, so the error is eps d/s for a triangle of size s at distance d, and so are those of interpolated normals.
fn barycentrics(origin: vec3f, direction: vec3f, v0: vec3f, v1: vec3f, v2: vec3f) -> vec2f {
    let e1 = v1 - v0;
    let e2 = v2 - v0;
    let p = cross(direction, e2);
    let determinant = dot(e1, p);
    if (determinant == 0.0) {
        return vec2f(0.0);
    }
    let from_v0 = origin - v0;
    let u = clamp(dot(from_v0, p) / determinant, 0.0, 1.0);
    let v = clamp(dot(direction, cross(from_v0, e1)) / determinant, 0.0, 1.0);
    // Beyond the third edge: back along the shorter one, along which it is the shorter way.
    let beyond = max(u + v - 1.0, 0.0);
    let along_1 = select(0.0, beyond, dot(e1, e1) < dot(e2, e2));
    return max(vec2f(u - along_1, v - (beyond - along_1)), vec2f(0.0));
}

struct Vertices {
    v0: vec3f,
    v1: vec3f,
    v2: vec3f,
    normal: vec3f, // unit, towards the front
}

fn leaf_positions(leaf: u32) -> Vertices {
    let a = leaf_vertex_word(3u * leaf);
    let b = leaf_vertex_word(3u * leaf + 1u);
    let c = leaf_vertex_word(3u * leaf + 2u);
    return Vertices(a.xyz, vec3f(a.w, b.xy), vec3f(b.zw, c.x), c.yzw);
}

// What a ray keeps for its box tests.
struct BoxRay {
    origin: vec3f,
    inverse: vec3f,
    negative: vec3<bool>, // direction < 0
    octant: u32, // order of the children, in each byte
}

fn box_ray(origin: vec3f, direction: vec3f) -> BoxRay {
    let inverse = safe_reciprocal(direction);
    let negative = inverse < vec3f(0.0);
    let octant = select(4u, 0u, negative.x) | select(2u, 0u, negative.y) | select(1u, 0u, negative.z);
    return BoxRay(origin, inverse, negative, octant * 0x01010101u);
}

// Four of the eight children (Ylitie et al. 2017). Bits of the result: see intersect_node.
fn intersect_children(
    child_slots: u32, octant: u32,
    near_x: u32, far_x: u32, near_y: u32, far_y: u32, near_z: u32, far_z: u32,
    step: vec3f, near_start: vec3f, far_start: vec3f, t_min: f32, t_max: f32,
) -> u32 {
    let is_inner = (child_slots & (child_slots << 1u)) & 0x10101010u;
    let inner_mask = (is_inner >> 4u) * 0xffu;
    let bit_index = (child_slots ^ (octant & inner_mask)) & 0x1f1f1f1fu;
    let child_bits = (child_slots >> 5u) & 0x07070707u;

    let enter_x = vec4f(unpack4xU8(near_x)) * step.x + near_start.x;
    let enter_y = vec4f(unpack4xU8(near_y)) * step.y + near_start.y;
    let enter_z = vec4f(unpack4xU8(near_z)) * step.z + near_start.z;
    let leave_x = vec4f(unpack4xU8(far_x)) * step.x + far_start.x;
    let leave_y = vec4f(unpack4xU8(far_y)) * step.y + far_start.y;
    let leave_z = vec4f(unpack4xU8(far_z)) * step.z + far_start.z;
    let enter = greater(greater(enter_x, enter_y), greater(enter_z, vec4f(t_min)));
    let leave = lesser(lesser(leave_x, leave_y), lesser(leave_z, vec4f(t_max)));
    let bits = select(vec4u(0u), unpack4xU8(child_bits) << unpack4xU8(bit_index), enter <= leave);
    return bits.x | bits.y | bits.z | bits.w;
}

// A node of the hierarchy: eight children, each a node or up to three triangles, with boxes on a grid of 256 steps to a side.
struct Node {
    corner: vec3f, // of the grid, scene space or that of a shared mesh
    exponents: vec3u, // of the grid's steps: powers of two, biased as f32's
    inner: u32, // bit k: child k is a node
    first_child: u32, // its nodes lie side by side, those of lower children first
    first_leaf: u32, // .. and so do its triangles, in leaf order
    child_slots: vec2u, // a byte for each child: see intersect_children
    bounds_x: vec4u, // a byte for each child: min of children 0-3, 4-7, max of children 0-3, 4-7
    bounds_y: vec4u,
    bounds_z: vec4u,
}

const NODE_WORDS: u32 = 5u;

// All of it at once: what is loaded twice drivers load twice.
fn load_node(index: u32) -> Node {
    let word = index * NODE_WORDS;
    let head = node_word(word);
    let second = node_word(word + 1u);
    let exponents = (vec3u(head.w) >> vec3u(0u, 8u, 16u)) & vec3u(0xffu);
    return Node(
        bitcast<vec3f>(head.xyz), exponents, head.w >> 24u, second.x, second.y, second.zw,
        node_word(word + 2u), node_word(word + 3u), node_word(word + 4u),
    );
}

// The children that the ray meets in [t_min, t_max]: bits 24-31 inner nodes in the order to visit them (highest first), bits
// 0-23 triangles from the node's first.
fn intersect_node(ray: BoxRay, node: Node, t_min: f32, t_max: f32) -> u32 {
    let step = bitcast<vec3f>(node.exponents << vec3u(23u)) * ray.inverse;
    let start = (node.corner - ray.origin) * ray.inverse;
    // Widened by more than all roundings here and in the builder's quantisation (cf. Ize 2013), so no box is missed.
    let slack = 4.7683716e-7 * (abs(start) + 256.0 * abs(step)); // 2^-21
    var near_start = start;
    var far_start = start;
    if (HAS_PADDED_BOXES) {
        near_start -= slack;
        far_start += slack;
    }
    if (HAS_INSTANCES) {
        near_start -= box_pad;
        far_start += box_pad;
    }

    let near_x = select(node.bounds_x.xy, node.bounds_x.zw, ray.negative.x);
    let far_x = select(node.bounds_x.zw, node.bounds_x.xy, ray.negative.x);
    let near_y = select(node.bounds_y.xy, node.bounds_y.zw, ray.negative.y);
    let far_y = select(node.bounds_y.zw, node.bounds_y.xy, ray.negative.y);
    let near_z = select(node.bounds_z.xy, node.bounds_z.zw, ray.negative.z);
    let far_z = select(node.bounds_z.zw, node.bounds_z.xy, ray.negative.z);
    let slots = node.child_slots;
    return intersect_children(slots.x, ray.octant, near_x.x, far_x.x, near_y.x, far_y.x, near_z.x, far_z.x, step, near_start, far_start, t_min, t_max)
        | intersect_children(slots.y, ray.octant, near_x.y, far_x.y, near_y.y, far_y.y, near_z.y, far_z.y, step, near_start, far_start, t_min, t_max);
}
