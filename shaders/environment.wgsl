// Light from all around: README.md, "Environment look-up". Level 0 is the map itself, 1-4 are prefiltered for roughness
// 1/4, 2/4, 3/4, 1, and 5 is the irradiance over pi.

const ROUGH_LEVELS: f32 = 4.0;
const IRRADIANCE_LEVEL: u32 = 5u;

// Where a direction lies in the map, both coordinates in [0, 1].
fn environment_uv(direction: vec3f) -> vec2f {
    let x = frame.rotation_cos * direction.x - frame.rotation_sin * direction.z;
    let z = frame.rotation_sin * direction.x + frame.rotation_cos * direction.z;
    let u = 0.5 - arc_tangent(x, z) / (2.0 * PI);
    let v = arc_tangent(length(vec2f(x, z)), direction.y) / PI;
    return vec2f(u, v);
}

fn environment_texel(level: EnvironmentLevel, x: i32, y: i32) -> vec3f {
    let column = u32(wrap_texel(x, i32(level.width), WRAP_REPEAT));
    let row = u32(wrap_texel(y, i32(level.height), WRAP_CLAMP));
    return environment_color(level.offset + row * level.width + column);
}

// Bilinear.
fn environment_level(index: u32, direction: vec3f) -> vec3f {
    let level = frame.environment[index];
    let corner = environment_uv(direction) * vec2f(f32(level.width), f32(level.height)) - 0.5;
    let weight = corner - floor(corner);
    let x = i32(floor(corner.x));
    let y = i32(floor(corner.y));
    var sum = vec3f(0.0);
    for (var tap = 0u; tap < 4u; tap++) {
        sum += tap_weight(tap, weight) * environment_texel(level, x + i32(tap & 1u), y + i32(tap >> 1u));
    }
    return sum;
}

// Which levels a roughness lies between: index of the lower one, and how far above it.
fn rough_level(roughness: f32) -> vec2f {
    let lower = min(floor(roughness * ROUGH_LEVELS), ROUGH_LEVELS - 1.0);
    return vec2f(lower, roughness * ROUGH_LEVELS - lower);
}

// Light from all around as a surface gathers it.
struct Gathered {
    irradiance: vec3f, // what a white diffuse surface reflects: E in README.md
    reflected: vec3f, // what a lobe around the reflected direction gathers: G in README.md
    transmitted: vec3f, // .. around the refracted one
}

// The look-ups that a surface needs: lobes of weight 0 are not looked up. One loop with one call: lavapipe inlines each.
fn gather(normal: vec3f, reflected: vec3f, transmitted: vec3f, roughness: f32, has_lobe: bool, has_transmitted: bool) -> Gathered {
    var gathered = Gathered(frame.ambient, frame.ambient, frame.ambient);
    if (HAS_ENVIRONMENT) {
        let between = rough_level(roughness);
        let lower = u32(between.x);
        let look_ups = select(1u, select(3u, 5u, has_transmitted), has_lobe);
        for (var k = 0u; k < look_ups; k++) {
            let upper_level = (k & 1u) == 0u;
            let level = select(select(lower, lower + 1u, upper_level), IRRADIANCE_LEVEL, k == 0u);
            let found = environment_level(level, select(select(transmitted, reflected, k < 3u), normal, k == 0u));
            let part = select(1.0 - between.y, between.y, upper_level) * found;
            gathered.irradiance += select(vec3f(0.0), found, k == 0u);
            gathered.reflected += select(vec3f(0.0), part, k == 1u || k == 2u);
            gathered.transmitted += select(vec3f(0.0), part, k > 2u);
        }
    }
    return gathered;
}

// What a ray sees that hits nothing. `straight`: a camera ray, bent by nothing.
fn missed_radiance(direction: vec3f, straight: bool) -> vec3f {
    let plain = select(frame.background, vec3f(0.0), frame.background_kind != BACKGROUND_COLOR);
    if (HAS_ENVIRONMENT) {
        if (!straight || frame.background_kind == BACKGROUND_ENVIRONMENT) {
            return environment_level(0u, direction);
        }
    }
    return plain;
}
