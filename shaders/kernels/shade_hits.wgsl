// Shades what the rays on the list have hit, and makes the next list.

@compute @workgroup_size(64)
fn shade_hits(@builtin(global_invocation_id) invocation: vec3u, @builtin(local_invocation_index) lane: u32) {
    var entry = NO_ENTRY;
    if (invocation.x < list_in.w) {
        entry = advance(queue_in[invocation.x], invocation.x);
    }
    append(entry, lane);
    add_up_counters();
}
