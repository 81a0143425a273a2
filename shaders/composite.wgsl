// The trees' temporary picture into the frame, by depth (She §3.4): the depth test of the pipeline keeps what is nearer. Only the
// tiles that trees touch are drawn.
#import shared/outline
#import shared/tile

@group(1) @binding(1) var tree_color: texture_2d<f32>;
@group(1) @binding(2) var<storage, read> tiles: array<u32>;

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

// Whole pixels.
@fragment
fn fs_main(seen: Seen) -> Drawn {
    let at = vec2i(seen.position.xy);
    let depth = depth_of(at);
    if depth == 0.0 {
        discard;
    }
    return Drawn(textureLoad(tree_color, at, 0), depth);
}

// What is left of pixels where the outline cuts them.
@fragment
fn fs_main_smooth(seen: Seen) -> Drawn {
    let at = vec2i(seen.position.xy);
    let depth = depth_of(at);
    if depth == 0.0 {
        discard;
    }
    var color = textureLoad(tree_color, at, 0);
    for (var side = 0u; side < 4u; side++) {
        let outer = at + side_step(side);
        let beyond = depth_of(outer);
        if is_before(depth, beyond) {
            let lost = outline_area(at, outer, beyond).x;
            // Behind stands another tree, or what the frame already holds.
            color = mix(color, select(vec4f(0.0), textureLoad(tree_color, outer, 0), beyond > 0.0), lost);
        }
    }
    return Drawn(color, depth);
}

// What the outline gains of the pixels beyond it. Drawn after fs_main_smooth, without writing depth.
@fragment
fn fs_main_fringe(seen: Seen) -> Drawn {
    let at = vec2i(seen.position.xy);
    let depth = depth_of(at);
    var color = vec4f(0.0);
    var nearest = 0.0;
    for (var side = 0u; side < 4u; side++) {
        let inner = at + side_step(side);
        let before = depth_of(inner);
        if is_before(before, depth) {
            color += textureLoad(tree_color, inner, 0) * outline_area(inner, at, depth).y;
            nearest = max(nearest, before);
        }
    }
    if color.a == 0.0 {
        discard;
    }
    return Drawn(color / max(color.a, 1.0), nearest);
}
