// Groups of children that a traversal has still to visit: (first child, bits of those still to visit in the upper byte | which children
// are inner nodes). The uppermost are variables and move up and down by one, since to store at an index that differs by lane takes a
// branch for each lane. What few rays have below them moves two groups at a time: to storage where a traversal may be suspended,
// which it can leave there; to an array elsewhere.

const STACK_VARIABLES: u32 = 4u;

struct TraversalStack {
    top: vec2u,
    second: vec2u,
    third: vec2u,
    fourth: vec2u,
    height: u32, // of all groups
    pairs_below: u32,
}

var<private> groups: TraversalStack;
var<private> below: array<vec4u, (TRAVERSAL_STACK - STACK_VARIABLES + 1u) / 2u>;

// Whose storage it is, where it lies there.
var<private> traversal_slot: u32;

fn pair_word(pair: u32) -> u32 {
    return traversal_word(traversal_slot) + TRAVERSAL_WORDS + pair;
}

fn push_group(group: vec2u) {
    if (groups.height - 2u * groups.pairs_below == STACK_VARIABLES) {
        let pair = vec4u(groups.third, groups.fourth);
        if (HAS_LONG_RAYS) {
            state[pair_word(groups.pairs_below)] = pair;
        } else {
            below[groups.pairs_below] = pair;
        }
        groups.pairs_below += 1u;
    }
    groups.fourth = groups.third;
    groups.third = groups.second;
    groups.second = groups.top;
    groups.top = group;
    groups.height += 1u;
}

// There has to be one.
fn pop_group() -> vec2u {
    if (groups.height == 2u * groups.pairs_below) {
        groups.pairs_below -= 1u;
        var pair: vec4u;
        if (HAS_LONG_RAYS) {
            pair = state[pair_word(groups.pairs_below)];
        } else {
            pair = below[groups.pairs_below];
        }
        groups.top = pair.xy;
        groups.second = pair.zw;
    }
    let group = groups.top;
    groups.top = groups.second;
    groups.second = groups.third;
    groups.third = groups.fourth;
    groups.height -= 1u;
    return group;
}
