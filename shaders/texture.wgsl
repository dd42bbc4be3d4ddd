// All images lie in one table and are filtered here, so that they are the same on every driver.

// An integer texel coordinate brought into [0, size).
fn wrap_texel(coordinate: i32, size: i32, mode: u32) -> i32 {
    if (mode == WRAP_CLAMP) {
        return clamp(coordinate, 0, size - 1);
    }
    let period = select(size, 2 * size, mode == WRAP_MIRRORED);
    var folded = coordinate % period;
    folded = select(folded, folded + period, folded < 0);
    return select(folded, period - 1 - folded, folded >= size);
}

// A texel, decoded to linear.
fn texel(texture: TextureUse, x: i32, y: i32) -> vec4f {
    let wrapped_x = wrap_texel(x, i32(texture.width), wrap_u(texture));
    let wrapped_y = wrap_texel(y, i32(texture.height), wrap_v(texture));
    let index = texture.offset + u32(wrapped_y) * texture.width + u32(wrapped_x);
    let code = unpack4xU8(textureLoad(texels, table_place(index)).x);
    let plain = vec4f(code) / 255.0;
    if ((texture.flags & TEXTURE_SRGB) == 0u) {
        return plain;
    }
    return vec4f(decode_srgb(code.x), decode_srgb(code.y), decode_srgb(code.z), plain.w);
}

// Bilinear weight of the tap at (tap & 1, tap >> 1).
fn tap_weight(tap: u32, weight: vec2f) -> f32 {
    return select(1.0 - weight.x, weight.x, (tap & 1u) != 0u) * select(1.0 - weight.y, weight.y, tap > 1u);
}

// A coordinate without its whole periods, before it is multiplied by the texture's size: the product would have no digits left for
// their fraction.
fn within_period(x: f32, mode: u32) -> f32 {
    if (!(abs(x) < 1e30)) {
        return 0.0;
    }
    if (mode == WRAP_CLAMP) {
        return clamp(x, -1.0, 2.0);
    }
    let period = select(1.0, 2.0, mode == WRAP_MIRRORED);
    return x - period * floor(x / period);
}

fn wrap_u(texture: TextureUse) -> u32 {
    return texture.flags & 3u;
}

fn wrap_v(texture: TextureUse) -> u32 {
    return (texture.flags >> 2u) & 3u;
}

fn sample_texture(texture: TextureUse, uv: vec2f) -> vec4f {
    let period = vec2f(within_period(uv.x, wrap_u(texture)), within_period(uv.y, wrap_v(texture)));
    let place = period * vec2f(f32(texture.width), f32(texture.height));
    let nearest = (texture.flags & TEXTURE_NEAREST) != 0u;
    let corner = select(place - 0.5, place, nearest);
    let x = i32(floor(corner.x));
    let y = i32(floor(corner.y));
    let weight = select(corner - floor(corner), vec2f(0.0), nearest);
    var sum = vec4f(0.0);
    for (var tap = 0u; tap < select(4u, 1u, nearest); tap++) {
        sum += tap_weight(tap, weight) * texel(texture, x + i32(tap & 1u), y + i32(tap >> 1u));
    }
    return sum;
}
