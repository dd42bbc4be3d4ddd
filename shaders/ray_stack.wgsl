// Pending work of a pixel: a stack in storage, so that each kernel goes on where the last one ended.

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

// Bits of an item's flags, above its kind.
const ITEM_KIND: u32 = 3u;
const ITEM_STRAIGHT: u32 = 4u;
const ITEM_JOINED: u32 = 8u;
const ITEM_DEPTH_SHIFT: u32 = 4u;

// Items that a slot needs beyond those that a tree leaves pending: for the ray to trace, for lights still to be summed up.
const ITEMS_TO_TRACE: u32 = 1u;
const ITEMS_OF_LIGHTS: u32 = 1u;

fn extra_items() -> u32 {
    if (HAS_MANY_LIGHTS) {
        return ITEMS_TO_TRACE + ITEMS_OF_LIGHTS;
    }
    return ITEMS_TO_TRACE;
}

// Of faces in contact, in words.
const CONTACT_WORDS: u32 = 5u;

const_assert WORDS_AT_ONCE >= max(ITEM_WORDS, CONTACT_WORDS);

// Lights that are left have no descendants, but a place.
fn item_depth(item: WorkItem) -> u32 {
    if (HAS_INSTANCES) {
        return select(item.depth, met, item.kind == LIGHTS);
    }
    return item.depth;
}

// The meaning of the shared words differs by kind: the host never looks inside.
fn store_item(slot: u32, level: u32, item: WorkItem) {
    let is_lights = item.kind == LIGHTS;
    let flags = item.kind | select(0u, ITEM_STRAIGHT, item.straight) | select(0u, ITEM_JOINED, item.joined)
        | (item_depth(item) << ITEM_DEPTH_SHIFT);
    // A radiance ray ends nowhere, a shadow ray has no descendants.
    let bound = select(bitcast<u32>(item.t_max), item.allotment, item.kind == RADIANCE);
    var rest = 0u;
    if (HAS_SOLIDS) {
        rest = pack_rest(item.rest);
    }
    let words = Words(
        vec4u(bitcast<vec3u>(item.origin), select(item.after, item.hit.leaf, is_lights)),
        vec4u(bitcast<vec3u>(item.direction), flags),
        vec4u(bitcast<vec3u>(item.throughput), select(bound, item.light, is_lights)),
        vec4u(item.media, select(vec2u(bitcast<u32>(item.t_min), rest), item.through, is_lights)),
        vec4u(0u),
    );
    store_words(item_word(slot, level), words, frame.item_words);
}

fn item_of(words: array<vec4u, ITEM_WORDS>) -> WorkItem {
    let a = words[0];
    let b = words[1];
    let c = words[2];
    let d = words[3];
    var item: WorkItem;
    item.origin = bitcast<vec3f>(a.xyz);
    item.after = a.w;
    item.direction = bitcast<vec3f>(b.xyz);
    item.kind = b.w & ITEM_KIND;
    item.straight = (b.w & ITEM_STRAIGHT) != 0u;
    item.joined = (b.w & ITEM_JOINED) != 0u;
    item.depth = b.w >> ITEM_DEPTH_SHIFT;
    item.throughput = bitcast<vec3f>(c.xyz);
    item.light = c.w;
    item.allotment = c.w;
    item.t_max = select(T_MAX, bitcast<f32>(c.w), item.kind == SHADOW);
    item.media = d.xy;
    item.t_min = bitcast<f32>(d.z);
    item.through = d.zw;
    if (HAS_SOLIDS) {
        if (item.kind != LIGHTS) {
            item.rest = unpack_rest(d.w);
        }
    }
    if (item.kind == LIGHTS) {
        item.hit = Hit(0.0, leaf_triangle(a.w).entry & LEAF_TRIANGLE, a.w, false); // whether seen from behind, surface_at finds again
        if (HAS_INSTANCES) {
            met = item.depth;
            if (met != 0u) {
                item.hit.triangle = met_number(leaf_triangle(a.w).entry);
            }
        }
    }
    return item;
}

fn push(slot: u32, item: WorkItem) {
    store_item(slot, pending, item);
    pending += 1u;
}
