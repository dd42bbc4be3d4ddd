// Statistics of some dispatches. The host adds them up in 64 bits and clears them for the next one.

const ITERATIONS: u32 = 0u; // with a ray to trace; always counted
const PRIMARY_RAYS: u32 = 1u;
const SHADOW_RAYS: u32 = 2u;
const REFLECTION_RAYS: u32 = 3u;
const REFRACTION_RAYS: u32 = 4u;
const NODE_VISITS: u32 = 5u;
const TRIANGLE_TESTS: u32 = 6u;
const ENDED_MISS: u32 = 7u;
const ENDED_DEPTH: u32 = 8u;
const ENDED_WEIGHT: u32 = 9u;
const ENDED_TOLERANCE: u32 = 10u;
const COUNTERS: u32 = 11u;

var<private> tally: array<u32, COUNTERS>;

fn count(which: u32) {
    if (HAS_COUNTERS) {
        tally[which] += 1u;
    }
}

fn add_up_counters() {
    if (HAS_COUNTERS) {
        tally[NODE_VISITS] = node_visits;
        tally[TRIANGLE_TESTS] = triangle_tests;
        for (var k = 1u; k < COUNTERS; k++) {
            if (tally[k] > 0u) {
                atomicAdd(&counters[k], tally[k]);
            }
        }
    }
}
