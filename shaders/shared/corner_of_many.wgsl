// A vertex of a mesh and which of many placed trees it belongs to: gpu::layout::Vertex, and a number in a list of what is seen. Stands in for
// shared/corner; nothing grows on it.
#instead-of shared/corner
#import shared/place

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) which: u32,
}

// Mirrors gpu::layout::Placed.
struct Placed {
    position: vec3f,
    turn_and_scale: u32,
}

@group(3) @binding(0) var<storage, read> many: array<Placed>;

fn tree_of(corner: Corner) -> Standing {
    let placed = many[corner.which];
    let turn_and_scale = unpack2x16float(placed.turn_and_scale);
    let half_turn = 3.14159265 * turn_and_scale.x;
    return Standing(placed.position, turn_and_scale.y, vec4f(0.0, sin(half_turn), 0.0, cos(half_turn)));
}

fn growing_slot(_corner: Corner) -> u32 {
    return 0u;
}
