// The `pbr` model: glTF 2.0 appendix B with the ratified extensions. README.md, "Model pbr".

// A surface smoother than this shows no highlight of a light without size.
const LEAST_HIGHLIGHT_ALPHA: f32 = 1e-3;

fn metal_reflectance(base: vec3f, cos_i: f32) -> vec3f {
    let m = clamp(1.0 - cos_i, 0.0, 1.0);
    let m2 = m * m;
    return base + (vec3f(1.0) - base) * (m2 * m2 * m);
}

// The share of a lobe that a single mirror ray stands for: all of a smooth one, nothing of a rough one.
fn mirror_share(roughness: f32) -> f32 {
    return 1.0 - smoothstep(0.1, 0.4, roughness);
}

// D V: GGX with the height-correlated Smith visibility (glTF appendix B.3). `sin_h2` is sin^2 of the angle between normal
// and half vector: near the peak its cosine has no digits left.
fn ggx_lobe(alpha: f32, cos_h: f32, sin_h2: f32, cos_o: f32, cos_i: f32) -> f32 {
    let a2 = alpha * alpha;
    let spread = sin_h2 + a2 * cos_h * cos_h;
    let distribution = a2 / (PI * spread * spread);
    let masking = cos_i * sqrt(cos_o * cos_o * (1.0 - a2) + a2);
    let shadowing = cos_o * sqrt(cos_i * cos_i * (1.0 - a2) + a2);
    return distribution * 0.5 / max(masking + shadowing, 1e-20);
}

// Scale and bias of F0 in the split-sum integral (Karis 2014, a fit).
fn environment_brdf(cos_o: f32, roughness: f32) -> vec2f {
    let q = roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let a = min(q.x * q.x, exp2(-9.28 * cos_o)) * q.x + q.y;
    return vec2f(-1.04, 1.04) * a + q.zw;
}

// What a light of unit irradiance adds: the BRDF times dot(ns, wi).
fn pbr_direct(surface: Surface, made: Interface, wi: vec3f) -> vec3f {
    let half_vector = normalize_or(wi + surface.wo, surface.ns);
    let cos_i = clamp(dot(surface.ns, wi), 0.0, 1.0);
    let cos_d = clamp(dot(wi, half_vector), 0.0, 1.0);
    let reflectance = fresnel(made, cos_d, refracted_cos_squared(made.eta_i, made.eta_t, cos_d));
    var value = (1.0 - surface.metallic) * (1.0 - surface.transmission) / PI * (1.0 - max_component(reflectance)) * surface.base;
    let alpha = surface.roughness * surface.roughness;
    if (alpha >= LEAST_HIGHLIGHT_ALPHA) {
        let across = cross(surface.ns, half_vector);
        let lobe = ggx_lobe(alpha, clamp(dot(surface.ns, half_vector), 0.0, 1.0), dot(across, across), made.cos_i, cos_i);
        value += lobe * ((1.0 - surface.metallic) * reflectance + surface.metallic * metal_reflectance(surface.base, cos_d));
    }
    return cos_i * value;
}

// What a hit sends on: radiance of its own, and the weights of the rays that it spawns.
struct Shading {
    radiance: vec3f,
    reflected: vec3f, // weight of Ir
    transmitted: vec3f, // weight of It
}

fn pbr_shading(surface: Surface, made: Interface, reflected: vec3f, transmitted: vec3f) -> Shading {
    var shading: Shading;
    let dielectric = 1.0 - surface.metallic;
    let share = mirror_share(surface.roughness);
    let fit = environment_brdf(made.cos_i, surface.roughness);
    let lobe = select(made.f0 * fit.x + made.f90 * fit.y, vec3f(1.0), made.total);
    let refused = mix(lobe, made.fresnel, share);
    let gathered = gather(surface.ns, reflected, transmitted, surface.roughness, (share < 1.0), (surface.transmission > 0.0));

    shading.radiance = surface.emission;
    shading.radiance += surface.occlusion * dielectric * (1.0 - surface.transmission) * (1.0 - max_component(refused))
        * surface.base * gathered.irradiance;
    if (share < 1.0) {
        let metal = surface.base * fit.x + fit.y;
        shading.radiance += surface.occlusion * (1.0 - share) * gathered.reflected
            * (dielectric * lobe + surface.metallic * metal);
    }
    if (HAS_REFLECTION) {
        shading.reflected = share * (dielectric * made.fresnel + surface.metallic * metal_reflectance(surface.base, made.cos_i));
    }
    if (HAS_TRANSMISSION) {
        if (!made.total) {
            let through = dielectric * surface.transmission * (1.0 - max_component(made.fresnel)) * surface.base;
            shading.transmitted = share * through;
            if (share < 1.0 && surface.transmission > 0.0) {
                shading.radiance += (1.0 - share) * through * gathered.transmitted;
            }
        }
    }
    return shading;
}

// T in README.md: what a shadow ray loses at this surface.
fn pbr_shadow(surface: Surface) -> vec3f {
    return (1.0 - surface.metallic) * surface.transmission * surface.base;
}
