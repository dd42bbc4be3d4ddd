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

fn precise_cross(a: vec3f, b: vec3f) -> Pair3 {
    let plus = precise_product(a.yzx, b.zxy);
    let minus = precise_product(a.zxy, b.yzx);
    let difference = precise_sum(vec4f(plus.high, 0.0), vec4f(-minus.high, 0.0));
    let rest = difference.low.xyz + (plus.low - minus.low);
    let high = kept3(difference.high.xyz + rest);
    return Pair3(high, rest - (high - difference.high.xyz));
}

// What is known of the angle between two vectors of about unit length.
struct Angle {
    cosine: f32, // to one rounding of itself, not of 1
    across: vec3f, // a x b, each component to one rounding
    sine_squared: vec2f, // as a pair
}

// Four sums of three products each at once: |a x b|^2, |a|^2, |b|^2, a.b. The cosine alone would not do: near the critical
// angle one rounding of it turns the refracted ray by 3e-4 rad.
fn precise_angle(a: vec3f, b: vec3f) -> Angle {
    let across = precise_cross(a, b);
    let s = precise_product(across.high, across.high);
    let s_low = s.low + 2.0 * across.high * across.low;
    let aa = precise_product(a, a);
    let bb = precise_product(b, b);
    let ab = precise_product(a, b);
    let first = precise_sum(vec4f(s.high.x, aa.high.x, bb.high.x, ab.high.x), vec4f(s.high.y, aa.high.y, bb.high.y, ab.high.y));
    let sums = precise_sum(first.high, vec4f(s.high.z, aa.high.z, bb.high.z, ab.high.z));
    let lows = (first.low + sums.low) + (vec4f(s_low.x, aa.low.x, bb.low.x, ab.low.x)
        + (vec4f(s_low.y, aa.low.y, bb.low.y, ab.low.y) + vec4f(s_low.z, aa.low.z, bb.low.z, ab.low.z)));
    // By how much the squared lengths' product is above 1. Some 1e-7: its square counts for nothing.
    let excess = ((sums.high.y - 1.0) + lows.y) + ((sums.high.z - 1.0) + lows.z);
    var angle: Angle;
    angle.across = across.high;
    angle.cosine = (sums.high.w + lows.w) * (1.0 - 0.5 * excess);
    angle.sine_squared = vec2f(sums.high.x, lows.x - sums.high.x * excess);
    return angle;
}

// 1 - (a/b)^2 x, to about 1e-13 where it is small; x is a pair.
fn one_minus_ratio_squared(a: f32, b: f32, x: vec2f) -> f32 {
    let ratio = kept3(vec3f(a / b)).x;
    let products = precise_product(vec3f(ratio), vec3f(b, ratio, 0.0));
    let ratio_rest = ((a - products.high.x) - products.low.x) / b;
    let squared_rest = products.low.y + 2.0 * ratio * ratio_rest;
    let share = precise_product(vec3f(products.high.y), vec3f(x.x, 0.0, 0.0));
    return (1.0 - share.high.x) - (share.low.x + products.high.y * x.y + squared_rest * x.x);
}
