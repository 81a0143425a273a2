// Where the outline of the trees really runs between their pixels: morphological anti-aliasing (Reshetov 2009) of the depth buffer. Along
// each straight run of the outline a line is drawn from half a pixel above or below its one end over its middle to the other; what
// lies between the line and the run is gained or lost. Thin twigs stay thin: a straight run loses nothing.
#import shared/frame

@group(1) @binding(0) var tree_depth: texture_depth_2d;

// How far along a run to look for its ends, pixels.
const REACH: i32 = 6;
// What is so many times as far away is another layer; in parallel projection, what is deeper by frame.layer.
const LAYER: f32 = 1.02;

// The neighbours R, T, L, B; y runs down.
fn side_step(side: u32) -> vec2i {
    // Arithmetic, since software drivers are slow with arrays.
    let s = i32(side);
    return select(vec2i(1 - s, 0), vec2i(0, s - 2), (side & 1u) == 1u);
}

// Reversed depth, that of the nearest pixel beyond the picture's edge.
fn depth_of(at: vec2i) -> f32 {
    return textureLoad(tree_depth, clamp(at, vec2i(0), vec2i(textureDimensions(tree_depth)) - 1), 0);
}

fn is_before(near: f32, far: f32) -> bool {
    return near > select(LAYER * far, far + frame.layer, frame.layer > 0.0 && far > 0.0);
}

struct End {
    // Pixels that the run goes on for.
    count: i32,
    // Where the outline turns: −0.5 inward, 0.5 outward, 0 neither.
    height: f32,
}

fn end_of(inner: vec2i, outer: vec2i, beyond: f32, along: vec2i) -> End {
    for (var i = 1; i <= REACH; i++) {
        let on_inner = is_before(depth_of(inner + i * along), beyond);
        let on_outer = is_before(depth_of(outer + i * along), beyond);
        if on_inner && !on_outer {
            continue;
        }
        return End(i - 1, select(0.0, select(-0.5, 0.5, on_inner), on_inner == on_outer));
    }
    return End(REACH, 0.0);
}

// Area under the half line from 1 at the near end of a run of length `run` to 0 at its middle, over the pixel that begins at `start`.
fn half_area(start: f32, run: f32) -> f32 {
    let end = min(start + 1.0, 0.5 * run);
    return select(0.0, (end - start) - (end * end - start * start) / run, end > start);
}

// What the pixel `inner` of an outline loses, and the pixel `outer` beyond it gains, of their areas. `beyond` is the depth of `outer`.
fn outline_area(inner: vec2i, outer: vec2i, beyond: f32) -> vec2f {
    let across = outer - inner;
    let along = vec2i(-across.y, across.x);
    let back = end_of(inner, outer, beyond, -along);
    let ahead = end_of(inner, outer, beyond, along);
    let run = f32(back.count + ahead.count + 1);
    let a = back.height * half_area(f32(back.count), run);
    let b = ahead.height * half_area(f32(ahead.count), run);
    return vec2f(max(-a, 0.0) + max(-b, 0.0), max(a, 0.0) + max(b, 0.0));
}
