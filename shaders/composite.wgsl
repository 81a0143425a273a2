// The trees' temporary picture into the frame, by depth (She §3.4): the depth test of the pipeline keeps what is nearer.
#import shared/screen

@group(0) @binding(0) var tree_color: texture_2d<f32>;
@group(0) @binding(1) var tree_depth: texture_depth_2d;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Screen {
    return screen(vertex);
}

struct Drawn {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(seen: Screen) -> Drawn {
    let at = vec2i(seen.position.xy);
    let depth = textureLoad(tree_depth, at, 0);
    if depth == 0.0 {
        discard;
    }
    return Drawn(textureLoad(tree_color, at, 0), depth);
}
