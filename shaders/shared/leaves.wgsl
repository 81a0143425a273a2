// Leaves that are on their way into the one that replaces them (Rebollo §IV-A): of each pair the heir grows into it, the other shrinks.
#import shared/frame

// A vertex of a leaf, the tree that it stands on, and what it becomes: gpu::layout::Vertex, Instance and Becoming.
struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) place: vec4f,
    @location(4) rotation: vec4f,
    @location(5) id: vec2u,
    @location(6) becomes_position: vec3f,
    @location(7) cluster: u32,
    @location(8) becomes_normal: vec3f,
    @location(9) heir: u32,
}

// Of one tree: the level, the number of clusters and two unused; of each cluster what it is making, from which level and to which, and one
// unused.
@group(3) @binding(0) var<storage, read> levels: array<vec4f>;

struct LeafVertex {
    // Object space.
    position: vec3f,
    normal: vec3f,
}

// Where a corner is on its way.
fn on_its_way(at: Corner) -> LeafVertex {
    let ends = levels[1u + at.cluster].yz;
    let t = saturate((levels[0].x - ends.x) / max(ends.y - ends.x, 1e-6));
    // Where the faces are turned against each other the normal goes over in one step, since there is none between.
    let normal = mix(at.normal, at.becomes_normal, t);
    let long = length(normal);
    let grown = LeafVertex(
        mix(at.position, at.becomes_position, t),
        select(at.becomes_normal, normal / max(long, 1e-6), long > 0.1),
    );
    // Its area shrinks evenly.
    let shrunk = LeafVertex(mix(at.becomes_position, at.position, sqrt(1.0 - t)), at.normal);
    let heir = at.heir == 1u;
    return LeafVertex(select(shrunk.position, grown.position, heir), select(shrunk.normal, grown.normal, heir));
}
