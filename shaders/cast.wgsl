// What stands between the sun and everything else: depth alone, with the holes of cut-out foliage.
#import shared/frame
#import shared/tree

struct Cast {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vs_main(corner: Corner) -> Cast {
    return Cast(frame.sun_clip_from_world * vec4f(placed(corner), 1.0), corner.uv);
}

@fragment
fn fs_main(seen: Cast) {
    if material.factor.a * textureSample(color_texture, color_sampler, seen.uv).a < material.alpha_cutoff {
        discard;
    }
}
