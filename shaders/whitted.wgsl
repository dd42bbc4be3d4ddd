// The `whitted` model: eq. 14.32 of Foley et al. as written. README.md, "Model whitted".

const LARGEST_EXPONENT: f32 = 1e6;

struct WhittedCoefficients {
    ka: f32,
    kd: f32,
    ks: vec3f,
    n: f32,
    kt: vec3f,
}

fn whitted_coefficients(surface: Surface) -> WhittedCoefficients {
    var k: WhittedCoefficients;
    let material = load_material(surface.material);
    let flags = surface.flags;
    let dielectric = 1.0 - surface.metallic;
    k.kd = dielectric * (1.0 - surface.transmission);
    if ((flags & MATERIAL_KD) != 0u) {
        k.kd = material.whitted_kd;
    }
    k.ka = dielectric * (1.0 - surface.transmission);
    if ((flags & MATERIAL_KA) != 0u) {
        k.ka = material.whitted_ka;
    }
    let f0 = min(normal_reflectance(1.0, surface.ior) * surface.specular_color, vec3f(1.0)) * surface.specular;
    k.ks = dielectric * f0 + surface.metallic * surface.base;
    if ((flags & MATERIAL_KS) != 0u) {
        k.ks = material.whitted_ks;
    }
    let alpha = surface.roughness * surface.roughness;
    k.n = clamp(2.0 / max(alpha * alpha, 1e-12) - 2.0, 0.0, LARGEST_EXPONENT);
    if ((flags & MATERIAL_N) != 0u) {
        k.n = material.whitted_n;
    }
    k.kt = dielectric * surface.transmission * surface.base;
    if ((flags & MATERIAL_KT) != 0u) {
        k.kt = material.whitted_kt;
    }
    return k;
}

// cos^n by way of the sine: for a large n the power hangs on how far the cosine is from 1.
fn highlight(cos_h: f32, sin_h2: f32, n: f32) -> f32 {
    if (cos_h <= 0.0) {
        return 0.0;
    }
    return exp(0.5 * n * log_one_minus(min(sin_h2, 1.0)));
}

fn whitted_direct(surface: Surface, wi: vec3f) -> vec3f {
    let k = whitted_coefficients(surface);
    let half_vector = normalize_or(wi + surface.wo, surface.ns);
    let across = cross(surface.ns, half_vector);
    let diffuse = k.kd * clamp(dot(surface.ns, wi), 0.0, 1.0) * surface.base;
    return diffuse + k.ks * highlight(dot(surface.ns, half_vector), dot(across, across), k.n);
}

fn whitted_shading(surface: Surface, made: Interface) -> Shading {
    var shading: Shading;
    let k = whitted_coefficients(surface);
    shading.radiance = surface.emission + k.ka * surface.occlusion * surface.base * gather(surface.ns, surface.ns, surface.ns, 0.0, false, false).irradiance;
    shading.reflected = k.ks;
    if (HAS_TRANSMISSION) {
        if (made.total) {
            shading.reflected += k.kt;
        } else {
            shading.transmitted = k.kt;
        }
    }
    return shading;
}
