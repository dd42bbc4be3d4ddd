// Pending work of a pixel: a stack in storage, so that a dispatch can end at any ray and the next one goes on from there.

// A work item is one of three.
const RADIANCE: u32 = 0u; // a ray whose radiance is wanted
const SHADOW: u32 = 1u; // a ray to a light; throughput holds what the light adds if nothing is in the way
const LIGHTS: u32 = 2u; // a surface whose lights from `light` on are still to be summed up

struct WorkItem {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    kind: u32,
    depth: u32, // in the ray tree; camera ray: 0
    straight: bool, // reached from the camera by alpha blending alone
    throughput: vec3f,
    media: vec2u,
    rest: vec3f, // what the direction has lost in rounding; kept of refracted rays alone
    t_min: f32, // hits up to here, and at t_min of triangles up to `after`, are behind the ray
    after: u32, // the triangle that the ray leaves or has passed
    light: u32,
    allotment: u32, // rays that this one and its descendants may be, whatever the rest of the tree takes
    hit: Hit, // of LIGHTS
    joined: bool, // of LIGHTS: its place is that of other faces too
    through: vec2u, // of LIGHTS: the media beyond the surface
}

var<private> pending: u32; // items on this slot's stack

const ITEM_WORDS: u32 = 4u; // vec4u each

// Items that a slot needs beyond those that a tree leaves pending: one for lights still to be summed up, one for the ray that a
// dispatch ends at. Above them, in a program with long rays, lies that ray's traversal.
const EXTRA_ITEMS: u32 = 2u;

// Words of a suspended traversal before its stack, a vec4u for each entry: hit and place, then faces in contact.
const SUSPENDED_HEAD: u32 = 7u;

// Lanes lie side by side, so that a vector of them reads one run of memory.
fn item_address(slot: u32, level: u32, word: u32) -> u32 {
    return (level * ITEM_WORDS + word) * frame.slot_count + slot;
}

// The meaning of the shared words differs by kind: the host never looks inside.
fn store_item(slot: u32, level: u32, item: WorkItem) {
    let is_lights = item.kind == LIGHTS;
    let flags = item.kind | select(0u, 4u, item.straight) | select(0u, 8u, item.joined) | (item.depth << 4u);
    // A radiance ray ends nowhere, a shadow ray has no descendants.
    let bound = select(bitcast<u32>(item.t_max), item.allotment, item.kind == RADIANCE);
    ray_stack[item_address(slot, level, 0u)] = vec4u(bitcast<vec3u>(item.origin), select(bound, item.light, is_lights));
    ray_stack[item_address(slot, level, 1u)] = vec4u(bitcast<vec3u>(item.direction), flags);
    ray_stack[item_address(slot, level, 2u)] = vec4u(bitcast<vec3u>(item.throughput), select(item.after, item.hit.leaf, is_lights));
    var rest = 0u;
    if (HAS_SOLIDS) {
        rest = pack_rest(item.rest);
    }
    ray_stack[item_address(slot, level, 3u)] = vec4u(item.media, select(vec2u(bitcast<u32>(item.t_min), rest), item.through, is_lights));
}

fn load_item(slot: u32, level: u32) -> WorkItem {
    let a = ray_stack[item_address(slot, level, 0u)];
    let b = ray_stack[item_address(slot, level, 1u)];
    let c = ray_stack[item_address(slot, level, 2u)];
    let d = ray_stack[item_address(slot, level, 3u)];
    var item: WorkItem;
    item.origin = bitcast<vec3f>(a.xyz);
    item.light = a.w;
    item.allotment = a.w;
    item.direction = bitcast<vec3f>(b.xyz);
    item.kind = b.w & 3u;
    item.t_max = T_MAX;
    if (item.kind == SHADOW) {
        item.t_max = bitcast<f32>(a.w);
    }
    item.straight = (b.w & 4u) != 0u;
    item.joined = (b.w & 8u) != 0u;
    item.depth = b.w >> 4u;
    item.throughput = bitcast<vec3f>(c.xyz);
    item.after = c.w;
    item.media = d.xy;
    item.t_min = bitcast<f32>(d.z);
    item.through = d.zw;
    if (HAS_SOLIDS) {
        if (item.kind != LIGHTS) {
            item.rest = unpack_rest(d.w);
        }
    }
    if (item.kind == LIGHTS) {
        item.hit = Hit(0.0, leaf_triangle(c.w).entry & LEAF_TRIANGLE, c.w, false); // whether seen from behind, surface_at finds again
    }
    return item;
}

fn push(slot: u32, item: WorkItem) {
    store_item(slot, pending, item);
    pending += 1u;
}

fn pop(slot: u32) -> WorkItem {
    pending -= 1u;
    return load_item(slot, pending);
}
