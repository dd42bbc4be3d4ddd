// Begins a sample of every pixel of a batch: the first list.

@compute @workgroup_size(64)
fn camera_rays(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = workgroup.x * 64u + lane;
    let pixel = pixel_of_lane(tile_of_workgroup(workgroup.x), lane);
    var entry = NO_ENTRY;
    if (slot < frame.slot_count) {
        radiance = vec4f(0.0);
        rays = 0u;
        if (frame.sample > 0u) {
            take_slot(load_state(RADIANCE_PLANE, slot, slot, 0u));
        }
        common_rays = 0u;
        if (inside_window(pixel)) {
            store_item(slot, 0u, camera_item(pixel + frame.window_origin, frame.sample));
            count(PRIMARY_RAYS);
            rays += 1u;
            radiance.w += 1.0;
            entry = entry_of(slot, 0u);
        }
        store_slot(slot);
    }
    append(entry, lane);
    add_up_counters();
}
