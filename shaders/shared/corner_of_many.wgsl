// A vertex of a mesh and which of many placed trees it belongs to: gpu::layout::Vertex, and a number in a list of what is seen. Stands in for
// shared/corner; nothing grows on it.
#instead-of shared/corner
#import shared/many

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) which: u32,
}

@group(3) @binding(0) var<storage, read> many: array<Placed>;

fn tree_of(corner: Corner) -> Standing {
    return standing_of(many[corner.which]);
}

fn growing_slot(_corner: Corner) -> u32 {
    return 0u;
}
