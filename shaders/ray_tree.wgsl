// The ray tree of a pixel (Whitted 1980), walked top down: eq. 14.32 is linear in Ir and It, so each pending ray carries its
// throughput, and what it finds is added to the pixel at once. One loop with one call of `trace` and one of `surface_at`,
// whatever the kind of ray: lavapipe inlines every call, and lanes with different kinds keep going together.

// The pixel's sum so far, and the rays that it took.
var<private> radiance: vec4f;
var<private> rays: u32;

// Rays of the current sample's tree that went to its common half of `max_rays` so far.
var<private> common_rays: u32;

// Iterations of all loops but those of traversal, about: what a ray takes at least, and the lights that are looked at.
var<private> other_steps: u32;
const RAY_STEPS: u32 = 48u;

// By how much a ray may exceed the budget before its own traversal is suspended.
const SUSPEND_BEYOND: u32 = 2048u;

// Lights that are looked at in one go: there may be many that add nothing.
const LIGHTS_AT_ONCE: u32 = 512u;

fn camera_item(pixel: vec2u, sample: u32) -> WorkItem {
    let ray = camera_ray(pixel, sample_offset(sample));
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
    count(PRIMARY_RAYS);
    rays += 1u;
    item.allotment = frame.max_rays - frame.max_rays / 2u;
    common_rays = 0u;
    radiance.w += 1.0;
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

// A new ray of the tree, unless it ends here: README.md, "Where branches end".
fn spawn(slot: u32, parent: WorkItem, surface: Surface, branch: Branch) {
    let throughput = min(parent.throughput * branch.weight, vec3f(LARGEST_THROUGHPUT));
    let largest = max_component(throughput);
    if (!(largest > 0.0)) {
        return;
    }
    if (largest < frame.min_weight) {
        count(ENDED_WEIGHT);
        return;
    }
    if (parent.depth >= frame.max_depth) {
        count(ENDED_DEPTH);
        return;
    }
    if (branch.overflow || pending >= frame.stack_capacity) {
        count_dropped(ENDED_STORAGE);
        return;
    }
    if (branch.allotment == 0u) {
        if (common_rays >= frame.max_rays / 2u) {
            count_dropped(ENDED_BUDGET);
            return;
        }
        common_rays += 1u;
    }
    var child: WorkItem;
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
    push(slot, child);
}

// The surface's own radiance, and the rays that it spawns.
fn shade(slot: u32, item: WorkItem, surface: Surface, crossing: Crossing, made: Interface) {
    let reflected = reflected_direction(surface, made.cos_i);
    var transmitted = item.direction;
    var rest = item.rest;
    if (HAS_SOLIDS) {
        if (surface.medium != 0u) {
            let bent = refracted(surface, made, -item.rest);
            transmitted = bent.direction;
            rest = bent.rest;
        }
    }
    var shading: Shading;
    if (HAS_WHITTED) {
        shading = whitted_shading(surface, made);
    } else {
        shading = pbr_shading(surface, made, reflected, transmitted);
    }
    if (HAS_UNLIT) {
        if ((surface.flags & MATERIAL_UNLIT) != 0u) {
            shading = Shading(surface.base, vec3f(0.0), vec3f(0.0));
        }
    }
    collect(weighted(item.throughput * surface.alpha, shading.radiance));

    if (HAS_BRANCHES) {
        let all_weights = 1.0 - surface.alpha + surface.alpha * (max_component(shading.transmitted) + max_component(shading.reflected));
        let to_share = max(item.allotment, 1u) - 1u;
        var remaining = to_share;
        // One loop with one call of `spawn`. Last pushed, first traced: the reflected ray.
        for (var k = 0u; k < 3u; k++) {
            let past = select(0.0, 1.0 - surface.alpha, k == 0u);
            var branch = Branch(item.direction, item.rest, vec3f(past), item.media, false, item.straight, REFRACTION_RAYS, 0u);
            if (HAS_TRANSMISSION) {
                if (k == 1u) {
                    branch = Branch(transmitted, rest, surface.alpha * shading.transmitted, crossing.through, crossing.full, false, REFRACTION_RAYS, 0u);
                }
            }
            if (HAS_REFLECTION) {
                if (k == 2u) {
                    branch = Branch(reflected, vec3f(0.0), surface.alpha * shading.reflected, item.media, false, false, REFLECTION_RAYS, 0u);
                }
            }
            let share = max_component(branch.weight) / max(all_weights, 1e-30);
            branch.allotment = min(u32(share * f32(to_share)), remaining);
            remaining -= branch.allotment;
            spawn(slot, item, surface, branch);
        }
    }
}

// The shadow ray to the next light from `item.light` on that could add anything; the lights after it stay pending. Kind
// LIGHTS in the result: there is none.
fn next_shadow_ray(slot: u32, item: WorkItem, surface: Surface, made: Interface) -> WorkItem {
    var next = item;
    for (var k = item.light; k < frame.light_count; k++) {
        if (HAS_MANY_LIGHTS) {
            if (k - item.light >= LIGHTS_AT_ONCE) {
                next.light = k;
                push(slot, next);
                return next;
            }
        }
        other_steps += 1u;
        let light = sample_light(k, surface.position);
        if (dot(surface.ns, light.direction) <= 0.0 || dot(surface.ng, light.direction) <= 0.0) {
            continue;
        }
        var reflected: vec3f;
        if (HAS_WHITTED) {
            reflected = whitted_direct(surface, light.direction);
        } else {
            reflected = pbr_direct(surface, made, light.direction);
        }
        let added = weighted(item.throughput * surface.alpha, light.irradiance * min(reflected, vec3f(LARGEST_THROUGHPUT)));
        if (!(max_component(added) > 0.0)) {
            continue;
        }
        if (HAS_MANY_LIGHTS) {
            if (k + 1u < frame.light_count) {
                next.light = k + 1u;
                push(slot, next);
            }
        }
        let origin = spawn_origin(surface, light.direction);
        next.origin = origin;
        next.direction = light.direction;
        next.t_max = light.distance;
        if (light.distance < T_MAX) {
            let towards = surface.position + light.distance * light.direction - origin;
            next.t_max = length(towards);
            next.direction = towards / max(next.t_max, 1e-30);
        }
        next.kind = SHADOW;
        next.throughput = added;
        next.t_min = 0.0;
        next.after = surface.triangle;
        count(SHADOW_RAYS);
        rays += 1u;
        return next;
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
            count_dropped(ENDED_STORAGE);
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

// Goes on with a pixel until it is finished or the budget is spent; true: finished.
fn advance(slot: u32, pixel: vec2u) -> bool {
    var next_sample = slots[slot].next_sample;
    var item: WorkItem;
    var has_item = false;
    var gathering = false;
    var finished = false;
    if (HAS_LONG_RAYS) {
        traversal_slot = slot;
        suspend_at = frame.step_budget + SUSPEND_BEYOND;
        suspended = slots[slot].stack_height > STACK_HEIGHT;
        if (HAS_CONTACT) {
            gathering = (slots[slot].stack_height & SUSPENDED_CONTACT) != 0u;
            if (gathering) {
                load_contact();
            }
        }
    }
    pending = slots[slot].stack_height & STACK_HEIGHT;
    radiance = slots[slot].radiance;
    rays = slots[slot].rays;
    common_rays = slots[slot].common_rays;
    loop {
        if (!has_item) {
            if (pending > 0u) {
                item = pop(slot);
            } else if (next_sample < frame.sample_count) {
                item = camera_item(pixel, next_sample);
                next_sample += 1u;
            } else {
                finished = true;
                break;
            }
        }
        // Not while faces in contact are gathered: what was found of them is kept where a traversal is suspended, else not.
        if (node_visits + triangle_tests + other_steps >= frame.step_budget && !gathering) {
            push(slot, item);
            break;
        }
        other_steps += RAY_STEPS;
        has_item = false;
        var hit = item.hit;
        if (item.kind != LIGHTS) {
            var t_min = item.t_min;
            var after = item.after;
            var t_max = item.t_max;
            if (HAS_CONTACT) {
                if (gathering) {
                    t_min = contact.t;
                    after = contact.triangle;
                    t_max = min(contact.reach, t_max);
                }
            }
            hit = trace(item.origin, item.direction, t_min, after, t_max, item.kind == SHADOW);
            if (HAS_LONG_RAYS) {
                if (suspended) {
                    push(slot, item);
                    break;
                }
            }
            if (HAS_CONTACT) {
                var medium = 0u;
                if (hit.triangle != NO_HIT) {
                    medium = load_material(leaf_material(hit.leaf)).medium;
                }
                if (gathering) {
                    gathering = join_contact(hit, medium);
                } else if (medium != 0u) {
                    begin_contact(hit, medium, item.origin, item.direction);
                    gathering = true;
                } else {
                    no_contact(hit);
                }
                if (gathering) {
                    has_item = true;
                    continue;
                }
                hit = contact.hit;
                item.joined = contact.joined;
            }
            if (hit.triangle == NO_HIT) {
                arrive(item);
                continue;
            }
            if (item.kind == SHADOW) {
                if (HAS_TRANSPARENT_SHADOWS) {
                    if ((leaf_triangle(hit.leaf).entry & LEAF_TRANSPARENT) == 0u) {
                        continue;
                    }
                } else {
                    continue;
                }
            }
        }
        var surface = surface_at(hit, item.origin, item.direction);
        if (HAS_CONTACT) {
            if (item.joined) {
                // Rays start clear of all faces in this place, whichever is shaded.
                let height = contact_height(leaf_positions(hit.leaf));
                surface.position_error = max(surface.position_error, vec3f(1.5 * height));
            }
        }
        var crossing = Crossing(item.media, false, false);
        if (HAS_SOLIDS) {
            if (item.kind == LIGHTS) {
                crossing.through = item.through;
            }
        }
        if (item.kind != LIGHTS) {
            if (HAS_MASK) {
                if (cut_out(surface)) {
                    item.t_min = hit.t;
                    item.after = hit.triangle;
                    has_item = true;
                    continue;
                }
            }
            if (HAS_ABSORPTION) {
                item.throughput *= medium_transmittance(item.media, hit.t);
            }
            if (HAS_SOLIDS) {
                crossing = crossing_at(surface, item.media);
            }
        }
        if (HAS_STRAIGHT_ON) {
            if (item.kind == SHADOW || crossing.hidden) {
                item = straight_on(item, surface, crossing, hit.t);
                has_item = item.kind != LIGHTS;
                continue;
            }
        }
        let made = interface_between(surface, -item.rest, item.media, crossing.through);
        if (item.kind == RADIANCE) {
            shade(slot, item, surface, crossing, made);
            item.light = 0u;
            item.kind = LIGHTS;
            item.hit = hit;
            item.through = crossing.through;
        }
        if (HAS_LIGHTS) {
            if ((surface.flags & MATERIAL_UNLIT) == 0u) {
                item = next_shadow_ray(slot, item, surface, made);
                has_item = item.kind == SHADOW;
            }
        }
    }
    var suspended_in = 0u;
    if (HAS_LONG_RAYS) {
        suspended_in = select(0u, select(SUSPENDED_TRAVERSAL, SUSPENDED_CONTACT, gathering), suspended);
        if (HAS_CONTACT) {
            if (suspended_in == SUSPENDED_CONTACT) {
                store_contact();
            }
        }
    }
    slots[slot] = Slot(radiance, pending | suspended_in, next_sample, rays, common_rays);
    return finished;
}
