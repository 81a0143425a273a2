// Grass in the light of sun and sky, and trees' shadows on it: what the level ground and terrain show.
#import shared/frame
#import shared/light
#import shared/shadow

// How soft the shadow of a crown some metres up is on the ground: the sun is half a degree wide.
const PENUMBRA_M: f32 = 0.08;

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

// A point of ground turned `n`; `footprint_m`: how far it is from a pixel to the next.
fn lit_meadow(at: vec3f, n: vec3f, footprint_m: f32) -> vec3f {
    let color = meadow(at.xz, footprint_m);
    if frame.shading != LIT {
        return color;
    }
    return color * (sun_on_face(n) * sun_on_solid(at, max(footprint_m, PENUMBRA_M)) + ambient(n));
}
