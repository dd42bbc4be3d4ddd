// The solids that a ray is in: a stack of up to 8 media (index into `media` plus 1, a byte each, the innermost lowest).

const MEDIA_DEPTH: u32 = 8u;

fn innermost_medium(stack: vec2u) -> u32 {
    return stack.x & 0xffu;
}

fn media_full(stack: vec2u) -> bool {
    return (stack.y >> 24u) != 0u;
}

fn enter_medium(stack: vec2u, medium: u32) -> vec2u {
    return vec2u((stack.x << 8u) | medium, (stack.y << 8u) | (stack.x >> 24u));
}

fn medium_at(stack: vec2u, k: u32) -> u32 {
    return (select(stack.x, stack.y, k >= 4u) >> (8u * (k % 4u))) & 0xffu;
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
            left = enter_medium(left, entry);
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
