// Shades what the rays on the list have hit, and makes the next list.

@compute @workgroup_size(64)
fn shade_hits(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let part = workgroup.y;
    let place = workgroup.x * LIST_WORKGROUP + lane;
    if (place >= part_length(part)) {
        return;
    }
    let index = place_in_list(part, place);
    let entry = advance(queue_in[index], index);
    if (entry != NO_ENTRY) {
        append(entry, part);
    }
    add_up_counters();
}
