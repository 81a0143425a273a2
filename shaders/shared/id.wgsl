// The id target, one u32 per pixel: 12 bits slot of the crown (0: no crown, never grows) | 6 bits facing |n·v| | 14 bits place on the limb.
// Nothing is there where the depth is 0. Mirrored by render::growth_twin.
const PLACE_BITS: u32 = {PLACE_BITS};
const FACING_BITS: u32 = {FACING_BITS};
// Pixels that have grown: no slot, this bit, and how much of the pixel is covered in sixteenths.
const GROWN: u32 = {GROWN};

// One crown that is near enough to grow; mirrors gpu::layout::GrowingCrown.
struct GrowingCrown {
    // Object space to the plane of its limb (the outline of its ellipsoid as seen from the eye), half axes made 1.
    limb_x: vec3f,
    // Qmin and Qmax: sixteenths of a pixel per scale unit (1/256 pixel per metre).
    min_units: f32,
    limb_y: vec3f,
    max_units: f32,
    // What lies this much deeper is background, metres.
    gap_m: f32,
    // Its part of the limb table.
    first: u32,
    count: u32,
    pad: u32,
}

fn slot_of(id: u32) -> u32 {
    return id >> (PLACE_BITS + FACING_BITS);
}

// Where round the limb a point lies, 0..2^PLACE_BITS: the angle in the L1 norm, counter-clockwise from the right, which needs no arctangent.
fn limb_place(crown: GrowingCrown, from_center: vec3f) -> u32 {
    let at = vec2f(dot(from_center, crown.limb_x), dot(from_center, crown.limb_y));
    let size = abs(at.x) + abs(at.y);
    let t = at.y / max(size, 1e-20);
    let turn = select(2.0 - t, select(4.0 + t, t, at.y >= 0.0), at.x >= 0.0);
    return min(u32(turn * f32(1u << (PLACE_BITS - 2u))), (1u << PLACE_BITS) - 1u);
}

fn crown_id(slot: u32, crown: GrowingCrown, from_center: vec3f, facing: f32) -> u32 {
    let turned = u32(saturate(facing) * f32((1u << FACING_BITS) - 1u));
    return (slot << (PLACE_BITS + FACING_BITS)) | (turned << PLACE_BITS) | limb_place(crown, from_center);
}
