// Traces given rays and writes what they hit: tests and benches of traversal alone.

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) invocation: vec3u) {
    let index = invocation.x;
    if (index >= frame.slot_count) {
        return;
    }
    let ray = probe_rays[index];
    let hit = trace(ray.origin, ray.direction, 0.0, NO_HIT, ray.t_max, ray.shadow != 0u);
    var uv = vec2f(0.0);
    if (hit.triangle != NO_HIT) {
        let corners = met_positions(hit.leaf);
        uv = barycentrics(ray.origin, ray.direction, corners.v0, corners.v1, corners.v2);
    }
    probe_hits[index] = ProbeHit(hit.t, uv.x, uv.y, hit.triangle);
    add_up_counters();
}
