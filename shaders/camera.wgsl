// Camera rays (README.md, "Rays").

struct Ray {
    origin: vec3f,
    direction: vec3f, // unit length
    t_min: f32, // where it begins
}

// The ray through `pixel` of the whole picture, `offset` pixels from its middle. A camera that has the whole scene before it has
// its rays start on a plane through the scene instead, and look both ways along them (crates/gpu/camera.rs): f32 can't hold
// the place of a camera a million extents away, nor directions that differ by a pixel in a field of a thousandth of a degree.
fn camera_ray(pixel: vec2u, offset: vec2f) -> Ray {
    let place = (vec2f(pixel) + 0.5 + offset) / frame.picture_size;
    let x = 2.0 * place.x - 1.0;
    let y = 1.0 - 2.0 * place.y;
    let origin = frame.ray_start + (x * frame.start_right + y * frame.start_up);
    if (HAS_ORTHOGRAPHIC) {
        return Ray(origin, frame.camera_forward, frame.start_t);
    }
    let sideways = x * frame.camera_right + y * frame.camera_up;
    return Ray(origin, normalize(frame.camera_forward + sideways), frame.start_t);
}

// A workgroup's tile. Neighbouring workgroups take tiles that lie apart: llvmpipe hands each of its threads one contiguous
// run of workgroups, and neighbouring tiles cost alike.
fn tile_of_workgroup(workgroup: u32) -> u32 {
    return frame.first_tile + (workgroup * frame.tile_stride) % frame.tile_count;
}

// The pixel of a lane, relative to the window: tiles of 8x8, in them blocks of 4x2, so that the lanes of a vector stay close.
fn pixel_of_lane(tile: u32, lane: u32) -> vec2u {
    let corner = 8u * vec2u(tile % frame.tile_columns, tile / frame.tile_columns);
    let block = lane / 8u;
    return corner + vec2u((block % 2u) * 4u + lane % 4u, (block / 2u) * 2u + (lane / 4u) % 2u);
}

// The pixel of a slot of a batch, relative to the window.
fn pixel_of_slot(slot: u32) -> vec2u {
    return pixel_of_lane(tile_of_workgroup(slot / LIST_WORKGROUP), slot % LIST_WORKGROUP);
}

fn inside_window(pixel: vec2u) -> bool {
    return all(pixel < frame.window_size);
}
