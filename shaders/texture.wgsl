// Textures live in a storage buffer and are filtered here, so that they are the same on every driver.

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

// A texel, decoded to linear. The table of the 256 sRGB codes opens the buffer (IEC 61966-2-1).
fn texel(texture: TextureUse, x: i32, y: i32) -> vec4f {
    let wrapped_x = wrap_texel(x, i32(texture.width), texture.flags & 3u);
    let wrapped_y = wrap_texel(y, i32(texture.height), (texture.flags >> 2u) & 3u);
    let code = unpack4xU8(texels[texture.offset + u32(wrapped_y) * texture.width + u32(wrapped_x)]);
    let plain = vec4f(code) / 255.0;
    if ((texture.flags & TEXTURE_SRGB) == 0u) {
        return plain;
    }
    return vec4f(bitcast<f32>(texels[code.x]), bitcast<f32>(texels[code.y]), bitcast<f32>(texels[code.z]), plain.w);
}

// Bilinear weight of the tap at (tap & 1, tap >> 1).
fn tap_weight(tap: u32, weight: vec2f) -> f32 {
    return select(1.0 - weight.x, weight.x, (tap & 1u) != 0u) * select(1.0 - weight.y, weight.y, tap > 1u);
}

// Coordinates that no image needs are kept from overflowing an i32.
fn texel_coordinate(x: f32) -> i32 {
    return i32(clamp(floor(x), -1e9, 1e9));
}

fn sample_texture(texture: TextureUse, uv: vec2f) -> vec4f {
    let place = uv * vec2f(f32(texture.width), f32(texture.height));
    let nearest = (texture.flags & TEXTURE_NEAREST) != 0u;
    let corner = select(place - 0.5, place, nearest);
    let x = texel_coordinate(corner.x);
    let y = texel_coordinate(corner.y);
    let weight = select(corner - floor(corner), vec2f(0.0), nearest);
    var sum = vec4f(0.0);
    for (var tap = 0u; tap < select(4u, 1u, nearest); tap++) {
        sum += tap_weight(tap, weight) * texel(texture, x + i32(tap & 1u), y + i32(tap >> 1u));
    }
    return sum;
}
