// Begins a sample of every pixel of a batch: the first list.

@compute @workgroup_size(64)
fn camera_rays(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = workgroup.x * 64u + lane;
    let pixel = pixel_of_lane(tile_of_workgroup(workgroup.x), lane);
    var entry = NO_ENTRY;
    if (slot < frame.slot_count) {
        if (inside_window(pixel)) {
            count(PRIMARY_RAYS);
            entry = entry_of(slot, CAMERA_LEVEL);
        }
    }
    append(entry, lane);
    add_up_counters();
}
