// Traces the ray on top of the stack of every slot on the list.

@compute @workgroup_size(64)
fn trace_rays(@builtin(global_invocation_id) invocation: vec3u) {
    let index = invocation.x;
    if (index == 0u) {
        atomicAdd(&counters[ITERATIONS], 1u);
    }
    if (index >= list_in.w) {
        return;
    }
    let entry = queue_in[index];
    let slot = entry_slot(entry);
    let level = entry_level(entry);
    let end = select(frame.state_planes, STACK_PLANE, level == CAMERA_LEVEL);
    var ray = item_of(load_state(STACK_PLANE, end, slot, index, level).item);
    if (level == CAMERA_LEVEL) {
        ray = camera_item(slot);
    }
    if (ray.kind == LIGHTS) {
        return;
    }
    if (HAS_LONG_RAYS) {
        traversal_slot = slot;
        suspended = (entry & ENTRY_SUSPENDED) != 0u;
    }
    if (HAS_CONTACT) {
        traversal_slot = slot;
        if ((entry & ENTRY_GATHERING) != 0u) {
            load_contact();
            ray.t_min = contact.t;
            ray.after = contact.triangle;
            ray.t_max = min(contact.reach, ray.t_max);
        }
    }
    let hit = trace(ray.origin, ray.direction, ray.t_min, ray.after, ray.t_max, ray.kind == SHADOW);
    var unfinished = false;
    if (HAS_LONG_RAYS) {
        unfinished = suspended;
    }
    store_hit(index, hit, unfinished);
    add_up_counters();
}
