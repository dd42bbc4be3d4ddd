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
    let is_camera = level == CAMERA_LEVEL;
    var first = STACK_PLANE;
    var end = select(frame.state_planes, STACK_PLANE, is_camera);
    if (HAS_TOLERANCE) {
        // The order of its sample.
        first = select(first, RADIANCE_PLANE, is_camera);
        end = select(end, RADIANCE_PLANE + 1u, is_camera);
    }
    let loaded = load_state(first, end, slot, index, level);
    var ray = item_of(loaded.item);
    if (is_camera) {
        ray = camera_item(slot, loaded);
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
