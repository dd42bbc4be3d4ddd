// First-hit layers through the middle of each pixel: position, normals, albedo, ids.

@compute @workgroup_size(64)
fn aov(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = workgroup.x * 64u + lane;
    let pixel = pixel_of_lane(tile_of_workgroup(workgroup.x), lane);
    if (!inside_window(pixel)) {
        return;
    }
    let ray = camera_ray(pixel + frame.window_origin, vec2f(0.0));
    var layers: Aov;
    layers.depth = -1.0;
    layers.material = NO_HIT;
    layers.node = NO_HIT;
    var t_min = ray.t_min;
    var after = NO_HIT;
    loop {
        let hit = trace(ray.origin, ray.direction, t_min, after, T_MAX, false);
        if (hit.triangle == NO_HIT) {
            break;
        }
        let surface = surface_at(hit, ray.origin, ray.direction);
        if (!cut_out(surface)) {
            layers.position = surface.position;
            layers.depth = frame.start_depth + dot(surface.position - frame.ray_start, frame.camera_forward);
            layers.geometric_normal = surface.ng;
            layers.shading_normal = surface.ns;
            layers.albedo = surface.base;
            layers.material = surface.material;
            layers.node = leaf_node(hit.leaf);
            if (HAS_INSTANCES) {
                if (met != 0u) {
                    layers.node = instance_node(met);
                }
            }
            break;
        }
        t_min = hit.t;
        after = hit.triangle;
    }
    aovs[slot] = layers;
}
