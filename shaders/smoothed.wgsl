// Pixels on smooth outlines as points into the frame, in the colours that they have in the end.
@group(0) @binding(0) var tree_depth: texture_depth_2d;
@group(0) @binding(1) var<storage, read> pixels: array<u32>;
@group(0) @binding(2) var<storage, read> colors: array<vec2u>;

struct Seen {
    @builtin(position) position: vec4f,
    // Premultiplied.
    @location(0) @interpolate(flat) color: vec4f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Seen {
    let pixel = pixels[vertex];
    let at = (vec2f(vec2u(pixel & 0xffffu, pixel >> 16u)) + 0.5) / vec2f(textureDimensions(tree_depth));
    let color = colors[vertex];
    return Seen(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0), vec4f(unpack2x16float(color.x), unpack2x16float(color.y)));
}

@fragment
fn fs_main(seen: Seen) -> @location(0) vec4f {
    return seen.color;
}
