// One triangle that covers the picture.
struct Screen {
    @builtin(position) position: vec4f,
    @location(0) ndc: vec2f,
}

fn screen(vertex: u32) -> Screen {
    let ndc = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 4.0 - 1.0;
    return Screen(vec4f(ndc, 0.0, 1.0), ndc);
}
