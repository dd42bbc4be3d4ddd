// Punctual lights (KHR_lights_punctual): README.md, "Lights".

struct LightSample {
    direction: vec3f, // wi, towards the light
    distance: f32,
    irradiance: vec3f, // Ip: on a surface that faces it
}

fn sample_light(index: u32, position: vec3f) -> LightSample {
    let light = lights[index];
    if (light.kind == LIGHT_DIRECTIONAL) {
        return LightSample(-light.direction, T_MAX, light.intensity);
    }
    let towards = light.position - position;
    let distance = length(towards);
    if (distance < 1e-18) { // on the light itself: no direction
        return LightSample(vec3f(0.0), 0.0, vec3f(0.0));
    }
    let direction = towards / distance;
    let near = distance * light.inverse_range;
    let near_squared = near * near;
    var share = clamp(1.0 - near_squared * near_squared, 0.0, 1.0) / (distance * distance);
    if (light.kind == LIGHT_SPOT) {
        let cone = clamp((dot(-direction, light.direction) - light.spot_cos_outer) * light.spot_scale, 0.0, 1.0);
        share *= cone * cone;
    }
    return LightSample(direction, distance, share * light.intensity);
}
