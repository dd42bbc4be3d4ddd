// One traversal for every kind of ray. It must be called from one place in a kernel: lavapipe inlines each call.

// Work done by this invocation in this iteration: for statistics, and, a step each, for who may not take too long.
var<private> node_visits: u32;
var<private> triangle_tests: u32;
var<private> steps: u32;

// Where node visits and triangle tests of this iteration end, in the midst of a ray if need be: what the ray has found and what it
// has still to visit is left here and in its stack, and the next iteration goes on with it.
var<private> suspended: bool; // the ray last traced, which is also the next
var<private> left_traversal: Traversal;

// A suspended traversal but for the lower part of its stack, in words of `state`.
const TRAVERSAL_WORDS: u32 = 4u;
alias Traversal = array<vec4u, TRAVERSAL_WORDS>;

// Three numbers in a word: the stack's height, its pairs below the variables, and the height at which the scene's own triangles were left.
const HEIGHTS_BITS: u32 = 10u;
const HEIGHTS_MASK: u32 = 0x3ffu;

// The traversal has come to `group`.
fn suspend(hit: Hit, group: vec2u) {
    var heights = groups.height | (groups.pairs_below << HEIGHTS_BITS);
    var entered = 0u;
    if (HAS_INSTANCES) {
        heights |= entered_height << (2u * HEIGHTS_BITS);
        entered = within;
    }
    left_traversal = Traversal(
        word_of_hit(hit), vec4u(group, heights, entered), vec4u(groups.top, groups.second), vec4u(groups.third, groups.fourth),
    );
    suspended = true;
}

// What it had found. The group that it had come to, and the instance it was in: left_traversal[1].
fn resume() -> Hit {
    let words = left_traversal;
    let heights = words[1].z;
    groups = TraversalStack(
        words[2].xy, words[2].zw, words[3].xy, words[3].zw, heights & HEIGHTS_MASK, (heights >> HEIGHTS_BITS) & HEIGHTS_MASK,
    );
    if (HAS_INSTANCES) {
        met = met_of_word(words[0]);
        entered_height = heights >> (2u * HEIGHTS_BITS);
    }
    suspended = false;
    return hit_of_word(words[0]);
}

// The closest hit with t in (start, t_max), or at a start other than 0 with a triangle index above `left`; never triangle
// `left` itself, the one that the ray has just left: a plane is met once. Nor anything at t = 0: on a plane whose points have
// no error the origin was not moved, and its neighbour in that plane has been left as well. Of hits at equal t the lowest
// triangle index counts. A shadow ray ends at the first opaque triangle that it finds, closest or not.
//
// Without HAS_ERROR_BOUNDS a ray starts in the hit point itself, and no hit nearer than the tolerance counts.
fn trace(origin: vec3f, direction: vec3f, start: f32, left: u32, t_max: f32, shadow: bool) -> Hit {
    var t_min = start;
    var after = left;
    if (!HAS_ERROR_BOUNDS) {
        t_min = select(max(start, frame.tolerance), start, start < 0.0); // camera rays start in front of what is behind them
        after = NO_HIT;
    }
    var hit = Hit(t_max, NO_HIT, 0u, false);
    if (HAS_INSTANCES) {
        met = 0u;
    }
    var ray = box_ray(origin, direction);
    if (HAS_INSTANCES) {
        ray = ray_without(origin, direction);
    }
    var view: View;
    if (HAS_WATERTIGHT) {
        view = view_along(direction);
    }
    groups.height = 0u;
    groups.pairs_below = 0u;
    var group = vec2u(0u, 0x80000000u); // the root, which a scene without triangles has as well
    if (HAS_LONG_RAYS) {
        if (suspended) {
            hit = resume();
            group = left_traversal[1].xy;
            if (HAS_INSTANCES) {
                if (left_traversal[1].w != 0u) {
                    ray = ray_within(left_traversal[1].w, origin, direction);
                }
            }
        }
    }
    loop {
        if (HAS_LONG_RAYS) {
            if (steps >= frame.step_budget) {
                suspend(hit, group);
                break;
            }
        }
        if (HAS_INSTANCES) {
            instance_bits = 0u;
            if ((group.x & INSTANCE_GROUP) != 0u) {
                // The next place of a mesh; those that remain for later.
                let offset = firstTrailingBit(group.y & 0x00ffffffu);
                let leaf = (group.x & ~INSTANCE_GROUP) + offset;
                let others = vec2u(group.x, group.y & ~(1u << offset));
                if ((others.y & 0x00ffffffu) != 0u) {
                    push_group(others);
                }
                entered_height = groups.height;
                ray = ray_within(leaf_instance(leaf), origin, direction);
                group = vec2u(instance_root(within), 0x80000000u);
            }
        }
        // Take the next node of the group; keep what remains of the group for later.
        let bit = firstLeadingBit(group.y);
        let which_inner = group.y & 0xffu;
        var rest = vec2u(group.x, group.y & ~(1u << bit));
        let slot = (bit - 24u) ^ (ray.octant & 0xffu);
        let child = group.x + countOneBits(which_inner & ~(0xffffffffu << slot));
        let node = load_node(child);
        let bits = intersect_node(ray, node, t_min, hit.t);
        if (HAS_COUNTERS) {
            node_visits += 1u;
        }
        group = vec2u(node.first_child, (bits & 0xff000000u) | node.inner);

        var leaf_bits = bits & 0x00ffffffu;
        if (HAS_LONG_RAYS) {
            // Of a shadow ray, some of the tests may be spared; it has ended then.
            steps += 1u + countOneBits(leaf_bits);
        }
        while (leaf_bits != 0u) {
            let offset = firstTrailingBit(leaf_bits);
            leaf_bits &= leaf_bits - 1u;
            let leaf = node.first_leaf + offset;
            var corners = leaf_positions(leaf);
            if (HAS_INSTANCES) {
                if (corners.normal.x == INSTANCE_NORMAL) {
                    instance_bits |= 1u << offset;
                    continue;
                }
                corners = placed(corners);
            }
            var found: TriangleHit;
            if (HAS_WATERTIGHT) {
                found = intersect_triangle(origin, direction, view, corners);
            } else {
                found = moeller_trumbore(origin, direction, corners.v0, corners.v1, corners.v2);
            }
            if (HAS_COUNTERS) {
                triangle_tests += 1u;
            }
            if (!found.valid) {
                continue;
            }
            let t = distance_to(found);
            if (t < t_min || t > hit.t) {
                continue;
            }
            let entry = leaf_triangle(leaf).entry;
            var triangle = entry & LEAF_TRIANGLE;
            if (HAS_INSTANCES) {
                triangle += placement.first;
            }
            let closer = t < hit.t || triangle < hit.triangle;
            let beyond = t > t_min || (t_min != 0.0 && triangle > after);
            if (!closer || !beyond || triangle == after) {
                continue;
            }
            // Met in its corner, at no distance: how far its plane seems to be is rounding.
            if (all(corners.v0 == origin) || all(corners.v1 == origin) || all(corners.v2 == origin)) {
                continue;
            }
            if (HAS_CULLING) {
                if (found.slope > 0.0 && !shadow && (entry & LEAF_CULLED) != 0u) {
                    continue;
                }
            }
            hit = Hit(t, triangle, leaf, found.slope > 0.0);
            if (HAS_INSTANCES) {
                met = within;
            }
            if (shadow) {
                if (HAS_TRANSPARENT_SHADOWS) {
                    if ((entry & LEAF_TRANSPARENT) != 0u) {
                        continue;
                    }
                }
                return hit;
            }
        }

        if (HAS_INSTANCES) {
            if (instance_bits != 0u) {
                // Before the nodes of this group, and those of the one above.
                if (group.y > 0x00ffffffu) {
                    if (rest.y > 0x00ffffffu) {
                        push_group(rest);
                    }
                    rest = group;
                }
                group = vec2u(node.first_leaf | INSTANCE_GROUP, instance_bits | 0xff000000u);
            }
        }
        if (group.y > 0x00ffffffu) {
            if (rest.y > 0x00ffffffu) {
                push_group(rest);
            }
        } else if (rest.y > 0x00ffffffu) {
            group = rest;
        } else {
            if (groups.height == 0u) {
                break;
            }
            if (HAS_INSTANCES) {
                if (within != 0u && groups.height == entered_height) {
                    ray = ray_without(origin, direction);
                }
            }
            group = pop_group();
        }
    }
    return hit;
}
