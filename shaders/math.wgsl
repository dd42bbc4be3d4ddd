// Small numerics. Nothing here, or anywhere in these files, relies on infinity or NaN.

const PI: f32 = 3.14159265358979;
const T_MAX: f32 = 1e30;
// No radiance or irradiance is above, no throughput above: so no product of the two leaves the range of f32. README.md, "Range".
const LARGEST_RADIANCE: f32 = 1e30;
const LARGEST_THROUGHPUT: f32 = 1e8;
const LARGEST_SUM: f32 = 3e38;
const MACHINE_EPSILON: f32 = 5.9604645e-8; // half an ulp of 1: the bound of one rounding

// Bound of the relative error of n roundings in a row (Higham 2002, lemma 3.1; pbrt 4ed, 6.8.1).
fn gamma(n: f32) -> f32 {
    return n * MACHINE_EPSILON / (1.0 - n * MACHINE_EPSILON);
}

// min and max by a comparison and a choice, as processors have them: of two operands one of which is NaN drivers take care to
// return the other, which is three instructions instead of one. For the innermost loops.
fn lesser(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a < b);
}

fn greater(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a > b);
}

fn max_component(c: vec3f) -> f32 {
    return max(c.x, max(c.y, c.z));
}

// 1/x, kept finite: slab tests multiply it with distances of the order of 1.
fn safe_reciprocal(x: vec3f) -> vec3f {
    let least = vec3f(1e-20);
    let sign = select(vec3f(-1.0), vec3f(1.0), x >= vec3f(0.0));
    return sign / max(abs(x), least);
}

// atan2 to about 2 ulp (Cephes atanf). The builtin's precision differs between drivers.
fn arc_tangent(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let larger = max(ax, ay);
    if (larger == 0.0) {
        return 0.0;
    }
    var q = min(ax, ay) / larger;
    var base = 0.0;
    if (q > 0.41421356) { // tan(pi/8)
        base = 0.78539816;
        q = (q - 1.0) / (q + 1.0);
    }
    let z = q * q;
    var angle = base + (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * q + q;
    angle = select(angle, 1.57079633 - angle, ay > ax);
    angle = select(angle, PI - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

// ln(1 - s) to a few roundings of itself: what a large exponent multiplies. (The builtin has an absolute error of some 1e-7.) By
// 2 artanh(s / (s - 2)), a series that has converged for s up to a half.
fn log_one_minus(s: f32) -> f32 {
    if (s > 0.5) {
        return log(max(1.0 - s, 1e-38));
    }
    let z = s / (s - 2.0);
    let z2 = z * z;
    let tail = ((((0.066666667 * z2 + 0.076923077) * z2 + 0.090909091) * z2 + 0.11111111) * z2 + 0.14285714) * z2 + 0.2;
    return 2.0 * z * (1.0 + z2 * (0.33333333 + z2 * tail));
}
