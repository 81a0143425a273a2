// One of many placed trees.
#import shared/place

// Mirrors gpu::layout::Placed.
struct Placed {
    position: vec3f,
    turn_and_scale: u32,
}

fn standing_of(placed: Placed) -> Standing {
    let turn_and_scale = unpack2x16float(placed.turn_and_scale);
    let half_turn = 3.14159265 * turn_and_scale.x;
    return Standing(placed.position, turn_and_scale.y, vec4f(0.0, sin(half_turn), 0.0, cos(half_turn)));
}
