// The finished picture onto a window's surface, a panel of text over it.
#import shared/screen

// 1 where the surface does not encode sRGB by itself.
override ENCODE: f32;

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var panel: texture_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Screen {
    return screen(vertex);
}

@fragment
fn fs_main(seen: Screen) -> @location(0) vec4f {
    let at = vec2i(seen.position.xy);
    var color = textureLoad(picture, at, 0).rgb;
    if all(at < vec2i(textureDimensions(panel))) {
        let text = textureLoad(panel, at, 0);
        color = mix(color, text.rgb, text.a);
    }
    if ENCODE == 1.0 {
        color = select(1.055 * pow(color, vec3f(1.0 / 2.4)) - 0.055, 12.92 * color, color <= vec3f(0.0031308));
    }
    return vec4f(color, 1.0);
}
