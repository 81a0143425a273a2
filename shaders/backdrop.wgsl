// What stands behind the trees: sky above a level meadow, on which shadows fall. From below the ground is not there.
#import shared/frame
#import shared/screen
#import shared/light
#import shared/shadow
#import shared/sky

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Screen {
    return screen(vertex);
}

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
    let patches = 0.5 * noise(at, 23.0, footprint_m) + 0.3 * noise(turned, 7.3, footprint_m) + 0.2 * noise(at, 1.9, footprint_m);
    let grain = 0.5 * noise(turned, 0.41, footprint_m) + 0.5 * noise(at, 0.09, footprint_m);
    let grass = mix(vec3f(0.080, 0.125, 0.032), vec3f(0.135, 0.155, 0.052), saturate(0.5 + 0.6 * patches));
    return grass * (1.0 + 0.22 * grain);
}

@fragment
fn fs_main(seen: Screen) -> Drawn {
    let near = unproject(seen.ndc, 1.0);
    let ray = normalize(unproject(seen.ndc, 1e-4) - near);
    let drop = near.y - frame.ground_m;
    if ray.y > -1e-4 || drop <= 0.0 {
        return Drawn(vec4f(held(sky(ray)), 1.0), 0.0);
    }
    let way = drop / -ray.y;
    let hit = near + ray * way;
    let clip = frame.clip_from_world * vec4f(hit, 1.0);
    let depth = clip.z / clip.w;
    let px_m = 1.0 / (frame.px_per_m.x + frame.px_per_m.y * depth);
    let footprint_m = px_m / max(sqrt(-ray.y), 0.05);
    var color = meadow(hit.xz, footprint_m);
    if frame.lit > 0.0 {
        let up = vec3f(0.0, 1.0, 0.0);
        let sun = sun_on_face(up) * sun_on_solid(hit, footprint_m);
        color = mix(color, color * (sun + ambient(up)), frame.lit);
    }
    return Drawn(vec4f(held(through_air(color, near, hit)), 1.0), depth);
}
