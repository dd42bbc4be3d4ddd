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
    let at = level.offset + 3u * (row * level.width + column);
    return vec3f(environment[at], environment[at + 1u], environment[at + 2u]);
}

fn environment_level(index: u32, uv: vec2f) -> vec3f {
    let level = frame.environment[index];
    let corner = uv * vec2f(f32(level.width), f32(level.height)) - 0.5;
    let weight = corner - floor(corner);
    let x = i32(floor(corner.x));
    let y = i32(floor(corner.y));
    let upper = mix(environment_texel(level, x, y), environment_texel(level, x + 1, y), weight.x);
    let lower = mix(environment_texel(level, x, y + 1), environment_texel(level, x + 1, y + 1), weight.x);
    return mix(upper, lower, weight.y);
}

// Which levels a roughness lies between: index of the lower one, and how far above it.
fn rough_level(roughness: f32) -> vec2f {
    let lower = min(floor(roughness * ROUGH_LEVELS), ROUGH_LEVELS - 1.0);
    return vec2f(lower, roughness * ROUGH_LEVELS - lower);
}

// What a lobe of this roughness gathers around a direction: G in README.md.
fn gathered_radiance(direction: vec3f, roughness: f32) -> vec3f {
    var gathered = frame.ambient;
    if (HAS_ENVIRONMENT) {
        let uv = environment_uv(direction);
        let between = rough_level(roughness);
        let lower = u32(between.x);
        gathered += mix(environment_level(lower, uv), environment_level(lower + 1u, uv), between.y);
    }
    return gathered;
}

// What a white diffuse surface reflects: E in README.md.
fn gathered_irradiance(normal: vec3f) -> vec3f {
    var gathered = frame.ambient;
    if (HAS_ENVIRONMENT) {
        gathered += environment_level(IRRADIANCE_LEVEL, environment_uv(normal));
    }
    return gathered;
}

// What a ray sees that hits nothing. `straight`: a camera ray, bent by nothing.
fn missed_radiance(direction: vec3f, straight: bool) -> vec3f {
    let plain = select(frame.background, vec3f(0.0), frame.background_kind != BACKGROUND_COLOR);
    if (HAS_ENVIRONMENT) {
        if (!straight || frame.background_kind == BACKGROUND_ENVIRONMENT) {
            return environment_level(0u, environment_uv(direction));
        }
    }
    return plain;
}
