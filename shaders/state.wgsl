// What kernels leave for each other: one list of texel-sized words. First come the slots' sums, then what the rays on the list hit, then
// the ray stacks, level by level, and at last faces in contact and what suspended traversals keep. What belongs together lies side by side, in a cache line if it
// can: soon few slots are left on the list, far from each other and each at a level of its own. In a storage buffer, since lavapipe
// takes 20 times as long to store a texel; but a load from one, or a store, is much code (30 ms to compile), so what is more than a word
// goes through loops whose end drivers can't know: they would unroll them.

const SLOT_WORDS: u32 = 2u; // Slot
const HIT_WORDS: u32 = 1u; // of a hit
const ITEM_WORDS: u32 = 4u; // of pending work, as much of it as is in use: frame.item_words

// The first word of a slot.
fn slot_word(slot: u32) -> u32 {
    return slot * SLOT_WORDS;
}

// That of a place on the list: what its ray hit.
fn hit_word(index: u32) -> u32 {
    return frame.slot_count * SLOT_WORDS + index;
}

// The first word of an item on a slot's stack.
fn item_word(slot: u32, level: u32) -> u32 {
    return frame.slot_count * (SLOT_WORDS + HIT_WORDS) + (level * frame.slot_count + slot) * frame.item_words;
}

// Behind the stacks, of each slot, as far as a program has them: faces in contact while they are gathered, what a traversal leaves when it
// is suspended, and the lower part of its stack, two groups in a word, which lies there at any time.

fn contact_word(slot: u32) -> u32 {
    return item_word(0u, frame.stack_capacity + extra_items()) + slot * frame.beside_stack_words;
}

fn traversal_word(slot: u32) -> u32 {
    if (HAS_CONTACT) {
        return contact_word(slot) + CONTACT_WORDS;
    }
    return contact_word(slot);
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

// Where a loop ends that drivers are not to unroll. The 0 comes from storage: lavapipe before Mesa 23 compiles a kernel anew for
// each dispatch if numbers that lie in a uniform buffer alone decide how often a loop runs, or which way a condition goes.
fn loop_end(count: u32) -> u32 {
    return count + list_in[0].w;
}

// Words that belong together, one after the other.
const WORDS_AT_ONCE: u32 = 5u;
alias Words = array<vec4u, WORDS_AT_ONCE>;

// The first `count` of them.
fn store_words(first: u32, words: Words, count: u32) {
    let end = loop_end(count);
    for (var k = 0u; k < end; k++) {
        var word = words[0];
        word = select(word, words[1], k == 1u);
        word = select(word, words[2], k == 2u);
        word = select(word, words[3], k == 3u);
        word = select(word, words[4], k == 4u);
        state[first + k] = word;
    }
}

fn load_words(first: u32, count: u32) -> Words {
    var words: Words;
    let end = loop_end(count);
    for (var k = 0u; k < end; k++) {
        let word = state[first + k];
        words[0] = select(words[0], word, k == 0u);
        words[1] = select(words[1], word, k == 1u);
        words[2] = select(words[2], word, k == 2u);
        words[3] = select(words[3], word, k == 3u);
        words[4] = select(words[4], word, k == 4u);
    }
    return words;
}

// What a kernel takes up of a slot: what its suspended traversal has left, its words, that of its place on the list, and those of an
// item on its stack.
struct SlotState {
    traversal: Traversal,
    radiance: vec4u,
    counts: vec4u,
    hit: vec4u,
    item: array<vec4u, ITEM_WORDS>,
}

// Which of them is which.
const TRAVERSAL_WORD: u32 = 0u;
const RADIANCE_WORD: u32 = 4u;
const COUNTS_WORD: u32 = 5u;
const HIT_WORD: u32 = 6u;
const FIRST_ITEM_WORD: u32 = 7u;

const_assert RADIANCE_WORD == TRAVERSAL_WORD + TRAVERSAL_WORDS;
const_assert TRAVERSAL_WORDS == 4u; // those that load_state names
const_assert HIT_WORD == RADIANCE_WORD + SLOT_WORDS;
const_assert FIRST_ITEM_WORD == HIT_WORD + HIT_WORDS;
const_assert ITEM_WORDS == 4u; // those that load_state names

// Those from `first` on, up to before `end`.
fn load_state(first: u32, end: u32, slot: u32, index: u32, level: u32) -> SlotState {
    var loaded: SlotState;
    let of_traversal = traversal_word(slot) - TRAVERSAL_WORD;
    let of_slot = slot_word(slot) - RADIANCE_WORD;
    let of_hit = hit_word(index);
    let of_item = item_word(slot, level) - FIRST_ITEM_WORD;
    for (var k = first; k < end; k++) {
        var place = select(select(of_item + k, of_hit, k == HIT_WORD), of_slot + k, k < HIT_WORD);
        if (HAS_LONG_RAYS) {
            place = select(place, of_traversal + k, k < RADIANCE_WORD);
        }
        let word = state[place];
        if (HAS_LONG_RAYS) {
            loaded.traversal[0] = select(loaded.traversal[0], word, k == TRAVERSAL_WORD);
            loaded.traversal[1] = select(loaded.traversal[1], word, k == TRAVERSAL_WORD + 1u);
            loaded.traversal[2] = select(loaded.traversal[2], word, k == TRAVERSAL_WORD + 2u);
            loaded.traversal[3] = select(loaded.traversal[3], word, k == TRAVERSAL_WORD + 3u);
        }
        loaded.radiance = select(loaded.radiance, word, k == RADIANCE_WORD);
        loaded.counts = select(loaded.counts, word, k == COUNTS_WORD);
        loaded.hit = select(loaded.hit, word, k == HIT_WORD);
        loaded.item[0] = select(loaded.item[0], word, k == FIRST_ITEM_WORD);
        loaded.item[1] = select(loaded.item[1], word, k == FIRST_ITEM_WORD + 1u);
        loaded.item[2] = select(loaded.item[2], word, k == FIRST_ITEM_WORD + 2u);
        loaded.item[3] = select(loaded.item[3], word, k == FIRST_ITEM_WORD + 3u);
    }
    return loaded;
}
