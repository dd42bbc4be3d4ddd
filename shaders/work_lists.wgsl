// Which pixels have a ray to trace. One iteration traces the rays of a list and shades what they hit; pixels that have a ray left
// are put on the next iteration's list, so that vectors of lanes stay full however their trees differ. In what order they come
// there does not matter: a pixel's sum is its own.
//
// A list has parts, each with a length of its own. A dispatch has a row of workgroups for each; a processor's threads take rows, so that
// those of up to 16 add to different lengths, one entry after the other, and hardly wait for each other. Barriers in a workgroup would do as
// well, but cost lavapipe a memory fence each, and a coroutine a vector. A slot stays in its part; parts have slots from all over
// the picture, and so about as much to do.

const NO_ENTRY: u32 = 0xffffffffu;

// An entry: a slot, the level of its stack that the ray lies at, and where in it the last iteration ended.
const ENTRY_SLOT: u32 = 0xfffffu;
const ENTRY_LEVEL_SHIFT: u32 = 20u;
const ENTRY_LEVEL: u32 = 0x3ffu;
const CAMERA_LEVEL: u32 = 0x3ffu; // instead of a level: the slot's camera ray, which nothing is stored of
const ENTRY_SUSPENDED: u32 = 0x40000000u; // in the midst of its traversal
const ENTRY_GATHERING: u32 = 0x80000000u; // faces in contact are gathered

fn entry_of(slot: u32, level: u32) -> u32 {
    return slot | (level << ENTRY_LEVEL_SHIFT);
}

fn entry_slot(entry: u32) -> u32 {
    return entry & ENTRY_SLOT;
}

fn entry_level(entry: u32) -> u32 {
    return (entry >> ENTRY_LEVEL_SHIFT) & ENTRY_LEVEL;
}

const LIST_WORKGROUP: u32 = 64u;

// Where the lengths begin in list_in, and how far apart they are, in its words.
const LENGTHS_WORD: u32 = 1u;
const PART_WORDS: u32 = 4u;

// How many entries a part of the list has.
fn part_length(part: u32) -> u32 {
    return list_in[LENGTHS_WORD + part * PART_WORDS].x;
}

// Where an entry lies: parts take turns, a workgroup each.
fn place_in_list(part: u32, place: u32) -> u32 {
    return (place / LIST_WORKGROUP * LIST_PARTS + part) * LIST_WORKGROUP + place % LIST_WORKGROUP;
}

// Puts an entry on the next list.
fn append(entry: u32, part: u32) {
    let place = atomicAdd(&list_out.lengths[part].entries, 1u);
    if (place % LIST_WORKGROUP == 0u) {
        atomicMax(&list_out.workgroups, place / LIST_WORKGROUP + 1u);
    }
    queue_out[place_in_list(part, place)] = entry;
}

// What a traced ray has found.
struct Traced {
    hit: Hit,
    suspended: bool, // its traversal goes on in the next iteration
}

const TRACED_SUSPENDED: u32 = 2u; // beside HIT_BACK

// What the ray of a slot has found, and what its traversal leaves if it is suspended.
fn store_traced(index: u32, slot: u32, hit: Hit) {
    let word = word_of_hit(hit);
    if (HAS_LONG_RAYS) {
        let end = loop_end(select(1u, 1u + TRAVERSAL_WORDS, suspended));
        for (var k = 0u; k < end; k++) {
            var stored = word | vec4u(0u, 0u, 0u, select(0u, TRACED_SUSPENDED, suspended));
            stored = select(stored, left_traversal[0], k == 1u);
            stored = select(stored, left_traversal[1], k == 2u);
            stored = select(stored, left_traversal[2], k == 3u);
            stored = select(stored, left_traversal[3], k == 4u);
            state[select(traversal_word(slot) + k - 1u, hit_word(index), k == 0u)] = stored;
        }
    } else {
        state[hit_word(index)] = word;
    }
}

fn traced_of(word: vec4u) -> Traced {
    return Traced(hit_of_word(word), (word.w & TRACED_SUSPENDED) != 0u);
}
