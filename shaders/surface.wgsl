// What a hit knows about the surface: README.md, "The surface at a hit".

struct Surface {
    triangle: u32,
    position: vec3f,
    position_error: vec3f, // bound of how far off the triangle's plane `position` and a moved origin are, for each axis
    edge_distance: f32, // from the nearest edge of the triangle
    edge_error: f32, // bound of how far the triangle's edges may seem to lie beside where they are
    ng: vec3f, // geometric normal, towards the viewer
    ns: vec3f, // shading normal, dot(ns, wo) > 0
    wo: vec3f, // towards the viewer
    back: bool,
    base: vec3f,
    alpha: f32,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    specular: f32,
    specular_color: vec3f,
    occlusion: f32, // share of the ambient light that arrives
    emission: vec3f,
    flags: u32, // MATERIAL_*
    ior: f32, // of the material
    medium: u32, // .. of the solid that it bounds, see Material
    material: u32,
}

// The three vertices of a hit, and the weights of the second and third.
struct Corners {
    vertices: vec3u,
    u: f32,
    v: f32,
}

fn normal_at(vertex: u32) -> vec3f {
    if (HAS_INSTANCES) {
        if (met != 0u) {
            return normalize_or(placed_normal(vertex_word(vertex, 0u).xyz), vec3f(0.0));
        }
    }
    return vertex_word(vertex, 0u).xyz;
}

// Of a mesh that is placed; mirroring turns the bitangent's side around.
fn placed_tangent_at(vertex: u32) -> vec4f {
    let tangent = vertex_word(vertex, frame.tangent_word);
    if (met == 0u) {
        return tangent;
    }
    return vec4f(normalize_or(placed_vector(tangent.xyz), vec3f(0.0)), select(tangent.w, -tangent.w, placement.mirrored));
}

fn uv_at(uv_set: u32, vertex: u32) -> vec2f {
    let pair = vertex_word(vertex, frame.uv_word + uv_set / 2u);
    return select(pair.xy, pair.zw, (uv_set & 1u) != 0u);
}

// Interpolation from a corner along the edges: what is the same at all three corners stays just that.

fn interpolated_normal(corners: Corners) -> vec3f {
    let first = normal_at(corners.vertices.x);
    return first + corners.u * (normal_at(corners.vertices.y) - first) + corners.v * (normal_at(corners.vertices.z) - first);
}

fn interpolated_attribute(corners: Corners, word: u32) -> vec4f {
    let first = vertex_word(corners.vertices.x, word);
    return first + corners.u * (vertex_word(corners.vertices.y, word) - first)
        + corners.v * (vertex_word(corners.vertices.z, word) - first);
}

fn interpolated_tangent(corners: Corners) -> vec4f {
    if (HAS_INSTANCES) {
        let first = placed_tangent_at(corners.vertices.x);
        return first + corners.u * (placed_tangent_at(corners.vertices.y) - first)
            + corners.v * (placed_tangent_at(corners.vertices.z) - first);
    }
    return interpolated_attribute(corners, frame.tangent_word);
}

// row . (whole, 1) of whole numbers, which may be large, without whole periods: exact products keep the fraction.
fn moved_by_whole(row: vec3f, whole: vec2f, mode: u32) -> f32 {
    let moved = precise_product(row, vec3f(whole, 1.0));
    var high = moved.high;
    if (mode != WRAP_CLAMP) {
        high -= 2.0 * floor(0.5 * high);
    }
    return (high.x + high.y + high.z) + (moved.low.x + moved.low.y + moved.low.z);
}

// Where the point lies in a texture, by the ref's affine map. Whole numbers are taken out before interpolating: at a uv of 1e6 f32
// has 16 steps to a period, but the corners' differences are exact.
fn texture_place(used: TextureUse, corners: Corners) -> vec2f {
    let first = uv_at(used.uv_set, corners.vertices.x);
    let whole = floor(first);
    let uv = (first - whole) + corners.u * (uv_at(used.uv_set, corners.vertices.y) - first)
        + corners.v * (uv_at(used.uv_set, corners.vertices.z) - first);
    return vec2f(
        dot(used.row_u.xy, uv) + moved_by_whole(used.row_u, whole, wrap_u(used)),
        dot(used.row_v.xy, uv) + moved_by_whole(used.row_v, whole, wrap_v(used)),
    );
}

// What a material's textures hold at a point, linear.
struct Texels {
    base_color: vec4f,
    metallic_roughness: vec2f, // roughness in x, as in glTF's green, metallic in y
    normal: vec3f,
    occlusion: f32,
    emissive: vec3f,
    transmission: f32,
    specular: f32,
    specular_color: vec3f,
}

fn white_texels() -> Texels {
    return Texels(vec4f(1.0), vec2f(1.0), vec3f(1.0), 1.0, vec3f(1.0), 1.0, 1.0, vec3f(1.0));
}

// All textures of a material, white where there is none. One loop with one call, and one whose end drivers can't know: they would
// unroll it, eight times the code of all that reads a texture.
fn sample_material(material: u32, corners: Corners) -> Texels {
    var found = white_texels();
    var kinds = frame.texture_kinds;
    while (kinds != 0u) {
        let kind = firstTrailingBit(kinds);
        kinds &= kinds - 1u;
        if (texture_offset(material, kind) == NO_TEXTURE) {
            continue;
        }
        let texture = load_texture_use(material, kind);
        let value = sample_texture(texture, texture_place(texture, corners));
        found.base_color = select(found.base_color, value, kind == BASE_COLOR_TEXTURE);
        found.metallic_roughness = select(found.metallic_roughness, value.yz, kind == METALLIC_ROUGHNESS_TEXTURE);
        found.normal = select(found.normal, value.xyz, kind == NORMAL_TEXTURE);
        found.occlusion = select(found.occlusion, value.x, kind == OCCLUSION_TEXTURE);
        found.emissive = select(found.emissive, value.xyz, kind == EMISSIVE_TEXTURE);
        found.transmission = select(found.transmission, value.x, kind == TRANSMISSION_TEXTURE);
        found.specular = select(found.specular, value.w, kind == SPECULAR_TEXTURE);
        found.specular_color = select(found.specular_color, value.xyz, kind == SPECULAR_COLOR_TEXTURE);
    }
    return found;
}

// A vector without length has no direction: then the fallback.
fn normalize_or(v: vec3f, fallback: vec3f) -> vec3f {
    // Scaled first, so that neither tiny nor huge vectors lose their square.
    let largest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (!(largest > 1e-30)) {
        return fallback;
    }
    return normalize(v / largest);
}

fn normal_from_map(normal: vec3f, corners: Corners, value: vec3f, scale: f32) -> vec3f {
    let interpolated = interpolated_tangent(corners);
    let tangent = normalize_or(interpolated.xyz - dot(interpolated.xyz, normal) * normal, vec3f(0.0));
    if (all(tangent == vec3f(0.0))) {
        return normal;
    }
    let bitangent = select(-1.0, 1.0, interpolated.w >= 0.0) * cross(normal, tangent);
    let slope = (2.0 * value - 1.0) * vec3f(scale, scale, 1.0);
    return normalize_or(slope.x * tangent + slope.y * bitangent + slope.z * normal, normal);
}

// What the edges of a triangle do to a ray that leaves it.
struct Edges {
    inwards: vec3f, // how to move the point off the edges
    distance: f32, // of the moved point from the nearest one
    reach: f32, // points closer to one were moved
    error: f32, // how far beside where they are they may seem to lie
}

// How to move a point near a corner off its two edges, the shortest way, if it lacks some distance from at least one of them
// (below 0: has more than it needs); `inward_a` and `inward_b` are unit vectors away from the edges. In a corner sharper than
// 14 degrees they nearly cancel, and the way is long: there, a little towards the middle of the triangle, which `middle` leads to.
fn off_corner(lacking_a: f32, inward_a: vec3f, lacking_b: f32, inward_b: vec3f, middle: vec3f) -> vec3f {
    let cosine = dot(inward_a, inward_b);
    if (cosine < -0.97) {
        let share = min(8.0 * max(min(lacking_a, lacking_b), 0.0) / max(length(middle), 1e-30), 0.5);
        return max(lacking_a, 0.0) * inward_a + max(lacking_b, 0.0) * inward_b + share * middle;
    }
    // What moves it off one edge moves it off or onto the other by the cosine of that.
    let more_a = lacking_a - cosine * lacking_b;
    let more_b = lacking_b - cosine * lacking_a;
    if (lacking_a >= lacking_b && more_b <= 0.0) {
        return lacking_a * inward_a;
    }
    if (lacking_b > lacking_a && more_a <= 0.0) {
        return lacking_b * inward_b;
    }
    return (more_a * inward_a + more_b * inward_b) / (1.0 - cosine * cosine);
}

// For the point with these weights.
//
// Inwards: so that it is at least as far from each edge as rounding may take it, or an origin that starts there, or the plane of
// a neighbour as a ray from there sees it; else it could come to lie behind a neighbour with which the triangle makes a
// corner. No further: through a vertex of a ball of glass, each 1e-6 of its radius turns the ray by some 1e-6 rad.
//
// An edge seems to lie aside by its corners as the traversal sees them: relative to the origin (1 rounding) and sheared by a
// quotient (3), in two triangles.
fn edges_at(uv: vec2f, v0: vec3f, e1: vec3f, e2: vec3f, normal: vec3f) -> Edges {
    let twice_area = dot(normal, cross(e1, e2));
    let lengths = max(vec3f(length(e2 - e1), length(e2), length(e1)), vec3f(1e-30));
    let distances = vec3f(1.0 - uv.x - uv.y, uv) * twice_area / lengths;
    var reach = length(gamma(6.0) * abs(v0) + gamma(12.0) * (abs(e1) + abs(e2)));
    if (HAS_INSTANCES) {
        if (met != 0u) {
            // In proportion to how far rays are moved off the surface, or these come to lie before a neighbour's plane.
            reach += 3.0 * length(placed_error(v0, e1, e2));
        }
    }
    let nearest = min(distances.x, min(distances.y, distances.z));
    var inwards = vec3f(0.0);
    if (nearest < reach) {
        let lacking = vec3f(reach) - distances;
        let off_far = cross(normal, e2 - e1) / lengths.x;
        let off_second = cross(e2, normal) / lengths.y;
        let off_first = cross(normal, e1) / lengths.z;
        let middle = (e1 + e2) / 3.0 - (uv.x * e1 + uv.y * e2);
        // At the corner between the two nearest edges.
        if (lacking.x <= lacking.y && lacking.x <= lacking.z) {
            inwards = off_corner(lacking.y, off_second, lacking.z, off_first, middle);
        } else if (lacking.y <= lacking.z) {
            inwards = off_corner(lacking.x, off_far, lacking.z, off_first, middle);
        } else {
            inwards = off_corner(lacking.x, off_far, lacking.y, off_second, middle);
        }
    }
    return Edges(inwards, max(nearest, reach), reach, gamma(8.0) * lengths.x);
}

// Where the ray meets the plane through v0: exact to the last digits where the camera is close to a triangle whose corners
// are far away.
struct Place {
    position: vec3f,
    error: vec3f, // bound of how far off it is, for each axis
    plane_error: vec3f, // .. of how far off the plane it and an origin moved from it are
}

fn place_along_ray(origin: vec3f, direction: vec3f, v0: vec3f, normal: vec3f, slope: f32) -> Place {
    if (slope == 0.0) {
        return Place(v0, vec3f(T_MAX), vec3f(T_MAX));
    }
    let t = dot(normal, v0 - origin) / slope;
    let near = origin + t * direction;
    // One step of Newton's method along the ray: what is left counts from a point on the plane, not from the ray's origin.
    let left = v0 - near;
    let step = dot(normal, left) / slope;
    let position = near + step * direction;
    // The way along the ray and its sum, two roundings, take `near` off the ray; the last step brings it to the plane again, along
    // the ray, by as much and the more the flatter the ray. That step itself: the difference, the normal, products and their sum,
    // the quotient: six, each of the size of the terms of the scalar product, which in a plane across an axis are next to nothing.
    let aside = gamma(2.0) * abs(t * direction) + gamma(1.0) * abs(near);
    let along = dot(abs(normal), aside + gamma(6.0) * abs(left)) / abs(slope) * abs(direction);
    let error = aside + gamma(1.0) * abs(position) + along;
    return Place(position, error, gamma(2.0) * (abs(position) + abs(step * direction)) + gamma(6.0) * abs(left));
}

// A hit point with the bounds of its errors.
struct Point {
    position: vec3f,
    plane_error: vec3f, // Surface.position_error
    edge_distance: f32,
    edge_error: f32,
}

fn point_at(origin: vec3f, direction: vec3f, slope: f32, uv: vec2f, corners: Vertices) -> Point {
    // From the barycentrics rather than along the ray, so the error depends on the triangle and not on the distance (pbrt
    // 4ed, 6.8.5); and from a corner and the edges rather than from three corners, so of a small triangle it is little more
    // than one rounding.
    let e1 = corners.v1 - corners.v0;
    let e2 = corners.v2 - corners.v0;
    let along_1 = uv.x * e1;
    let along_2 = uv.y * e2;
    let edges = edges_at(uv, corners.v0, e1, e2, corners.normal);
    let position = corners.v0 + (along_1 + along_2 + edges.inwards);
    // One rounding of the sum, one when the origin of a spawned ray is moved; three on the way along the edges.
    let error = gamma(2.0) * abs(position) + gamma(4.0) * (abs(along_1) + abs(along_2));
    let place = place_along_ray(origin, direction, corners.v0, corners.normal, slope);
    // Only where it is far better: the other point never lies beyond the triangle's edges, while this one may by as much as an
    // edge seems to lie aside. Close to an edge therefore only where the other would be nowhere near: on a plane without end.
    let advantage = select(8.0, 1024.0, edges.distance <= edges.reach);
    if (advantage * dot(place.error, vec3f(1.0)) < dot(error, vec3f(1.0))) {
        return Point(place.position, place.plane_error, edges.distance, edges.error);
    }
    return Point(position, error, edges.distance, edges.error);
}

// Everything about the surface that `hit` names, for a ray from `origin` along `direction`.
fn surface_at(hit: Hit, origin: vec3f, direction: vec3f) -> Surface {
    var surface: Surface;
    let index = leaf_material(hit.leaf);
    let material = load_material(index);
    surface.material = index;
    surface.flags = material.flags;
    surface.ior = material.ior;
    if (HAS_SOLIDS) {
        surface.medium = material.medium;
    }
    surface.wo = -direction;

    let positions = met_positions(hit.leaf);
    let v0 = positions.v0;
    let v1 = positions.v1;
    let v2 = positions.v2;
    let uv = barycentrics(origin, direction, v0, v1, v2);
    let corners = Corners(met_vertices(hit.leaf), uv.x, uv.y);
    let slope = dot(positions.normal, direction);
    surface.back = slope > 0.0;
    let facing = select(1.0, -1.0, surface.back);
    let front_ng = select(positions.normal, surface.wo, all(positions.normal == vec3f(0.0)));
    surface.ng = facing * front_ng;
    surface.triangle = hit.triangle;
    if (HAS_ERROR_BOUNDS) {
        let point = point_at(origin, direction, slope, uv, positions);
        surface.position = point.position;
        surface.position_error = point.plane_error;
        if (HAS_INSTANCES) {
            if (met != 0u) {
                surface.position_error += placed_error(v0, v1 - v0, v2 - v0);
            }
        }
        surface.edge_distance = point.edge_distance;
        surface.edge_error = point.edge_error;
    } else {
        surface.position = origin + hit.t * direction;
    }

    var front_ns = normalize_or(interpolated_normal(corners), front_ng);

    var found = white_texels();
    if (HAS_TEXTURES) {
        found = sample_material(index, corners);
    }
    if (HAS_NORMAL_MAPS) {
        if (texture_offset(index, NORMAL_TEXTURE) != NO_TEXTURE) {
            front_ns = normal_from_map(front_ns, corners, found.normal, material.normal_scale);
        }
    }
    surface.ns = facing * front_ns;
    if (!(dot(surface.ns, surface.wo) > 0.0)) {
        surface.ns = surface.ng;
    }

    var base = material.base_color * found.base_color;
    if (HAS_VERTEX_COLORS) {
        base *= interpolated_attribute(corners, frame.color_word);
    }
    surface.base = base.xyz;
    surface.alpha = 1.0;
    if (HAS_BLEND) {
        if ((surface.flags & MATERIAL_BLEND) != 0u) {
            surface.alpha = clamp(base.w, 0.0, 1.0);
        }
    }
    if (HAS_MASK) {
        if ((surface.flags & MATERIAL_MASK) != 0u) {
            surface.alpha = select(1.0, 0.0, clamp(base.w, 0.0, 1.0) < material.alpha_cutoff);
        }
    }
    surface.metallic = clamp(material.metallic * found.metallic_roughness.y, 0.0, 1.0);
    surface.roughness = clamp(material.roughness * found.metallic_roughness.x, 0.0, 1.0);
    surface.transmission = clamp(material.transmission * found.transmission, 0.0, 1.0);
    surface.specular = clamp(material.specular * found.specular, 0.0, 1.0);
    surface.specular_color = material.specular_color * found.specular_color;
    surface.occlusion = 1.0 + material.occlusion_strength * (found.occlusion - 1.0);
    surface.emission = material.emissive * found.emissive;
    return surface;
}

// A hit that is a hole in the alpha mask.
fn cut_out(surface: Surface) -> bool {
    if (HAS_MASK) {
        return (surface.flags & MATERIAL_MASK) != 0u && surface.alpha == 0.0;
    }
    return false;
}

// The flattest angle to a facet at which rays are lifted over its edges for certain, radians.
const LEAST_ANGLE: f32 = 1e-4;

// The start of a ray that leaves the surface to the side of `ng` that `direction` points to: the hit point moved along the
// geometric normal by the bound of its own error (pbrt 4ed, 6.8.6). The triangle itself is left out of the ray's traversal
// (WorkItem.after), so this is for its neighbours. Moving it further than needed is an error too: what a curved mirror or a
// ball of glass shows is magnified from bounce to bounce.
fn spawn_origin(surface: Surface, direction: vec3f) -> vec3f {
    if (!HAS_ERROR_BOUNDS) {
        return surface.position;
    }
    let height = dot(direction, surface.ng);
    // Where the ray crosses the edge to a neighbour that falls away it must be above it by more than that may seem to lie aside,
    // or it hits the neighbour's far end. Only flat rays have not risen by then.
    let lift = max(surface.edge_error - max(abs(height), LEAST_ANGLE) * surface.edge_distance, 0.0);
    let distance = dot(abs(surface.ng), surface.position_error) + lift;
    let side = select(-1.0, 1.0, height >= 0.0);
    return surface.position + side * distance * surface.ng;
}
