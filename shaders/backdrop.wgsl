// What stands behind the trees: sky above a level meadow, on which shadows fall; or the sky alone where ground is drawn by itself. From
// below the ground is not there.
#import shared/frame
#import shared/screen
#import shared/meadow
#import shared/sky

const BEARINGS: u32 = {BEARINGS};

struct Seen {
    @builtin(position) position: vec4f,
    // Where a pixel's line of sight begins, world space, and whither it goes: both are linear over the picture.
    @location(0) near: vec3f,
    @location(1) ray: vec3f,
}

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Seen {
    let at = screen(vertex);
    let near = unproject(at.ndc, 1.0);
    return Seen(at.position, near, 1e-3 * (unproject(at.ndc, 1e-3) - near));
}

struct Drawn {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

// Wooded ridges far off: how high they stand along a ray's bearing, as its slope.
fn ridge(ray: vec3f, waves: f32) -> f32 {
    let bearing = waves * atan2(ray.x, ray.z) / 6.2831853;
    var height = 0.0;
    var share = 1.0;
    for (var octave = 0; octave < 3; octave++) {
        // A whole number of waves round the circle, so that the ridge closes.
        let around = i32(waves) << u32(octave);
        let p = bearing * f32(1 << u32(octave)) + f32(around);
        let cell = i32(floor(p));
        let t = smoothstep(0.0, 1.0, p - floor(p));
        height += share * mix(lattice(vec2i(cell % around, octave)), lattice(vec2i((cell + 1) % around, octave)), t);
        share *= 0.45;
    }
    return height;
}

// Up to where ridges reach at most, as a ray's slope.
const RIDGES_END: f32 = 0.045;

// The ridges on the horizon, and below it what they stand on: colour, and how much of the sky behind they cover.
fn ridges(ray: vec3f) -> vec4f {
    let haze = haze_color(ray);
    let woods = vec3f(0.05, 0.085, 0.06) * (frame.sky_color + 0.5 * frame.sun_color);
    // Half the slope that one pixel spans.
    let m = frame.clip_from_world;
    let soft = 1.0 / (frame.size_px.y * length(vec3f(m[0].y, m[1].y, m[2].y)));
    let behind = smoothstep(soft, -soft, ray.y - 0.004 - 0.017 * ridge(ray, 19.0));
    let before = smoothstep(soft, -soft, ray.y - 0.001 - 0.009 * ridge(ray, 47.0));
    // Mist lies in the valleys.
    let mist = smoothstep(0.0, 0.03, ray.y);
    let back = vec4f(mix(haze, woods, 0.2 + 0.15 * mist), 1.0) * behind;
    return mix(back, vec4f(mix(haze, woods, 0.32 + 0.6 * mist), 1.0), before);
}

// The sky with the ridges before it.
fn far_off(ray: vec3f) -> vec3f {
    let shown = select(ridges(ray), vec4f(0.0), ray.y > RIDGES_END);
    return sky(ray) * (1.0 - shown.a) + shown.rgb;
}

@fragment
fn fs_main_sky(seen: Seen) -> @location(0) vec4f {
    return vec4f(held(sky(normalize(seen.ray))), 1.0);
}

// A ring at infinity that holds the ridges and all below the horizon. In parallel projection there is no horizon, and nothing is drawn.
@vertex
fn vs_main_ridges(@builtin(vertex_index) vertex: u32) -> Seen {
    let bearing = f32(vertex >> 1u) * (6.2831853 / f32(BEARINGS));
    let ray = vec3f(sin(bearing), select(-1.0, 1.01 * RIDGES_END, (vertex & 1u) == 1u), cos(bearing));
    let at = frame.clip_from_world * vec4f(ray, 0.0);
    return Seen(vec4f(at.xy, 0.0, at.w), frame.eye, ray);
}

@fragment
fn fs_main_ridges(seen: Seen) -> @location(0) vec4f {
    return vec4f(held(far_off(normalize(seen.ray))), 1.0);
}

// Level ground and all above.
@fragment
fn fs_main(seen: Seen) -> Drawn {
    let near = seen.near;
    let ray = normalize(seen.ray);
    let drop = near.y - frame.ground_m;
    if ray.y > -1e-4 || drop <= 0.0 {
        return Drawn(vec4f(held(far_off(ray)), 1.0), 0.0);
    }
    let way = drop / -ray.y;
    let hit = near + ray * way;
    let clip = frame.clip_from_world * vec4f(hit, 1.0);
    let depth = clip.z / clip.w;
    let px_m = 1.0 / (frame.px_per_m.x + frame.px_per_m.y * depth);
    let footprint_m = px_m / max(sqrt(-ray.y), 0.05);
    let color = lit_meadow(hit, vec3f(0.0, 1.0, 0.0), footprint_m);
    return Drawn(vec4f(held(through_air(color, near, hit)), 1.0), depth);
}
