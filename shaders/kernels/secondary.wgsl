// Given rays, and the rays that leave what they hit, by the code that pictures are made by: surface, origin of a spawned ray,
// what it passes by. For tests.

fn leaving_direction(given: SecondaryRay, surface: Surface) -> vec3f {
    if (given.leaving == LEAVING_ABOUT_NORMAL) {
        let aside = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(surface.ng.x) > 0.5);
        let tangent = normalize(cross(surface.ng, aside));
        return normalize(given.next.x * tangent + given.next.y * cross(surface.ng, tangent) + given.next.z * surface.ng);
    }
    if (given.leaving == LEAVING_MIRRORED) {
        return reflected_direction(surface, clamp(dot(surface.ns, surface.wo), 0.0, 1.0));
    }
    return given.next;
}

@compute @workgroup_size(64)
fn secondary(@builtin(global_invocation_id) invocation: vec3u) {
    let index = invocation.x;
    if (index >= frame.slot_count) {
        return;
    }
    let given = secondary_rays[index];
    var found: SecondaryHit;
    found.triangle = NO_HIT;
    found.next_triangle = NO_HIT;
    var ray = Ray(given.origin, given.direction, 0.0);
    // One loop with one call of `trace`: first the given ray, then the one that leaves.
    loop {
        let hit = trace(ray.origin, ray.direction, 0.0, found.triangle, T_MAX, false);
        if (found.triangle != NO_HIT) {
            found.t = hit.t;
            found.next_triangle = hit.triangle;
            break;
        }
        if (hit.triangle == NO_HIT) {
            break;
        }
        let surface = surface_at(hit, ray.origin, ray.direction);
        let direction = leaving_direction(given, surface);
        ray = Ray(spawn_origin(surface, direction), direction, 0.0);
        found.position = surface.position;
        found.triangle = surface.triangle;
        found.origin = ray.origin;
        found.direction = ray.direction;
        found.ng = surface.ng;
        found.back = u32(surface.back);
        found.ns = surface.ns;
    }
    secondary_hits[index] = found;
    add_up_counters();
}
