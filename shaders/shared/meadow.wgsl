// Grass in the light of sun and sky, and trees' shadows on it: what the level ground and terrain show.
#import shared/frame
#import shared/light
#import shared/shadow

// How soft the shadow of a crown some metres up is on the ground: the sun is half a degree wide.
const PENUMBRA_M: f32 = 0.08;

// What a point of the lattice is told by: x and y times these.
const LATTICE_X: u32 = 0x9E3779B1u;
const LATTICE_Y: u32 = 0x85EBCA77u;

// A number in 0..1 for a point of the lattice.
fn lattice(p: vec2i) -> f32 {
    return lattices(vec4u(bitcast<u32>(p.x) * LATTICE_X ^ bitcast<u32>(p.y) * LATTICE_Y)).x;
}

// The same for four of them, each told by one word.
fn lattices(told: vec4u) -> vec4f {
    var h = (told ^ (told >> vec4u(15u))) * 0x2C1B3C6Du;
    h = (h ^ (h >> vec4u(12u))) * 0x297A2D39u;
    // By way of signed numbers, which software drivers turn into fractions faster.
    return vec4f(vec4i((h ^ (h >> vec4u(15u))) >> vec4u(8u))) / 16777216.0;
}

// Smooth noise of the given wavelength, -1..1, that vanishes before pixels of `footprint_m` get too coarse for it.
fn noise(at: vec2f, wave_m: f32, footprint_m: f32) -> f32 {
    let shown = saturate(1.5 - 3.0 * footprint_m / wave_m);
    if shown == 0.0 {
        return 0.0;
    }
    let p = at / wave_m;
    let cell = floor(p);
    let f = p - cell;
    let t = f * f * (3.0 - 2.0 * f);
    let told = bitcast<vec2u>(vec2i(cell)) * vec2u(LATTICE_X, LATTICE_Y);
    let next = told + vec2u(LATTICE_X, LATTICE_Y);
    let corners = lattices(vec4u(told.x, next.x, told.x, next.x) ^ vec4u(told.yy, next.yy));
    let sides = mix(corners.xz, corners.yw, t.x);
    return shown * (2.0 * mix(sides.x, sides.y, t.y) - 1.0);
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
