// The ray tree of a pixel (Whitted 1980), walked top down: eq. 14.32 is linear in Ir and It, so each pending ray carries its
// throughput, and what it finds is added to the pixel at once. Depth first, one ray of each pixel at a time: all pixels' rays are
// traced by one kernel, what they found is shaded by another (work_lists.wgsl). lavapipe inlines every call, so what is large
// has one call site.

// The pixel's sum so far, and the rays that it took.
var<private> radiance: vec4f;
var<private> rays: u32;

// Rays of the current sample's tree that went to its common half of `max_rays` so far.
var<private> common_rays: u32;

// Branches that ended for want of room, in every program: the picture lacks what they would have brought, and its user is to know.
// Kept by slot, since atomics are much code.
var<private> dropped: vec2u; // in storage, in the budget

// Lights that are looked at in one go: there may be many that add nothing.
const LIGHTS_AT_ONCE: u32 = 512u;

fn take_slot(loaded: SlotState) {
    radiance = bitcast<vec4f>(loaded.radiance);
    if (HAS_TOLERANCE) {
        take_counts(loaded.counts);
    } else {
        rays = loaded.counts.x;
        common_rays = loaded.counts.y;
        dropped = loaded.counts.zw;
    }
}

// Takes the first ray of a sample's tree into account.
fn begin_sample(slot: u32, loaded: SlotState) {
    common_rays = 0u;
    if (HAS_TOLERANCE) {
        radiance = vec4f(0.0);
        rays = 0u;
        dropped = vec2u(0u);
        lost = 0.0;
        take_code(order_of(slot, loaded.radiance).negligible);
    }
    rays += 1u;
    radiance.w += 1.0;
}

// What has changed of it: stores are slow (on lavapipe each lane's each component is one of its own).
fn store_slot(slot: u32, loaded: SlotState, begins: bool) {
    var counts = vec4u(rays, common_rays, dropped);
    if (HAS_TOLERANCE) {
        counts = packed_counts();
    }
    let sum = bitcast<vec4u>(radiance);
    let has_sum = begins || any(sum != loaded.radiance);
    let has_counts = begins || any(counts != loaded.counts);
    let end = loop_end(select(1u, SLOT_WORDS, has_counts));
    for (var k = select(1u, 0u, has_sum); k < end; k++) {
        state[slot_word(slot) + k] = select(counts, sum, k == 0u);
    }
}

// The camera ray of a slot, which each kernel that needs it makes anew: that is less than to store and load it.
fn camera_item(slot: u32, loaded: SlotState) -> WorkItem {
    var pixel: vec2u;
    var offset: vec2f;
    if (HAS_TOLERANCE) {
        let order = order_of(slot, loaded.radiance);
        pixel = order.pixel;
        offset = order.offset;
    } else {
        pixel = pixel_of_slot(slot);
        offset = frame.sample_offset;
    }
    let ray = camera_ray(pixel + frame.window_origin, offset);
    var item: WorkItem;
    item.origin = ray.origin;
    item.direction = ray.direction;
    item.t_min = ray.t_min;
    item.t_max = T_MAX;
    item.kind = RADIANCE;
    item.straight = true;
    item.throughput = vec3f(1.0);
    item.after = NO_HIT;
    if (HAS_SOLIDS) {
        item.media = frame.camera_media;
    }
    item.allotment = frame.max_rays - frame.max_rays / 2u;
    return item;
}

// Adds to the pixel what a ray brings.
fn collect(brought: vec3f) {
    radiance = vec4f(min(radiance.xyz + brought, vec3f(LARGEST_SUM)), radiance.w);
}

// A throughput at most LARGEST_THROUGHPUT times a radiance, which is brought down to LARGEST_RADIANCE, as is the product.
fn weighted(throughput: vec3f, radiance_: vec3f) -> vec3f {
    return min(throughput * min(radiance_, vec3f(LARGEST_RADIANCE)), vec3f(LARGEST_RADIANCE));
}

// The ray came to the light, or to where there is nothing more.
fn arrive(item: WorkItem) {
    var arriving = item.throughput;
    if (HAS_ABSORPTION) {
        arriving *= medium_transmittance(item.media, item.t_max);
    }
    if (item.kind == RADIANCE) {
        count(ENDED_MISS);
        arriving = weighted(arriving, missed_radiance(item.direction, item.straight));
        if (item.straight) {
            radiance.w -= item.throughput.x;
        }
    }
    collect(arriving);
}

// The boundary between the medium that a ray is in and what is beyond the surface.
fn interface_between(surface: Surface, wo_rest: vec3f, media_: vec2u, through: vec2u) -> Interface {
    var eta_i = 1.0;
    var eta_t = surface.ior;
    var bends = false;
    if (HAS_SOLIDS) {
        eta_i = medium_ior(media_);
        bends = surface.medium != 0u;
        if (bends) {
            eta_t = medium_ior(through);
        }
    }
    return interface_at(surface, wo_rest, eta_i, eta_t, bends);
}

// What the surface does to the ray's media.
fn crossing_at(surface: Surface, media_: vec2u) -> Crossing {
    if (HAS_CONTACT) {
        return cross_contact(media_);
    }
    return cross_face(media_, surface.medium, surface.back);
}

// A ray that a surface would spawn.
struct Branch {
    direction: vec3f,
    rest: vec3f, // WorkItem.rest
    weight: vec3f,
    media: vec2u,
    overflow: bool, // there is no room for its media
    straight: bool,
    counter: u32, // what it counts as
    allotment: u32, // see WorkItem
}

// What a ray that would be spawned could bring. One that may see nothing behind what blends makes the pixel transparent, too.
fn could_bring(branch: Branch, throughput: vec3f) -> f32 {
    let brought = most_brought(throughput);
    let shows = branch.straight && frame.background_kind == BACKGROUND_TRANSPARENT;
    return select(brought, max(brought, max_component(throughput)), shows);
}

// In the place of a ray that is not spawned: what such rays bring in the mean. Of a tree that is cut off at many places, the sum is about right.
fn show_mean(throughput: vec3f) {
    collect(weighted(throughput, frame.branch_mean));
}

// A ray that would be spawned ends before it begins, and is counted. `largest`: the largest channel of its throughput.
fn ends_early(parent: WorkItem, branch: Branch, largest: f32) -> bool {
    if (largest < frame.min_weight) {
        count(ENDED_WEIGHT);
        return true;
    }
    if (parent.depth >= frame.max_depth) {
        count(ENDED_DEPTH);
        return true;
    }
    if (branch.overflow || pending >= frame.stack_capacity) {
        dropped.x += 1u;
        return true;
    }
    if (branch.allotment == 0u) {
        if (common_rays >= frame.max_rays / 2u) {
            dropped.y += 1u;
            return true;
        }
        common_rays += 1u;
    }
    return false;
}

// A new ray of the tree. Kind LIGHTS in the result: it ends here. README.md, "Where branches end".
fn spawn(parent: WorkItem, surface: Surface, branch: Branch) -> WorkItem {
    var child: WorkItem;
    child.kind = LIGHTS;
    let throughput = min(parent.throughput * branch.weight, vec3f(LARGEST_THROUGHPUT));
    let largest = max_component(throughput);
    if (!(largest > 0.0)) {
        return child;
    }
    if (HAS_TOLERANCE) {
        if (leave_out(could_bring(branch, throughput), 1.0)) {
            show_mean(throughput);
            return child;
        }
    }
    if (ends_early(parent, branch, largest)) {
        if (HAS_TOLERANCE) {
            lost += could_bring(branch, throughput);
            show_mean(throughput);
        }
        return child;
    }
    child.origin = spawn_origin(surface, branch.direction);
    child.direction = branch.direction;
    child.rest = branch.rest;
    child.t_max = T_MAX;
    child.kind = RADIANCE;
    child.depth = parent.depth + 1u;
    child.straight = branch.straight;
    child.throughput = throughput;
    child.allotment = branch.allotment;
    child.media = branch.media;
    child.after = surface.triangle;
    count(branch.counter);
    rays += 1u;
    return child;
}

// Where light comes from that a surface sends on, and how much of it.
struct Scattering {
    reflected: vec3f,
    transmitted: vec3f,
    rest: vec3f, // WorkItem.rest of the transmitted ray
    shading: Shading,
}

fn scatter(item: WorkItem, surface: Surface, made: Interface) -> Scattering {
    var found: Scattering;
    found.reflected = reflected_direction(surface, made.cos_i);
    found.transmitted = item.direction;
    found.rest = item.rest;
    if (HAS_SOLIDS) {
        if (surface.medium != 0u) {
            let bent = refracted(surface, made, -item.rest);
            found.transmitted = bent.direction;
            found.rest = bent.rest;
        }
    }
    if (HAS_WHITTED) {
        found.shading = whitted_shading(surface, made);
    } else {
        found.shading = pbr_shading(surface, made, found.reflected, found.transmitted);
    }
    if (HAS_UNLIT) {
        if ((surface.flags & MATERIAL_UNLIT) != 0u) {
            found.shading = Shading(surface.base, vec3f(0.0), vec3f(0.0));
        }
    }
    return found;
}

// What a surface leaves to be traced, in the order in which it is put on the stack: last put, first traced.
const PAST: u32 = 0u; // the ray that goes on past what alpha leaves out
const TRANSMITTED: u32 = 1u;
const REFLECTED: u32 = 2u;
const LIGHTS_LEFT: u32 = 3u; // lights after the one that is looked at now
const ONWARD: u32 = 4u; // a shadow ray, or a ray that goes on as it came

fn branch_of(which: u32, item: WorkItem, surface: Surface, crossing: Crossing, found: Scattering) -> Branch {
    let past = vec3f(select(0.0, 1.0 - surface.alpha, which == PAST));
    var branch = Branch(item.direction, item.rest, past, item.media, false, item.straight, REFRACTION_RAYS, 0u);
    if (HAS_TRANSMISSION) {
        if (which == TRANSMITTED) {
            let weight = surface.alpha * found.shading.transmitted;
            branch = Branch(found.transmitted, found.rest, weight, crossing.through, crossing.full, false, REFRACTION_RAYS, 0u);
        }
    }
    if (HAS_REFLECTION) {
        if (which == REFLECTED) {
            let weight = surface.alpha * found.shading.reflected;
            branch = Branch(found.reflected, vec3f(0.0), weight, item.media, false, false, REFLECTION_RAYS, 0u);
        }
    }
    return branch;
}

// The shadow ray to the next light from `item.light` on that could add anything; `light` in the result: where to go on after it.
// Kind LIGHTS: there is none, up to `light`.
fn next_shadow_ray(item: WorkItem, surface: Surface, made: Interface) -> WorkItem {
    var next = item;
    next.kind = LIGHTS;
    let all = loop_end(frame.light_count);
    loop {
        if (next.light >= all || next.light - item.light >= LIGHTS_AT_ONCE) {
            break;
        }
        let light = sample_light(next.light, surface.position);
        next.light += 1u;
        var reflected = vec3f(0.0);
        if (dot(surface.ns, light.direction) > 0.0 && dot(surface.ng, light.direction) > 0.0) {
            if (HAS_WHITTED) {
                reflected = whitted_direct(surface, light.direction);
            } else {
                reflected = pbr_direct(surface, made, light.direction);
            }
        }
        let added = weighted(item.throughput * surface.alpha, light.irradiance * min(reflected, vec3f(LARGEST_THROUGHPUT)));
        var is_traced = max_component(added) > 0.0;
        if (HAS_TOLERANCE) {
            if (is_traced) {
                // Most places are not in the shadow: taken for lit, they show no edge where a light begins to be negligible.
                if (leave_out(over_channels(added), frame.light_share)) {
                    collect(added);
                    is_traced = false;
                }
            }
        }
        if (is_traced) {
            next.kind = SHADOW;
            next.throughput = added;
            next.direction = light.direction;
            next.t_max = light.distance;
            break;
        }
        if (!HAS_MANY_LIGHTS) {
            break;
        }
    }
    if (next.kind == SHADOW) {
        next.origin = spawn_origin(surface, next.direction);
        if (next.t_max < T_MAX) {
            let towards = surface.position + next.t_max * next.direction - next.origin;
            next.t_max = length(towards);
            next.direction = towards / max(next.t_max, 1e-30);
        }
        next.t_min = 0.0;
        next.after = surface.triangle;
        count(SHADOW_RAYS);
        rays += 1u;
    }
    return next;
}

// What a shadow ray keeps at a surface that may let part of the light through.
fn shadow_share(surface: Surface) -> vec3f {
    var through = vec3f(0.0);
    if ((surface.flags & MATERIAL_UNLIT) == 0u) {
        if (HAS_WHITTED) {
            through = whitted_coefficients(surface).kt;
        } else {
            through = pbr_shadow(surface);
        }
    }
    return vec3f(1.0 - surface.alpha) + surface.alpha * through;
}

// A ray that goes on behind a surface as it came: a shadow ray, or any ray at a hidden surface. Kind LIGHTS in the result: it
// ends there.
fn straight_on(item: WorkItem, surface: Surface, crossing: Crossing, t: f32) -> WorkItem {
    var next = item;
    if (HAS_TRANSPARENT_SHADOWS) {
        if (!crossing.hidden) {
            next.throughput = min(next.throughput * shadow_share(surface), vec3f(LARGEST_RADIANCE));
        }
    }
    if (HAS_SOLIDS) {
        next.media = crossing.through;
        if (crossing.full && max_component(next.throughput) > 0.0) {
            dropped.x += 1u;
            if (HAS_TOLERANCE) {
                let is_shadow = item.kind == SHADOW;
                lost += select(most_brought(next.throughput), over_channels(next.throughput), is_shadow);
                show_mean(select(next.throughput, vec3f(0.0), is_shadow));
            }
            next.throughput = vec3f(0.0);
        }
    }
    next.origin = spawn_origin(surface, item.direction);
    if (item.t_max < T_MAX) {
        next.t_max = max(item.t_max - t, 0.0);
    }
    next.t_min = 0.0;
    next.after = surface.triangle;
    if (!(max_component(next.throughput) > 0.0)) {
        next.kind = LIGHTS;
    }
    return next;
}

// Goes on behind a surface that stands in no ray's way: a hole in an alpha mask; what a shadow ray passes; a face of solids that
// light does not see. Kind LIGHTS in the result: the ray ends there. `goes_on` false: the surface is to be shaded.
struct Passing {
    goes_on: bool,
    ray: WorkItem,
}

fn pass_by(item: WorkItem, surface: Surface, crossing: Crossing, hit: Hit) -> Passing {
    var passing = Passing(false, item);
    if (item.kind == LIGHTS) {
        return passing;
    }
    if (HAS_MASK) {
        if (cut_out(surface)) {
            passing.goes_on = true;
            passing.ray.t_min = hit.t;
            passing.ray.after = hit.triangle;
            return passing;
        }
    }
    if (HAS_STRAIGHT_ON) {
        if (item.kind == SHADOW || crossing.hidden) {
            passing.goes_on = true;
            passing.ray = straight_on(item, surface, crossing, hit.t);
        }
    }
    return passing;
}

// Which of the rest to put on the stack next: of rays that are spawned the one that weighs most, so that it is traced last. A ray that is
// traced while others of its surface wait then weighs at most half of what came to the surface, where a surface sends on no more than
// comes: however deep a tree goes, no more wait than powers of two lie between its weights (as with quicksort, the smaller part first).
fn heaviest_first(next: u32, rest: u32, alpha: f32, shading: Shading) -> u32 {
    let weights = vec3f(1.0 - alpha, alpha * max_component(shading.transmitted), alpha * max_component(shading.reflected));
    var chosen = next;
    var largest = -1.0;
    if ((rest & (1u << PAST)) != 0u) {
        chosen = PAST;
        largest = weights.x;
    }
    if ((rest & (1u << TRANSMITTED)) != 0u && weights.y > largest) {
        chosen = TRANSMITTED;
        largest = weights.y;
    }
    if ((rest & (1u << REFLECTED)) != 0u && weights.z > largest) {
        chosen = REFLECTED;
    }
    return chosen;
}

// Puts on the stack what `todo` names, a bit each.
fn push_all(slot: u32, todo: u32, item: WorkItem, surface: Surface, crossing: Crossing, found: Scattering, left: WorkItem, onward: WorkItem) {
    let shading = found.shading;
    let all_weights = 1.0 - surface.alpha + surface.alpha * (max_component(shading.transmitted) + max_component(shading.reflected));
    let to_share = max(item.allotment, 1u) - 1u;
    var remaining = to_share;
    // One loop with one call of each; that its end is not known keeps drivers from unrolling it.
    var rest = todo;
    while (rest != 0u) {
        var which = firstTrailingBit(rest);
        if (HAS_TOLERANCE) {
            which = heaviest_first(which, rest, surface.alpha, shading);
        }
        rest &= ~(1u << which);
        var pushed = onward;
        if (HAS_MANY_LIGHTS) {
            if (which == LIGHTS_LEFT) {
                pushed = left;
            }
        }
        if (HAS_BRANCHES) {
            if (which <= REFLECTED) {
                var branch = branch_of(which, item, surface, crossing, found);
                let share = max_component(branch.weight) / max(all_weights, 1e-30);
                branch.allotment = min(u32(share * f32(to_share)), remaining);
                remaining -= branch.allotment;
                pushed = spawn(item, surface, branch);
                if (pushed.kind == LIGHTS) {
                    continue;
                }
            }
        }
        push(slot, pushed);
    }
}

// What the item finds at a surface: light of its own, and what is still to be traced.
fn shade(slot: u32, popped: WorkItem, hit: Hit) {
    var item = popped;
    var surface = surface_at(hit, item.origin, item.direction);
    if (HAS_CONTACT) {
        if (item.joined) {
            // Rays start clear of all faces in this place, whichever is shaded.
            let height = contact_height(met_positions(hit.leaf));
            surface.position_error = max(surface.position_error, vec3f(1.5 * height));
        }
    }
    var crossing = Crossing(item.media, false, false);
    if (HAS_SOLIDS) {
        crossing.through = item.through;
        if (item.kind != LIGHTS) {
            crossing = crossing_at(surface, item.media);
        }
    }
    var onward = item;
    onward.kind = LIGHTS;
    var left = onward;
    var found: Scattering;
    var todo = 0u;
    if (HAS_ABSORPTION) {
        if (item.kind != LIGHTS && !cut_out(surface)) {
            item.throughput *= medium_transmittance(item.media, hit.t);
        }
    }
    let passing = pass_by(item, surface, crossing, hit);
    if (passing.goes_on) {
        onward = passing.ray;
    } else {
        let made = interface_between(surface, -item.rest, item.media, crossing.through);
        if (item.kind == RADIANCE) {
            found = scatter(item, surface, made);
            collect(weighted(item.throughput * surface.alpha, found.shading.radiance));
            item.light = 0u;
            if (HAS_BRANCHES) {
                todo = (1u << PAST) | (1u << TRANSMITTED) | (1u << REFLECTED);
            }
        }
        if (HAS_LIGHTS) {
            if ((surface.flags & MATERIAL_UNLIT) == 0u) {
                onward = next_shadow_ray(item, surface, made);
                left = item;
                left.kind = LIGHTS;
                left.light = onward.light;
                left.hit = hit;
                left.through = crossing.through;
                if (HAS_MANY_LIGHTS) {
                    todo |= select(0u, 1u << LIGHTS_LEFT, onward.light < frame.light_count);
                }
            }
        }
    }
    todo |= select(1u << ONWARD, 0u, onward.kind == LIGHTS);
    push_all(slot, todo, item, surface, crossing, found, left, onward);
}

// Whether a ray has come to a surface that it has to do with; if not, it has ended.
fn meets_surface(item: WorkItem, hit: Hit) -> bool {
    if (hit.triangle == NO_HIT) {
        arrive(item);
        return false;
    }
    if (item.kind == SHADOW) {
        if (HAS_TRANSPARENT_SHADOWS) {
            return (leaf_triangle(hit.leaf).entry & LEAF_TRANSPARENT) != 0u;
        }
        return false;
    }
    return true;
}

// Gathers the faces that lie in the place of a hit; true: there may be more of them, and the ray has to be traced on.
fn gather_contact(item: WorkItem, hit: Hit, gathering: bool) -> bool {
    var medium = 0u;
    if (hit.triangle != NO_HIT) {
        medium = load_material(leaf_material(hit.leaf)).medium;
    }
    if (gathering) {
        load_contact();
        return join_contact(hit, medium);
    }
    if (medium != 0u) {
        begin_contact(hit, medium, item.origin, item.direction);
        return true;
    }
    no_contact(hit);
    return false;
}

// What lies below the item that was taken from the stack.
fn item_below(slot: u32, index: u32) -> WorkItem {
    let end = loop_end(FIRST_ITEM_WORD + frame.item_words);
    return item_of(load_state(FIRST_ITEM_WORD, end, slot, index, pending - 1u).item);
}

// What is stored of an entry: of a camera ray no item, and with the first sample no sum, but the order where there are orders.
fn load_entry(slot: u32, level: u32, index: u32) -> SlotState {
    var first = RADIANCE_WORD;
    var end = FIRST_ITEM_WORD + frame.item_words;
    if (level == CAMERA_LEVEL) {
        if (!HAS_TOLERANCE) {
            first = select(HIT_WORD, RADIANCE_WORD, frame.sample > 0u);
        }
        end = FIRST_ITEM_WORD;
    }
    return load_state(first, end, slot, index, level);
}

// Goes on with a slot whose ray on top of the stack was traced. The result: its entry in the list of those with a ray to trace.
fn advance(entry: u32, index: u32) -> u32 {
    let slot = entry_slot(entry);
    pending = entry_level(entry);
    let loaded = load_entry(slot, pending, index);
    var item = item_of(loaded.item);
    let begins = pending == CAMERA_LEVEL;
    if (begins) {
        item = camera_item(slot, loaded);
        pending = 0u;
    }
    var hit = item.hit;
    var meets = true;
    if (item.kind != LIGHTS) {
        let traced = traced_of(loaded.hit);
        hit = traced.hit;
        if (HAS_INSTANCES) {
            met = met_of_word(loaded.hit);
        }
        if (HAS_LONG_RAYS) {
            if (traced.suspended) {
                return entry | ENTRY_SUSPENDED;
            }
        }
        if (HAS_CONTACT) {
            traversal_slot = slot;
            if (gather_contact(item, hit, (entry & ENTRY_GATHERING) != 0u)) {
                store_contact();
                return (entry & ~ENTRY_SUSPENDED) | ENTRY_GATHERING;
            }
            hit = contact.hit;
            if (HAS_INSTANCES) {
                met = contact_met;
            }
            item.joined = contact.joined;
        }
    }
    take_slot(loaded);
    if (begins) {
        begin_sample(slot, loaded);
    }
    if (item.kind != LIGHTS) {
        meets = meets_surface(item, hit);
    }
    if (HAS_MANY_LIGHTS) {
        // The lights that a surface has left need no ray of their own.
        if (!meets && pending > 0u) {
            let below = item_below(slot, index);
            if (below.kind == LIGHTS) {
                item = below;
                hit = below.hit;
                pending -= 1u;
                meets = true;
            }
        }
    }
    if (meets) {
        shade(slot, item, hit);
    }
    store_slot(slot, loaded, begins);
    if (pending == 0u) {
        return NO_ENTRY;
    }
    return entry_of(slot, pending - 1u);
}
