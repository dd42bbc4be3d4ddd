// The renderer's single functions, each with an entry point of its own, for tests that know their answers in f64
// (crates/gpu/piece.rs). A program holds one of them, so it compiles in no time.

const PIECE_ARGUMENTS: u32 = 24u; // words a call
const PIECE_RESULTS: u32 = 16u;

var<private> call: u32;

// False for lanes beyond the last call.
fn take_call(invocation: vec3u) -> bool {
    call = invocation.x;
    return call < frame.slot_count;
}

fn argument(k: u32) -> u32 {
    return piece_arguments[call * PIECE_ARGUMENTS + k];
}

fn number(k: u32) -> f32 {
    return bitcast<f32>(argument(k));
}

fn vector(k: u32) -> vec3f {
    return vec3f(number(k), number(k + 1u), number(k + 2u));
}

fn answer(k: u32, value: u32) {
    piece_results[call * PIECE_RESULTS + k] = value;
}

fn answer_number(k: u32, value: f32) {
    answer(k, bitcast<u32>(value));
}

fn answer_vector(k: u32, value: vec3f) {
    answer_number(k, value.x);
    answer_number(k + 1u, value.y);
    answer_number(k + 2u, value.z);
}

// Ray, corners and unit normal -> t, back, valid, barycentrics.
@compute @workgroup_size(64)
fn piece_triangle(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let direction = vector(3u);
    let corners = Vertices(vector(6u), vector(9u), vector(12u), vector(15u));
    let found = intersect_triangle(vector(0u), direction, view_along(direction), corners);
    let uv = barycentrics(vector(0u), direction, vector(6u), vector(9u), vector(12u));
    answer_number(0u, distance_to(found));
    answer(1u, u32(found.slope > 0.0));
    answer(2u, u32(found.valid));
    answer_number(3u, uv.x);
    answer_number(4u, uv.y);
}

// Ray, t_max and a node of the scene's hierarchy -> the bits of its children.
@compute @workgroup_size(64)
fn piece_boxes(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let ray = box_ray(vector(0u), vector(3u));
    answer(0u, intersect_node(ray, load_node(argument(7u)), 0.0, number(6u)));
    answer(1u, ray.octant & 0xffu);
}

// Ray and a triangle of the scene in leaf order, whether it is seen from behind, and a direction to leave in -> hit point,
// origin of the ray that leaves, its geometric normal.
@compute @workgroup_size(64)
fn piece_leaving(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let leaf = argument(6u);
    let hit = Hit(0.0, leaf_triangle(leaf).entry & LEAF_TRIANGLE, leaf, argument(7u) != 0u);
    let surface = surface_at(hit, vector(0u), vector(3u));
    answer_vector(0u, surface.position);
    answer_vector(3u, spawn_origin(surface, vector(8u)));
    answer_vector(6u, surface.ng);
    answer_vector(9u, surface.ns);
}

// wo, ns, ng and two indices -> what a clear white dielectric makes of the ray: cosines, F, weights and directions.
@compute @workgroup_size(64)
fn piece_interface(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    var surface: Surface;
    surface.wo = vector(0u);
    surface.ns = vector(3u);
    surface.ng = vector(6u);
    surface.base = vec3f(1.0);
    surface.alpha = 1.0;
    surface.transmission = 1.0;
    surface.specular = 1.0;
    surface.specular_color = vec3f(1.0);
    let made = interface_at(surface, vec3f(0.0), number(9u), number(10u), true);
    let reflected = reflected_direction(surface, made.cos_i);
    let bent = refracted(surface, made, vec3f(0.0));
    let shading = pbr_shading(surface, made, reflected, bent.direction);
    answer_number(0u, made.cos_i);
    answer_number(1u, made.cos_t);
    answer(2u, u32(made.total));
    answer_number(3u, made.fresnel.x);
    answer_number(4u, shading.reflected.x);
    answer_number(5u, shading.transmitted.x);
    answer_vector(6u, reflected);
    answer_vector(9u, bent.direction);
}

// Sixteen steps, each 0 (nothing), a medium to enter, or 256 plus a medium to leave -> the stack and its innermost medium.
@compute @workgroup_size(64)
fn piece_media(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    var stack = vec2u(0u);
    for (var k = 0u; k < PIECE_RESULTS; k++) {
        let step = argument(k);
        if (step > 256u) {
            stack = leave_medium(stack, step - 256u);
        } else if (step != 0u) {
            stack = enter_medium(stack, step);
        }
        answer(k, innermost_medium(stack));
    }
}

// s, y and x -> ln(1 - s), atan2(y, x).
@compute @workgroup_size(64)
fn piece_functions(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    answer_number(0u, log_one_minus(number(0u)));
    answer_number(1u, arc_tangent(number(1u), number(2u)));
}

// alpha, cos and sin^2 of the half angle, cosines to viewer and light, exponent -> GGX lobe, cos^n.
@compute @workgroup_size(64)
fn piece_highlights(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    answer_number(0u, ggx_lobe(number(0u), number(1u), number(2u), number(3u), number(4u)));
    answer_number(1u, highlight(number(1u), number(2u), number(5u)));
}

// Pixel and offset -> the camera's ray.
@compute @workgroup_size(64)
fn piece_camera(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let ray = camera_ray(vec2u(argument(0u), argument(1u)), vec2f(number(2u), number(3u)));
    answer_vector(0u, ray.origin);
    answer_vector(3u, ray.direction);
}

// A light of the scene and a point -> direction, distance, irradiance.
@compute @workgroup_size(64)
fn piece_light(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let light = sample_light(argument(0u), vector(1u));
    answer_vector(0u, light.direction);
    answer_number(3u, light.distance);
    answer_vector(4u, light.irradiance);
}

// A level of the scene's environment and a direction -> radiance, place in the map.
@compute @workgroup_size(64)
fn piece_environment(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let uv = environment_uv(vector(1u));
    answer_vector(0u, environment_level(argument(0u), vector(1u)));
    answer_number(3u, uv.x);
    answer_number(4u, uv.y);
}

// A material of the scene and uv -> RGBA of its base colour texture.
@compute @workgroup_size(64)
fn piece_texture(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let found = sample_texture(load_texture_use(argument(0u), BASE_COLOR_TEXTURE), vec2f(number(1u), number(2u)));
    answer_vector(0u, found.xyz);
    answer_number(3u, found.w);
}

const RECORD_WORDS: u32 = 32u; // of the longest entry, at most

fn material_record(index: u32) -> array<u32, RECORD_WORDS> {
    let m = load_material(index);
    let color = bitcast<vec4u>(m.base_color);
    let emissive = bitcast<vec3u>(m.emissive);
    let specular = bitcast<vec3u>(m.specular_color);
    let ks = bitcast<vec3u>(m.whitted_ks);
    let kt = bitcast<vec3u>(m.whitted_kt);
    return array<u32, RECORD_WORDS>(
        color.x, color.y, color.z, color.w, emissive.x, emissive.y, emissive.z, bitcast<u32>(m.alpha_cutoff),
        specular.x, specular.y, specular.z, bitcast<u32>(m.specular), bitcast<u32>(m.metallic), bitcast<u32>(m.roughness),
        bitcast<u32>(m.transmission), bitcast<u32>(m.ior), bitcast<u32>(m.normal_scale), bitcast<u32>(m.occlusion_strength),
        m.flags, m.medium, ks.x, ks.y, ks.z, bitcast<u32>(m.whitted_n), kt.x, kt.y, kt.z, bitcast<u32>(m.whitted_ka),
        bitcast<u32>(m.whitted_kd), 0u, 0u, 0u,
    );
}

fn light_record(index: u32) -> array<u32, RECORD_WORDS> {
    let light = load_light(index);
    let position = bitcast<vec3u>(light.position);
    let direction = bitcast<vec3u>(light.direction);
    let intensity = bitcast<vec3u>(light.intensity);
    return array<u32, RECORD_WORDS>(
        position.x, position.y, position.z, light.kind, direction.x, direction.y, direction.z, bitcast<u32>(light.inverse_range),
        intensity.x, intensity.y, intensity.z, bitcast<u32>(light.spot_scale), bitcast<u32>(light.spot_cos_outer),
        bitcast<u32>(light.nearest), 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u,
    );
}

fn texture_use_record(index: u32) -> array<u32, RECORD_WORDS> {
    let used = load_texture_use(index / MATERIAL_TEXTURES, index % MATERIAL_TEXTURES);
    let u = bitcast<vec3u>(used.row_u);
    let v = bitcast<vec3u>(used.row_v);
    return array<u32, RECORD_WORDS>(
        u.x, u.y, u.z, used.offset, v.x, v.y, v.z, used.uv_set, used.width, used.height, used.flags, 0u,
        0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u,
    );
}

// A table's entry (table 0: materials, 1: lights, 2: texture_uses), which of them, and a word -> the entry's words from there on, as
// they lie in the structs of types.wgsl.
@compute @workgroup_size(64)
fn piece_record(@builtin(global_invocation_id) invocation: vec3u) {
    if (!take_call(invocation)) {
        return;
    }
    let index = argument(1u);
    var record: array<u32, RECORD_WORDS>;
    if (argument(0u) == 0u) {
        record = material_record(index);
    } else if (argument(0u) == 1u) {
        record = light_record(index);
    } else {
        record = texture_use_record(index);
    }
    for (var k = 0u; k < PIECE_RESULTS; k++) {
        answer(k, record[min(argument(2u) + k, RECORD_WORDS - 1u)]);
    }
}
