// A vertex of a mesh and the tree that it belongs to: gpu::layout::Vertex and Instance.
#import shared/place
struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) place: vec4f,
    @location(4) rotation: vec4f,
    @location(5) id: vec2u,
}

fn tree_of(corner: Corner) -> Standing {
    return standing(corner.place, corner.rotation);
}

// Slot of its first crown among those that grow; 0 where none does.
fn growing_slot(corner: Corner) -> u32 {
    return corner.id.y;
}
