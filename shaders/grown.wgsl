// Grown pixels as points into the trees' temporary buffers: colour and depth of their root (She §3.3).
#import shared/id
#import shared/grown

@group(0) @binding(0) var<storage, read> size_px: vec2u;
@group(0) @binding(1) var<storage, read> places: array<GrownPlace>;
@group(0) @binding(2) var<storage, read> colors: array<GrownColor>;

struct Seen {
    @builtin(position) position: vec4f,
    // Premultiplied.
    @location(0) @interpolate(flat) color: vec4f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Seen {
    let place = places[vertex];
    let shown = colors[vertex];
    let at = (vec2f(vec2u(place.pixel & 0xffffu, place.pixel >> 16u)) + 0.5) / vec2f(size_px);
    let blue_coverage = unpack2x16float(shown.blue_coverage);
    let color = vec4f(unpack2x16float(shown.red_green), blue_coverage.x, 1.0) * blue_coverage.y;
    return Seen(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, place.depth, 1.0), color);
}

struct Drawn {
    @location(0) color: vec4f,
    @location(1) id: u32,
}

@fragment
fn fs_main(seen: Seen) -> Drawn {
    return Drawn(seen.color, GROWN | u32(seen.color.a * 16.0 + 0.5));
}
