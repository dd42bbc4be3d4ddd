// Goes on with every unfinished pixel of a batch by a bounded amount of work.

@compute @workgroup_size(64)
fn render(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = workgroup.x * 64u + lane;
    let pixel = pixel_of_lane(tile_of_workgroup(workgroup.x), lane);
    if (!inside_window(pixel)) {
        return;
    }
    if (!advance(slot, pixel + frame.window_origin)) {
        atomicAdd(&counters[UNFINISHED_SLOTS], 1u);
    }
    add_up_counters();
}
