// Error control: a slot takes one sample, its pixel's first or what an order names, and leaves out what can't matter (Hall and Greenberg 1983, adaptive tree
// depth). README.md, "Tolerance".

// What the sample may have lost so far, root mean square over the channels: by what was left out, and by branches that ended for another reason.
var<private> lost: f32;

// What could bring no more than this is left out.
var<private> negligible: f32;
var<private> negligible_code: u32;

// A sample to be taken. An order of the host lies in RADIANCE_WORD until its sample has begun; without any, slots take the first
// samples of a batch's pixels.
struct Order {
    pixel: vec2u, // in the window
    offset: vec2f, // of the sample from the pixel's middle, pixels
    negligible: u32, // code
}

fn has_orders() -> bool {
    return frame.order_count > 0u;
}

fn order_of(slot: u32, word: vec4u) -> Order {
    // Chosen, not branched on: see loop_end of state.wgsl.
    let ordered = has_orders();
    let pixel = vec2u(word.x % frame.window_size.x, word.x / frame.window_size.x);
    return Order(
        select(pixel_of_slot(slot), pixel, ordered),
        select(vec2f(0.0), bitcast<vec2f>(word.yz), ordered),
        select(frame.negligible, word.w, ordered),
    );
}

// Codes of 8 bits in steps of half an octave, from 2^-96 to 2^31.
fn negligible_of_code(code: u32) -> f32 {
    return exp2(0.5 * f32(code) - 96.0);
}

// Leaves out what could bring no more than `brought`, if that is negligible: at most `share` of what is.
fn leave_out(brought: f32, share: f32) -> bool {
    let is_left_out = brought <= share * negligible;
    if (is_left_out) {
        lost += brought;
        count(ENDED_TOLERANCE);
    }
    return is_left_out;
}

// Root mean square over the channels: as pictures are judged. Scaled first, so that nothing leaves f32's range.
fn over_channels(color: vec3f) -> f32 {
    let largest = max(max_component(color), 1e-30);
    return largest * length(color / largest) * inverseSqrt(3.0);
}

// What a ray of this throughput could bring.
fn most_brought(throughput: vec3f) -> f32 {
    return over_channels(throughput * frame.branch_bound);
}

// A sample's Slot but for its radiance: there is room for more beside counts.
const STORAGE_SHIFT: u32 = 20u; // above common_rays
const COMMON_RAYS: u32 = 0xfffffu;
const STORAGE_MOST: u32 = 0xfffu;
const CODE_SHIFT: u32 = 24u; // above branches dropped for want of rays
const BUDGET_MOST: u32 = 0xffffffu;

fn packed_counts() -> vec4u {
    let ended = min(dropped, vec2u(STORAGE_MOST, BUDGET_MOST));
    return vec4u(rays, common_rays | (ended.x << STORAGE_SHIFT), ended.y | (negligible_code << CODE_SHIFT), bitcast<u32>(lost));
}

fn take_counts(counts: vec4u) {
    rays = counts.x;
    common_rays = counts.y & COMMON_RAYS;
    dropped = vec2u(counts.y >> STORAGE_SHIFT, counts.z & BUDGET_MOST);
    lost = bitcast<f32>(counts.w);
    take_code(counts.z >> CODE_SHIFT);
}

fn take_code(code: u32) {
    negligible_code = code;
    negligible = negligible_of_code(code);
}
