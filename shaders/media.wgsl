// The solids that a ray is in: a stack of up to 8 media (index into `media` plus 1, a byte each, the one that counts lowest),
// sorted by priority, among equals the one entered last on top (Schmidt and Budge 2002): README.md, "Media".

const MEDIA_DEPTH: u32 = 8u;

fn innermost_medium(stack: vec2u) -> u32 {
    return stack.x & 0xffu;
}

fn media_full(stack: vec2u) -> bool {
    return (stack.y >> 24u) != 0u;
}

fn push_medium(stack: vec2u, medium: u32) -> vec2u {
    return vec2u((stack.x << 8u) | medium, (stack.y << 8u) | (stack.x >> 24u));
}

fn medium_at(stack: vec2u, k: u32) -> u32 {
    return (select(stack.x, stack.y, k >= 4u) >> (8u * (k % 4u))) & 0xffu;
}

// With `medium` under the topmost `above` entries.
fn insert_medium(stack: vec2u, medium: u32, above: u32) -> vec2u {
    var made = vec2u(0u);
    for (var k = MEDIA_DEPTH; k > 0u; k--) {
        let entry = medium_at(stack, k - 1u);
        if (entry != 0u) {
            made = push_medium(made, entry);
        }
        if (k - 1u == above) {
            made = push_medium(made, medium);
        }
    }
    return made;
}

fn enter_medium(stack: vec2u, medium: u32) -> vec2u {
    if (HAS_PRIORITIES) {
        var above = 0u;
        for (var k = 0u; k < MEDIA_DEPTH; k++) {
            let entry = medium_at(stack, k);
            if (entry != 0u) {
                above += select(0u, 1u, media[entry - 1u].priority > media[medium - 1u].priority);
            }
        }
        return insert_medium(stack, medium, above);
    }
    return push_medium(stack, medium);
}

// Without its innermost entry of `medium`; as it is where there is none.
fn leave_medium(stack: vec2u, medium: u32) -> vec2u {
    var left = vec2u(0u);
    var which = MEDIA_DEPTH;
    for (var k = 0u; k < MEDIA_DEPTH; k++) {
        if (which == MEDIA_DEPTH && medium_at(stack, k) == medium) {
            which = k;
        }
    }
    for (var k = MEDIA_DEPTH; k > 0u; k--) {
        let entry = medium_at(stack, k - 1u);
        if (k - 1u != which && entry != 0u) {
            left = push_medium(left, entry);
        }
    }
    return left;
}

fn medium_ior(stack: vec2u) -> f32 {
    let innermost = innermost_medium(stack);
    if (innermost == 0u) {
        return 1.0;
    }
    return media[innermost - 1u].ior;
}

// What remains of radiance after a distance (Beer-Lambert).
fn medium_transmittance(stack: vec2u, distance: f32) -> vec3f {
    let innermost = innermost_medium(stack);
    if (innermost == 0u) {
        return vec3f(1.0);
    }
    return exp(-media[innermost - 1u].absorption * distance);
}

// What a surface does to the media of a ray that goes through it.
struct Crossing {
    through: vec2u, // beyond it
    full: bool, // .. for which there is no room
    hidden: bool, // the same medium counts on both sides: for light the surface is not there
}

// `crossed`: something was entered, or left that the ray was in.
fn crossing_between(before: vec2u, through: vec2u, crossed: bool, full: bool) -> Crossing {
    let alike = innermost_medium(through) == innermost_medium(before);
    return Crossing(through, full, crossed && alike && !full);
}

// Crosses one face of a solid; `medium` 0: of none.
fn cross_face(stack: vec2u, medium: u32, back: bool) -> Crossing {
    if (medium == 0u) {
        return Crossing(stack, false, false);
    }
    if (back) {
        let outside = leave_medium(stack, medium);
        return crossing_between(stack, outside, any(outside != stack), false);
    }
    return crossing_between(stack, enter_medium(stack, medium), true, media_full(stack));
}
