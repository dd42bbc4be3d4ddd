// Begins a sample of every pixel of a batch: the first list.

fn has_camera_ray(slot: u32) -> bool {
    if (HAS_TOLERANCE) {
        if (has_orders()) {
            return slot < frame.order_count;
        }
    }
    if (slot >= frame.slot_count) {
        return false;
    }
    return inside_window(pixel_of_slot(slot));
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
