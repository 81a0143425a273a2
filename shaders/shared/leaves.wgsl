// Leaves of many levels of detail, fetched by number (Rebollo §IV-A): what is shown of a tree is a list of them, and two of each cluster
// may be on their way into the one that replaces them: the heir grows into it, the other shrinks.
#import shared/frame

// Mirrors gpu::layout::LeafCorner: of an original leaf, four in a row.
struct LeafCorner {
    position: vec3f,
    u: f32,
    normal: vec3f,
    v: f32,
}

// Mirrors gpu::layout::Leaf.
struct Leaf {
    // Original · 8 + corner · 2 + whether the normal is turned round.
    corners: vec4u,
    // The original whose picture it wears.
    wears: u32,
    cluster: u32,
    // The leaf that replaces it.
    into: u32,
    // 1 when that one wears its picture.
    heir: u32,
}

@group(3) @binding(0) var<storage, read> leaf_corners: array<LeafCorner>;
@group(3) @binding(1) var<storage, read> leaves: array<Leaf>;
// Of one tree: the level, the number of clusters and two unused; of each cluster what it is making, from which level and to which, and one
// unused; then the leaves shown.
@group(3) @binding(2) var<storage, read> shown_leaves: array<u32>;

// A tree that leaves stand on: gpu::layout::Instance.
struct Bearer {
    @location(3) place: vec4f,
    @location(4) rotation: vec4f,
    @location(5) id: vec2u,
}

struct LeafVertex {
    // Object space.
    position: vec3f,
    normal: vec3f,
    uv: vec2f,
}

fn own_corner(leaf: Leaf, k: u32) -> LeafVertex {
    let code = leaf.corners[k];
    let own = leaf_corners[4u * (code >> 3u) + ((code >> 1u) & 3u)];
    let worn = leaf_corners[4u * leaf.wears + k];
    return LeafVertex(own.position, select(own.normal, -own.normal, (code & 1u) == 1u), vec2f(worn.u, worn.v));
}

// A corner on its way into that of the leaf that replaces it; `level`: where its cluster stands.
fn on_its_way(at: LeafVertex, leaf: Leaf, k: u32, level: u32) -> LeafVertex {
    let ends = vec2f(bitcast<f32>(shown_leaves[level + 1u]), bitcast<f32>(shown_leaves[level + 2u]));
    let t = saturate((bitcast<f32>(shown_leaves[0]) - ends.x) / max(ends.y - ends.x, 1e-6));
    if leaf.heir == 1u {
        let becomes = own_corner(leaves[leaf.into], k);
        // Where the faces are turned against each other the normal goes over in one step, since there is none between.
        let normal = mix(at.normal, becomes.normal, t);
        let long = length(normal);
        return LeafVertex(mix(at.position, becomes.position, t), select(becomes.normal, normal / max(long, 1e-6), long > 0.1), at.uv);
    }
    let middle = 0.25 * (own_corner(leaf, 0u).position + own_corner(leaf, 1u).position + own_corner(leaf, 2u).position + own_corner(leaf, 3u).position);
    // Its area shrinks evenly.
    return LeafVertex(mix(middle, at.position, sqrt(1.0 - t)), at.normal, at.uv);
}

// The vertex of that number, four for each leaf shown.
fn leaf_vertex(number: u32) -> LeafVertex {
    let clusters = shown_leaves[1];
    let leaf = leaves[shown_leaves[4u + 4u * clusters + number / 4u]];
    let k = number & 3u;
    let level = 4u + 4u * leaf.cluster;
    var vertex = own_corner(leaf, k);
    // Once or not at all: software drivers run both sides of every `if`, but leave out a loop that none of their vertices enters.
    for (var goes = leaf.into == shown_leaves[level]; goes; goes = false) {
        vertex = on_its_way(vertex, leaf, k, level);
    }
    return vertex;
}
