// The trees' temporary picture into the frame, by depth (She §3.4): the depth test of the pipeline keeps what is nearer. Only the
// tiles that trees touch are drawn.
#import shared/tile

@group(0) @binding(0) var tree_depth: texture_depth_2d;
@group(0) @binding(1) var tree_color: texture_2d<f32>;
@group(0) @binding(2) var<storage, read> tiles: array<u32>;

struct Seen {
    @builtin(position) position: vec4f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Seen {
    let corner = vec2u(vertex & 1u, vertex >> 1u);
    let at = vec2f(tile_corner(tiles[instance]) + corner * TILE_PX) / vec2f(textureDimensions(tree_depth));
    return Seen(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0));
}

struct Drawn {
    // Premultiplied.
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(seen: Seen) -> Drawn {
    let at = vec2i(seen.position.xy);
    let depth = textureLoad(tree_depth, at, 0);
    if depth == 0.0 {
        discard;
    }
    return Drawn(textureLoad(tree_color, at, 0), depth);
}
