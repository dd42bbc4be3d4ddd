// Faces of solids that lie in one place are crossed as one: README.md, "Contact". They are gathered along the ray, in the order
// (t, triangle) and with no offset, before anything is shaded: a refracted ray that left from behind the first face would never
// meet the others.

// Of the largest coordinate of a triangle, 2^-21: four roundings of its corners, and of another's in the same plane.
const CONTACT_SHARE: f32 = 4.7683716e-7;

// Planes that lie in one place are parallel but for the rounding of small triangles.
const CONTACT_COSINE: f32 = 0.999;

// More faces than this are not looked for: copies of copies.
const CONTACT_FACES: u32 = 32u;

struct Contact {
    hit: Hit, // the face that is shaded: of the medium of the highest rank, or an opaque one
    position: vec3f, // on the first face
    normal: vec3f, // of the first face
    height: f32, // how far apart the planes may lie
    reach: f32, // t of the furthest face that may be one of them
    t: f32, // of the face found last
    triangle: u32, // .. in the order (t, triangle)
    faces: u32, // found so far
    joined: bool, // some of them lies in the place of the first
    left: vec2u, // media that are left, each once, the highest rank lowest
    entered: vec2u,
}

var<private> contact: Contact;
var<private> contact_met: u32; // what `contact.hit` lies on: `met`

// Its hit is the one at hand.
fn shade_contact(hit: Hit) {
    contact.hit = hit;
    if (HAS_INSTANCES) {
        contact_met = met;
    }
}

fn contact_height(corners: Vertices) -> f32 {
    let largest = max(abs(corners.v0), max(abs(corners.v1), abs(corners.v2)));
    return CONTACT_SHARE * max(largest.x, max(largest.y, largest.z));
}

// With `medium`, once; sorted by rank.
fn with_medium(ranked: vec2u, medium: u32) -> vec2u {
    var above = 0u;
    for (var k = 0u; k < MEDIA_DEPTH; k++) {
        let entry = medium_at(ranked, k);
        if (entry == medium) {
            return ranked;
        }
        above += select(0u, 1u, entry > medium);
    }
    return insert_medium(ranked, medium, above);
}

// The first face, at `hit`.
fn begin_contact(hit: Hit, medium: u32, origin: vec3f, direction: vec3f) {
    let corners = met_positions(hit.leaf);
    let along_1 = corners.v1 - corners.v0;
    let along_2 = corners.v2 - corners.v0;
    let uv = barycentrics(origin, direction, corners.v0, corners.v1, corners.v2);
    shade_contact(hit);
    contact.position = corners.v0 + (uv.x * along_1 + uv.y * along_2);
    contact.normal = corners.normal;
    contact.height = contact_height(corners);
    // How far off t is grows with the distance: what lies within is looked at more closely.
    let off = contact.height + gamma(8.0) * dot(abs(contact.normal), abs(corners.v0 - origin));
    contact.reach = hit.t + off / max(abs(dot(contact.normal, direction)), 1e-6);
    contact.t = hit.t;
    contact.triangle = hit.triangle;
    contact.faces = 1u;
    contact.joined = false;
    contact.left = select(vec2u(0u), vec2u(medium, 0u), hit.back);
    contact.entered = select(vec2u(medium, 0u), vec2u(0u), hit.back);
}

// A further face, or what else lies beyond the first; false: the crossing is known.
fn join_contact(hit: Hit, medium: u32) -> bool {
    if (hit.triangle == NO_HIT || contact.faces >= CONTACT_FACES) {
        return false;
    }
    contact.t = hit.t;
    contact.triangle = hit.triangle;
    contact.faces += 1u;
    let corners = met_positions(hit.leaf);
    let apart = abs(dot(corners.normal, contact.position - corners.v0));
    if (abs(dot(corners.normal, contact.normal)) < CONTACT_COSINE || apart > contact.height) {
        return true;
    }
    if (medium == 0u) {
        if ((leaf_triangle(hit.leaf).entry & LEAF_TRANSPARENT) != 0u) {
            return true;
        }
        // Nothing is left or entered in front of an opaque face.
        contact.joined = true;
        shade_contact(hit);
        contact.left = vec2u(0u);
        contact.entered = vec2u(0u);
        return false;
    }
    contact.joined = true;
    let ranks = max(innermost_medium(contact.left), innermost_medium(contact.entered));
    if (medium > ranks) {
        shade_contact(hit);
    }
    if (hit.back) {
        contact.left = with_medium(contact.left, medium);
    } else {
        contact.entered = with_medium(contact.entered, medium);
    }
    return true;
}

// Nothing but the one face.
fn no_contact(hit: Hit) {
    shade_contact(hit);
    contact.joined = false;
    contact.left = vec2u(0u);
    contact.entered = vec2u(0u);
}

// What was gathered, crossed: first left, then entered, the lowest rank first.
fn cross_contact(stack: vec2u) -> Crossing {
    var through = stack;
    var full = false;
    for (var k = 0u; k < MEDIA_DEPTH; k++) {
        let medium = medium_at(contact.left, k);
        if (medium != 0u) {
            through = leave_medium(through, medium);
        }
    }
    let crossed = any(through != stack) || any(contact.entered != vec2u(0u));
    for (var k = MEDIA_DEPTH; k > 0u; k--) {
        let medium = medium_at(contact.entered, k - 1u);
        if (medium != 0u) {
            full = full || media_full(through);
            through = enter_medium(through, medium);
        }
    }
    return crossing_between(stack, through, crossed, full);
}

// Faces that are gathered are kept from iteration to iteration, beside a suspended traversal.
fn store_contact() {
    let hit = contact.hit;
    if (HAS_INSTANCES) {
        met = contact_met;
    }
    let words = Words(
        word_of_hit(hit),
        vec4u(bitcast<vec3u>(contact.position), bitcast<u32>(contact.height)),
        vec4u(bitcast<vec3u>(contact.normal), bitcast<u32>(contact.reach)),
        vec4u(bitcast<u32>(contact.t), contact.triangle, contact.faces, select(0u, 1u, contact.joined)),
        vec4u(contact.left, contact.entered),
    );
    store_words(contact_word(traversal_slot), words, CONTACT_WORDS);
}

fn load_contact() {
    let words = load_words(contact_word(traversal_slot), CONTACT_WORDS);
    let first = words[1];
    let plane = words[2];
    let last = words[3];
    let sides = words[4];
    contact.hit = hit_of_word(words[0]);
    if (HAS_INSTANCES) {
        contact_met = met_of_word(words[0]);
    }
    contact.position = bitcast<vec3f>(first.xyz);
    contact.height = bitcast<f32>(first.w);
    contact.normal = bitcast<vec3f>(plane.xyz);
    contact.reach = bitcast<f32>(plane.w);
    contact.t = bitcast<f32>(last.x);
    contact.triangle = last.y;
    contact.faces = last.z;
    contact.joined = last.w != 0u;
    contact.left = sides.xy;
    contact.entered = sides.zw;
}
