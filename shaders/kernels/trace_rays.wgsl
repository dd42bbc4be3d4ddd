// Traces the ray on top of the stack of every slot on the list.

@compute @workgroup_size(64)
fn trace_rays(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_index) lane: u32) {
    let part = workgroup.y;
    let place = workgroup.x * LIST_WORKGROUP + lane;
    let index = place_in_list(part, place);
    if (index == 0u) {
        atomicAdd(&counters[ITERATIONS], 1u);
    }
    if (place >= part_length(part)) {
        return;
    }
    let entry = queue_in[index];
    let slot = entry_slot(entry);
    let level = entry_level(entry);
    let is_camera = level == CAMERA_LEVEL;
    var first = FIRST_ITEM_WORD;
    var end = select(FIRST_ITEM_WORD + frame.item_words, FIRST_ITEM_WORD, is_camera);
    if (HAS_TOLERANCE) {
        // The order of its sample.
        first = select(first, RADIANCE_WORD, is_camera);
        end = select(end, RADIANCE_WORD + 1u, is_camera);
    }
    if (HAS_LONG_RAYS) {
        traversal_slot = slot;
        suspended = (entry & ENTRY_SUSPENDED) != 0u;
        first = select(first, TRAVERSAL_WORD, suspended);
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
        left_traversal = loaded.traversal;
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
    store_traced(index, slot, hit);
    add_up_counters();
}
