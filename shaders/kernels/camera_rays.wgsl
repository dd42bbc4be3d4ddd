// Begins a sample of every pixel of a batch: the first list.

fn has_camera_ray(slot: u32) -> bool {
    let in_picture = slot < frame.slot_count && inside_window(pixel_of_slot(slot));
    if (HAS_TOLERANCE) {
        // Chosen, not branched on: see loop_end of state.wgsl.
        return select(in_picture, slot < frame.order_count, has_orders());
    }
    return in_picture;
}

@compute @workgroup_size(64)
fn camera_rays(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = workgroup.x * 64u + lane;
    if (has_camera_ray(slot)) {
        count(PRIMARY_RAYS);
        append(entry_of(slot, CAMERA_LEVEL), workgroup.x % LIST_PARTS);
    }
    add_up_counters();
}
