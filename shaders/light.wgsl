// Punctual lights (KHR_lights_punctual): README.md, "Lights".

struct LightSample {
    direction: vec3f, // wi, towards the light
    distance: f32,
    irradiance: vec3f, // Ip: on a surface that faces it
}

fn sample_light(index: u32, position: vec3f) -> LightSample {
    let light = load_light(index);
    if (light.kind == LIGHT_DIRECTIONAL) {
        return LightSample(-light.direction, T_MAX, light.intensity);
    }
    let towards = light.position - position;
    // Scaled first, so that neither a near nor a far light loses its square.
    let largest = max_component(abs(towards));
    if (largest < 1e-30) { // on the light itself: no direction
        return LightSample(vec3f(0.0), 0.0, vec3f(0.0));
    }
    let distance = largest * length(towards / largest);
    let direction = towards / distance;
    let near = min(distance * light.inverse_range, 1.0);
    let near_squared = near * near;
    var share = 1.0 - near_squared * near_squared;
    if (light.kind == LIGHT_SPOT) {
        let cone = clamp((dot(-direction, light.direction) - light.spot_cos_outer) * light.spot_scale, 0.0, 1.0);
        share *= cone * cone;
    }
    // Divided twice: the square of the distance may be out of range where the quotient is not.
    let nearest = max(distance, light.nearest);
    return LightSample(direction, distance, share * light.intensity / nearest / nearest);
}
