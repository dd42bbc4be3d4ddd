// Reflection and refraction at an interface: README.md, "Fresnel and Snell".

struct Interface {
    eta_i: f32,
    eta_t: f32,
    r0: f32, // reflectance at normal incidence
    f0: vec3f, // .. with KHR_materials_specular
    f90: f32,
    cos_i: f32, // dot(ns, wo)
    across: Pair3, // ns x wo; only for solids
    sin_t: vec2f, // sin^2 of the refracted ray, a pair; only for solids
    cos_t: f32, // of the refracted ray; 0 in total internal reflection
    total: bool, // total internal reflection
    fresnel: vec3f, // F(cos_i)
}

// Indices so near to each other are the same: an object of index 1 in vacuum can't be seen.
const SAME_INDEX: f32 = 1e-7;

fn same_index(a: f32, b: f32) -> bool {
    return abs(a - b) <= SAME_INDEX * max(a, b);
}

// cos of the refracted angle, squared; zero or less: total internal reflection. (1 - c)(1 + c) keeps the digits that c has,
// where 1 - c*c has none left. Rays that refract need more: interface_at.
fn refracted_cos_squared(eta_i: f32, eta_t: f32, cos_i: f32) -> f32 {
    let ratio = eta_i / eta_t;
    return 1.0 - ratio * ratio * (1.0 - cos_i) * (1.0 + cos_i);
}

// Unpolarised Fresnel reflectance of a dielectric, exact. `squared`: cos^2 of the refracted angle.
fn dielectric_reflectance(eta_i: f32, eta_t: f32, cos_i: f32, squared: f32) -> f32 {
    if (same_index(eta_i, eta_t)) {
        return 0.0;
    }
    if (eta_t >= IOR_INFINITE) {
        return 1.0;
    }
    if (squared <= 0.0) {
        return 1.0;
    }
    let cos_t = sqrt(squared);
    let rs = (eta_i * cos_i - eta_t * cos_t) / (eta_i * cos_i + eta_t * cos_t);
    let rp = (eta_t * cos_i - eta_i * cos_t) / (eta_t * cos_i + eta_i * cos_t);
    return 0.5 * (rs * rs + rp * rp);
}

fn normal_reflectance(eta_i: f32, eta_t: f32) -> f32 {
    if (same_index(eta_i, eta_t)) {
        return 0.0;
    }
    if (eta_t >= IOR_INFINITE) {
        return 1.0;
    }
    let ratio = (eta_i - eta_t) / (eta_i + eta_t);
    return ratio * ratio;
}

// F(c): the exact curve, stretched to start at F0 and end at F90.
fn fresnel(interface_: Interface, cos_i: f32, cos_t_squared: f32) -> vec3f {
    let exact = dielectric_reflectance(interface_.eta_i, interface_.eta_t, cos_i, cos_t_squared);
    if (interface_.r0 >= 1.0) {
        return interface_.f0;
    }
    if (exact >= 1.0) {
        return vec3f(1.0);
    }
    let rise = (exact - interface_.r0) / (1.0 - interface_.r0);
    // The exact curve of a high index dips below its start, which a specular colour of 0 must not make negative.
    return max(interface_.f0 + (vec3f(interface_.f90) - interface_.f0) * rise, vec3f(0.0));
}

// `wo_rest`: what wo has lost in rounding (WorkItem.rest). `bends`: the surface is a solid's, and refracts.
fn interface_at(surface: Surface, wo_rest: vec3f, eta_i: f32, eta_t: f32, bends: bool) -> Interface {
    var made: Interface;
    made.eta_i = eta_i;
    made.eta_t = eta_t;
    made.r0 = normal_reflectance(eta_i, eta_t);
    made.f0 = min(made.r0 * surface.specular_color, vec3f(1.0)) * surface.specular;
    made.f90 = surface.specular;
    made.cos_i = clamp(dot(surface.ns, surface.wo), 0.0, 1.0);
    var squared = refracted_cos_squared(eta_i, eta_t, made.cos_i);
    if (HAS_SOLIDS) {
        // What bends no ray gets by with f32, so that programs with and without solids show it alike.
        if (bends) {
            // From the sine, to twice the digits of f32: close to the critical angle all of them show in the refracted ray.
            let angle = precise_angle(surface.ns, surface.wo, wo_rest);
            made.cos_i = clamp(angle.cosine, 0.0, 1.0);
            made.across = angle.across;
            made.sin_t = ratio_squared_times(eta_i, eta_t, angle.sine_squared);
            squared = (1.0 - made.sin_t.x) - made.sin_t.y;
        }
    }
    made.total = squared <= 0.0 && !same_index(eta_i, eta_t);
    made.cos_t = sqrt(max(squared, 0.0));
    made.fresnel = fresnel(made, made.cos_i, squared);
    return made;
}

// The least height over the facet of a direction that leaves it, unit length: the roundings of making the direction (8), of this
// height (5) and of the normal and the length (3). What f32 calls a height of 0 or 1e-8 may point to the other side.
fn least_height() -> f32 {
    return gamma(16.0);
}

// Interpolated normals can send a ray to the wrong side of the surface: there it is mirrored back at the facet, and where it
// runs along the facet it is lifted off.
fn reflected_direction(surface: Surface, cos_i: f32) -> vec3f {
    let mirrored = 2.0 * cos_i * surface.ns - surface.wo;
    let height = dot(mirrored, surface.ng);
    let lift = max(max(-2.0 * height, least_height() - height), 0.0);
    return normalize(mirrored + lift * surface.ng);
}

// The part along the surface as ns x (ns x wo): wo - cos_i ns would leave few digits of it near normal incidence, which a
// high index then magnifies.
fn refracted_direction(surface: Surface, made: Interface) -> vec3f {
    if (same_index(made.eta_i, made.eta_t)) {
        return -surface.wo; // to the last bit: what has the index of its surroundings can't be seen
    }
    let bent = (made.eta_i / made.eta_t) * cross(surface.ns, made.across.high) - made.cos_t * surface.ns;
    let height = dot(bent, surface.ng);
    let drop = max(max(2.0 * height, least_height() + height), 0.0);
    return normalize(bent - drop * surface.ng);
}

struct Refracted {
    direction: vec3f,
    rest: vec3f, // what the direction has lost in rounding
}

// From inside of a solid of index 1000 one rounding of the direction comes out as 6e-5 rad, and close to grazing any is magnified:
// so the direction is rounded once, and what it loses goes with the ray.
fn refracted(surface: Surface, made: Interface, wo_rest: vec3f) -> Refracted {
    let direction = refracted_direction(surface, made);
    if (same_index(made.eta_i, made.eta_t)) {
        return Refracted(direction, -wo_rest);
    }
    let off = direction_rest(surface.ns, direction, made.across, made.sin_t, made.cos_t);
    // A ray that was mirrored at the facet, or lifted off it, is another one.
    if (dot(direction, surface.ng) >= -2.0 * least_height() || max_component(abs(off)) > 1e-6) {
        return Refracted(direction, vec3f(0.0));
    }
    let rounded = kept3(direction + off);
    return Refracted(rounded, off - (rounded - direction));
}
