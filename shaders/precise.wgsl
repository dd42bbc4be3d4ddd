// Twice the digits, where f32 has too few: a number as the sum of two, the second what the first has lost (Dekker 1971;
// Shewchuk 1997). Compilers take a + b - a for b. What they must not see through passes an XOR with a zero that they don't know,
// which also keeps products from being fused into sums.

struct Pair3 {
    high: vec3f,
    low: vec3f,
}

struct Pair4 {
    high: vec4f,
    low: vec4f,
}

fn kept3(x: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(x) ^ vec3u(frame.zero));
}

fn kept4(x: vec4f) -> vec4f {
    return bitcast<vec4f>(bitcast<vec4u>(x) ^ vec4u(frame.zero));
}

// The upper 12 of the 24 bits: a product of two such is exact, and so is what is left.
fn upper_half(x: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(x) & vec3u(0xfffff000u));
}

fn precise_product(a: vec3f, b: vec3f) -> Pair3 {
    let product = kept3(a * b);
    let a_high = upper_half(a);
    let b_high = upper_half(b);
    let a_low = a - a_high;
    let b_low = b - b_high;
    let rest = kept3(kept3(a_high * b_high) - product) + kept3(a_high * b_low);
    return Pair3(product, (rest + kept3(a_low * b_high)) + a_low * b_low);
}

// Knuth 1969.
fn precise_sum(a: vec4f, b: vec4f) -> Pair4 {
    let sum = kept4(a + b);
    let b_taken = kept4(sum - a);
    let a_taken = kept4(sum - b_taken);
    return Pair4(sum, (a - a_taken) + (b - b_taken));
}

// `b_low`: what b has lost.
fn precise_cross(a: vec3f, b: vec3f, b_low: vec3f) -> Pair3 {
    let plus = precise_product(a.yzx, b.zxy);
    let minus = precise_product(a.zxy, b.yzx);
    let difference = precise_sum(vec4f(plus.high, 0.0), vec4f(-minus.high, 0.0));
    let rest = difference.low.xyz + ((plus.low - minus.low) + cross(a, b_low));
    let high = kept3(difference.high.xyz + rest);
    return Pair3(high, rest - (high - difference.high.xyz));
}

// What is known of the angle between two vectors of about unit length.
struct Angle {
    cosine: f32, // to one rounding of itself, not of 1
    across: Pair3, // a x b
    sine_squared: vec2f, // as a pair
}

// Four sums of three products each at once: |a x b|^2, |a|^2, |b|^2, a.b. The cosine alone would not do: near the critical
// angle one rounding of it turns the refracted ray by 3e-4 rad.
fn precise_angle(a: vec3f, b: vec3f, b_low: vec3f) -> Angle {
    let across = precise_cross(a, b, b_low);
    let s = precise_product(across.high, across.high);
    let s_low = s.low + 2.0 * across.high * across.low;
    let aa = precise_product(a, a);
    let bb = precise_product(b, b);
    let ab = precise_product(a, b);
    let first = precise_sum(vec4f(s.high.x, aa.high.x, bb.high.x, ab.high.x), vec4f(s.high.y, aa.high.y, bb.high.y, ab.high.y));
    let sums = precise_sum(first.high, vec4f(s.high.z, aa.high.z, bb.high.z, ab.high.z));
    let lows = (first.low + sums.low) + (vec4f(s_low.x, aa.low.x, bb.low.x, ab.low.x)
        + (vec4f(s_low.y, aa.low.y, bb.low.y, ab.low.y) + vec4f(s_low.z, aa.low.z, bb.low.z, ab.low.z))
        + vec4f(0.0, 0.0, 2.0 * dot(b, b_low), dot(a, b_low)));
    // By how much the squared lengths' product is above 1. Some 1e-7: its square counts for nothing.
    let excess = ((sums.high.y - 1.0) + lows.y) + ((sums.high.z - 1.0) + lows.z);
    var angle: Angle;
    angle.across = across;
    angle.cosine = (sums.high.w + lows.w) * (1.0 - 0.5 * excess);
    angle.sine_squared = vec2f(sums.high.x, lows.x - sums.high.x * excess);
    return angle;
}

// (a/b)^2 x; x is a pair.
fn ratio_squared_times(a: f32, b: f32, x: vec2f) -> vec2f {
    let ratio = kept3(vec3f(a / b)).x;
    let products = precise_product(vec3f(ratio), vec3f(b, ratio, 0.0));
    let ratio_rest = ((a - products.high.x) - products.low.x) / b;
    let squared_rest = products.low.y + 2.0 * ratio * ratio_rest;
    let share = precise_product(vec3f(products.high.y), vec3f(x.x, 0.0, 0.0));
    return vec2f(share.high.x, share.low.x + products.high.y * x.y + squared_rest * x.x);
}

// What a direction has lost, if it lies in the plane across `normal_to` and makes an angle of this sine and cosine with -n.
fn direction_rest(n: vec3f, direction: vec3f, normal_to: Pair3, sine_squared: vec2f, cosine: f32) -> vec3f {
    let found = precise_angle(n, direction, vec3f(0.0)).sine_squared;
    let off = (sine_squared.x - found.x) + (sine_squared.y - found.y);
    let slope = 2.0 * sine_squared.x * cosine;
    let length_squared = dot(normal_to.high, normal_to.high);
    if (!(slope > 1e-10) || !(length_squared > 1e-20)) {
        return vec3f(0.0);
    }
    let beside = precise_product(direction, normal_to.high);
    let first = precise_sum(vec4f(beside.high.x, 0.0, 0.0, 0.0), vec4f(beside.high.y, 0.0, 0.0, 0.0));
    let sum = precise_sum(first.high, vec4f(beside.high.z, 0.0, 0.0, 0.0));
    let lows = (first.low.x + sum.low.x) + (beside.low.x + beside.low.y + beside.low.z) + dot(direction, normal_to.low);
    return (off / slope) * (cosine * direction + n) - ((sum.high.x + lows) / length_squared) * normal_to.high;
}

// Three such in a word: 10 bits each, of 2^-34. A component of a unit vector loses at most 2^-25.
const REST_SCALE: f32 = 17179869184.0;

fn pack_rest(rest: vec3f) -> u32 {
    let steps = bitcast<vec3u>(vec3i(clamp(round(rest * REST_SCALE), vec3f(-512.0), vec3f(511.0)))) & vec3u(0x3ffu);
    return steps.x | (steps.y << 10u) | (steps.z << 20u);
}

fn unpack_rest(word: u32) -> vec3f {
    let steps = bitcast<vec3i>(vec3u(word << 22u, word << 12u, word << 2u)) >> vec3u(22u);
    return vec3f(steps) / REST_SCALE;
}
