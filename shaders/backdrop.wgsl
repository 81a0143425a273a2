// What stands behind the trees: sky above a level meadow, on which shadows fall. From below the ground is not there.
#import shared/frame
#import shared/screen
#import shared/meadow
#import shared/sky

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

// The sky with the ridges before it.
fn far_off(ray: vec3f) -> vec3f {
    let color = sky(ray);
    if ray.y > 0.045 {
        return color;
    }
    let haze = sky(normalize(vec3f(ray.x, 0.0, ray.z)));
    let woods = vec3f(0.05, 0.085, 0.06) * (frame.sky_color + 0.5 * frame.sun_color);
    // Half the slope that one pixel spans.
    let m = frame.clip_from_world;
    let soft = 1.0 / (frame.size_px.y * length(vec3f(m[0].y, m[1].y, m[2].y)));
    let behind = smoothstep(soft, -soft, ray.y - 0.004 - 0.017 * ridge(ray, 19.0));
    let before = smoothstep(soft, -soft, ray.y - 0.001 - 0.009 * ridge(ray, 47.0));
    // Mist lies in the valleys.
    let mist = smoothstep(0.0, 0.03, ray.y);
    return mix(mix(color, mix(haze, woods, 0.2 + 0.15 * mist), behind), mix(haze, woods, 0.32 + 0.6 * mist), before);
}

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
