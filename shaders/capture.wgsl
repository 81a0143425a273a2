// Samples of a picture for a stand-in (repr::Capture): base colour without light, and normals of object space turned to the viewer.
#import shared/part
#import shared/capture_view

struct Taken {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Taken {
    return Taken(view.clip_from_object * vec4f(position, 1.0), normal, uv);
}

struct Sample {
    @location(0) color: vec4f,
    @location(1) normal: vec4f,
}

@fragment
fn fs_main(taken: Taken, @builtin(front_facing) front: bool) -> Sample {
    // The size at which a texel has the area of a sample: in parallel projection the same all over a triangle.
    let size = vec2f(textureDimensions(color_texture));
    let right = dpdx(taken.uv) * size;
    let down = dpdy(taken.uv) * size;
    let level = 0.5 * log2(max(abs(right.x * down.y - right.y * down.x), 1e-6));
    let color = material.factor * textureSampleLevel(color_texture, color_sampler, taken.uv, max(level, 0.0));
    if color.a < material.alpha_cutoff {
        discard;
    }
    let long = length(taken.normal);
    let n = select(vec3f(0.0, 1.0, 0.0), taken.normal / max(long, 1e-20), long > 0.0);
    return Sample(vec4f(color.rgb, 1.0), vec4f(select(-n, n, front), 1.0));
}
