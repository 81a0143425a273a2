// Samples into pixels as raster::render has them: mean colour of what is there and the covered part; depth and normal of what is nearest.
#import shared/screen
#import shared/capture_view

@group(0) @binding(1) var colors: texture_2d<f32>;
@group(0) @binding(2) var normals: texture_2d<f32>;
@group(0) @binding(3) var depths: texture_depth_2d;

// Samples of a pixel along each axis.
const CAPTURE_SAMPLES: u32 = {CAPTURE_SAMPLES};

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Screen {
    return screen(vertex);
}

struct Pixel {
    // Straight alpha.
    @location(0) color: vec4f,
    // Normal, and depth in metres; all 0 where nothing is.
    @location(1) surface: vec4f,
}

@fragment
fn fs_main(seen: Screen) -> Pixel {
    let first = vec2i(CAPTURE_SAMPLES * vec2u(seen.position.xy));
    var color = vec4f(0.0);
    var nearest = 0.0;
    var normal = vec3f(0.0);
    for (var i = 0u; i < CAPTURE_SAMPLES * CAPTURE_SAMPLES; i++) {
        let at = first + vec2i(vec2u(i % CAPTURE_SAMPLES, i / CAPTURE_SAMPLES));
        let depth = textureLoad(depths, at, 0);
        if depth > 0.0 {
            color += vec4f(textureLoad(colors, at, 0).rgb, 1.0);
        }
        if depth > nearest {
            nearest = depth;
            normal = textureLoad(normals, at, 0).xyz;
        }
    }
    let share = color.a / f32(CAPTURE_SAMPLES * CAPTURE_SAMPLES);
    return Pixel(vec4f(color.rgb / max(color.a, 1.0), share), vec4f(normal, view.far_m + nearest * view.deep_m));
}
