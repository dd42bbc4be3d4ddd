// What kernels leave for each other: one list of texel-sized words in planes, a word for each slot (or place on the list) in each.
// Lanes lie side by side, so that a vector of them reads one run of memory. In a storage buffer, since lavapipe takes 20 times
// as long to store a texel; but a load from one, or a store, is much code (30 ms to compile), so what is more than a word goes through
// loops whose end drivers can't know: they would unroll them.

const RADIANCE_PLANE: u32 = 0u; // by slot: Slot.radiance
const COUNTS_PLANE: u32 = 1u; // by slot: the rest of Slot
const HIT_PLANE: u32 = 2u; // by place on the list: what its ray hit
const STACK_PLANE: u32 = 3u; // by slot: the stack of pending work, ITEM_WORDS a level

fn store_word(plane: u32, place: u32, word: vec4u) {
    state[plane * frame.slot_count + place] = word;
}

fn load_word(plane: u32, place: u32) -> vec4u {
    return state[plane * frame.slot_count + place];
}

const HIT_BACK: u32 = 1u; // in a hit's last component, which has room for more

const MET_SHIFT: u32 = 2u; // above TRACED_SUSPENDED

fn word_of_hit(hit: Hit) -> vec4u {
    if (HAS_INSTANCES) {
        return vec4u(bitcast<u32>(hit.t), hit.triangle, hit.leaf, select(0u, HIT_BACK, hit.back) | (met << MET_SHIFT));
    }
    return vec4u(bitcast<u32>(hit.t), hit.triangle, hit.leaf, select(0u, HIT_BACK, hit.back));
}

fn hit_of_word(word: vec4u) -> Hit {
    return Hit(bitcast<f32>(word.x), word.y, word.z, (word.w & HIT_BACK) != 0u);
}

fn met_of_word(word: vec4u) -> u32 {
    return word.w >> MET_SHIFT;
}

// Words that belong together, in planes one above the other.
const WORDS_AT_ONCE: u32 = 5u;
alias Words = array<vec4u, WORDS_AT_ONCE>;

// The first `count` of them.
fn store_words(plane: u32, place: u32, words: Words, count: u32) {
    let end = count + frame.zero;
    for (var k = 0u; k < end; k++) {
        var word = words[0];
        word = select(word, words[1], k == 1u);
        word = select(word, words[2], k == 2u);
        word = select(word, words[3], k == 3u);
        word = select(word, words[4], k == 4u);
        store_word(plane + k, place, word);
    }
}

fn load_words(plane: u32, place: u32, count: u32) -> Words {
    var words: Words;
    let end = count + frame.zero;
    for (var k = 0u; k < end; k++) {
        let word = load_word(plane + k, place);
        words[0] = select(words[0], word, k == 0u);
        words[1] = select(words[1], word, k == 1u);
        words[2] = select(words[2], word, k == 2u);
        words[3] = select(words[3], word, k == 3u);
        words[4] = select(words[4], word, k == 4u);
    }
    return words;
}

// The words of a slot, of a place on the list, and of an item on the slot's stack.
struct SlotState {
    radiance: vec4u,
    counts: vec4u,
    hit: vec4u,
    item: array<vec4u, ITEM_WORDS>,
}

const_assert ITEM_WORDS == 4u; // those that load_state names

// Those of the planes from `first` on, up to before `end`, which is frame.state_planes at most.
fn load_state(first: u32, end: u32, slot: u32, index: u32, level: u32) -> SlotState {
    var loaded: SlotState;
    for (var plane = first; plane < end; plane++) {
        let place = select(slot, index, plane == HIT_PLANE);
        let above = select(0u, level * ITEM_WORDS, plane >= STACK_PLANE);
        let word = load_word(plane + above, place);
        loaded.radiance = select(loaded.radiance, word, plane == RADIANCE_PLANE);
        loaded.counts = select(loaded.counts, word, plane == COUNTS_PLANE);
        loaded.hit = select(loaded.hit, word, plane == HIT_PLANE);
        loaded.item[0] = select(loaded.item[0], word, plane == STACK_PLANE);
        loaded.item[1] = select(loaded.item[1], word, plane == STACK_PLANE + 1u);
        loaded.item[2] = select(loaded.item[2], word, plane == STACK_PLANE + 2u);
        loaded.item[3] = select(loaded.item[3], word, plane == STACK_PLANE + 3u);
    }
    return loaded;
}
