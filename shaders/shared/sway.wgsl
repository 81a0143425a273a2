// The wind (She §4: feature points sway): one field for everything that is drawn of a tree, so that near and far agree. Ours in form:
// the trunk bends like a cantilever, boughs swing at their own pace, leaves flutter by where they are on the crown.
#import shared/frame

// Whether it blows (render::pipelines).
const WIND: bool = {WIND} != 0u;

// How far the wind moves a point `at` of a tree (object space, metres, above its foot) that is `height_m` tall and stands at `foot` (world space): metres
// along the world's axes before the tree's scale. Depends on nothing else, so that what is joined stays joined. The foot stays.
fn sway(at: vec3f, height_m: f32, foot: vec3f) -> vec3f {
    if !WIND {
        return vec3f(0.0);
    }
    let lean = length(frame.lean);
    let along = frame.lean / lean;
    let up = clamp(at.y / height_m, 0.0, 1.0);
    // Tall trees swing slowly; gusts run over a grove, and no two trees are in step.
    let pace = 10.0 / sqrt(height_m) * frame.time_s;
    let own = 6.2832 * fract(dot(foot.xz, vec2f(0.137, 0.291)));
    let gust = pace - 0.15 * dot(foot.xz, along) + 0.6 * sin(own);
    let swing = 0.55 + 0.28 * sin(gust) + 0.17 * sin(0.37 * gust + own);
    let aside = 0.22 * sin(0.83 * pace + own);
    // Boughs: lobes a third of the tree apart, the more the farther out.
    let out = min(length(at.xz) / (0.3 * height_m), 1.0);
    let phase = 18.0 * at / height_m;
    let boughs = 0.18 * out * vec2f(sin(2.3 * pace + phase.x + phase.y + own), sin(2.7 * pace + phase.z - phase.y));
    let cantilever = up * up * (1.5 - 0.5 * up);
    let across = vec2f(-along.y, along.x);
    let bent = lean * height_m * cantilever * (along * (swing + boughs.x) + across * (aside + boughs.y));
    // What leans over comes down: the length of a bent cantilever stays nearly the same.
    let down = 0.6 * dot(bent, bent) / max(at.y, 0.05 * height_m);
    return vec3f(bent.x, -down, bent.y) + frame.flutter_m * up * out * flutter(at, frame.time_s);
}

// Leaves: a fast small motion whose phase runs over the crown within a metre, each component within -1..1.
fn flutter(at: vec3f, time_s: f32) -> vec3f {
    let phase = vec3f(dot(at, vec3f(5.1, 3.7, -4.3)), dot(at, vec3f(-3.9, 5.3, 4.7)), dot(at, vec3f(4.1, -4.9, 5.7)));
    return sin(phase + time_s * vec3f(9.7, 11.9, 8.3)) * (0.6 + 0.4 * sin(1.7 * phase.zxy + 3.1 * time_s));
}
