// What stands behind the trees: sky above a level meadow, on which shadows fall. From below the ground is not there.
#import shared/frame
#import shared/screen
#import shared/light
#import shared/shadow
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

// How soft the shadow of a crown some metres up is on the ground: the sun is half a degree wide.
const PENUMBRA_M: f32 = 0.08;

struct Drawn {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

// A number in 0..1 for a point of the lattice.
fn lattice(p: vec2i) -> f32 {
    var h = bitcast<u32>(p.x) * 0x9E3779B1u ^ bitcast<u32>(p.y) * 0x85EBCA77u;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// Smooth noise of the given wavelength, -1..1, that vanishes before pixels of `footprint_m` get too coarse for it.
fn noise(at: vec2f, wave_m: f32, footprint_m: f32) -> f32 {
    let shown = saturate(1.5 - 3.0 * footprint_m / wave_m);
    if shown == 0.0 {
        return 0.0;
    }
    let p = at / wave_m;
    let cell = vec2i(floor(p));
    let f = p - floor(p);
    let t = f * f * (3.0 - 2.0 * f);
    let near = mix(lattice(cell), lattice(cell + vec2i(1, 0)), t.x);
    let far = mix(lattice(cell + vec2i(0, 1)), lattice(cell + vec2i(1, 1)), t.x);
    return shown * (2.0 * mix(near, far, t.y) - 1.0);
}

// A mown meadow: patches of two greens, and grain near the viewer.
fn meadow(at: vec2f, footprint_m: f32) -> vec3f {
    let turned = vec2f(0.8 * at.x - 0.6 * at.y, 0.6 * at.x + 0.8 * at.y);
    let patches = 0.55 * noise(turned, 37.0, footprint_m) + 0.3 * noise(at, 11.0, footprint_m) + 0.15 * noise(turned, 2.9, footprint_m);
    let grain = 0.3 * noise(at, 0.53, footprint_m) + 0.35 * noise(turned, 0.17, footprint_m) + 0.35 * noise(at, 0.05, footprint_m);
    let grass = mix(vec3f(0.080, 0.146, 0.030), vec3f(0.143, 0.180, 0.050), saturate(0.5 + 0.55 * patches));
    return grass * (1.0 + 0.38 * grain);
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
    var color = meadow(hit.xz, footprint_m);
    if frame.shading == LIT {
        let up = vec3f(0.0, 1.0, 0.0);
        let sun = sun_on_face(up) * sun_on_solid(hit, max(footprint_m, PENUMBRA_M));
        color *= sun + ambient(up);
    }
    return Drawn(vec4f(held(through_air(color, near, hit)), 1.0), depth);
}
