// Capacities that size arrays. An override can't do that, so the host replaces these lines for each program
// (crates/gpu/source.rs); the values here are what an editor or naga-cli sees.

// Entries of the traversal stack: the depth of the BVH, rounded up.
const TRAVERSAL_STACK: u32 = 32u;
