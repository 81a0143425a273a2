// The ground that trees stand on: a height field, into the frame.
#import shared/frame
#import shared/meadow
#import shared/sky

// gpu::layout::Frame::background where there is air to see through.
const SKY: u32 = {SKY};

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> Seen {
    return Seen(frame.clip_from_world * vec4f(position, 1.0), position, normal);
}

@fragment
fn fs_main(seen: Seen) -> @location(0) vec4f {
    let n = normalize(seen.normal);
    let footprint_m = max(length(dpdx(seen.world)), length(dpdy(seen.world)));
    var color = lit_meadow(seen.world, n, footprint_m);
    if frame.shading == NORMALS {
        color = 0.5 + 0.5 * n;
    } else if frame.background == SKY {
        color = through_air(color, eye_of(seen.world), seen.world);
    }
    return vec4f(held(color), 1.0);
}
