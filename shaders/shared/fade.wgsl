// What of a surface is there: the alpha test, and fades as a test of the same kind, so that the order of drawing never shows.
#import shared/part

fn lattice(p: vec3i) -> f32 {
    var h = bitcast<u32>(p.x) * 0x9E3779B1u ^ bitcast<u32>(p.y) * 0x85EBCA77u ^ bitcast<u32>(p.z) * 0xC2B2AE3Du;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// A number in 0..1, evenly spread, for a point of the tree that a pixel shows (Wyman & McGuire 2017, "Hashed Alpha Testing", listing 3):
// grains of about a pixel, tied to the tree. `footprint_m`: see footprint().
fn threshold(at: vec3f, footprint_m: f32) -> f32 {
    let grain = log2(1.0 / max(footprint_m, 1e-7));
    let fine = floor(grain);
    let t = grain - fine;
    let coarse = lattice(vec3i(floor(exp2(fine) * at)));
    let x = mix(coarse, lattice(vec3i(floor(exp2(fine + 1.0) * at))), t);
    // Numbers between two are more often middling: spread evenly again.
    let a = max(min(t, 1.0 - t), 1e-6);
    let low = x * x / (2.0 * a * (1.0 - a));
    let middle = (x - 0.5 * a) / (1.0 - a);
    let high = 1.0 - (1.0 - x) * (1.0 - x) / (2.0 * a * (1.0 - a));
    let even = select(select(middle, low, x < a), high, x >= 1.0 - a);
    return clamp(even, 1e-6, 1.0);
}

// How far a point moves from a pixel to the next.
fn footprint(at: vec3f) -> f32 {
    return max(length(dpdx(at)), length(dpdy(at)));
}

// Whether a texel of that alpha is there, of a part of which `share` is seen, at a point of object space with that footprint.
fn is_there(alpha: f32, share: f32, at: vec3f, footprint_m: f32) -> bool {
    if PART_FADE == FADE_NEVER {
        return alpha >= material.alpha_cutoff;
    }
    if PART_FADE == FADE_ALPHA {
        return share > 0.0 && alpha >= mix(1.0, material.alpha_cutoff, share);
    }
    var there = alpha >= material.alpha_cutoff;
    // Once or not at all: software drivers run both sides of every `if`, but leave out a loop that none of their pixels enters.
    for (var asks = there && share < 1.0; asks; asks = false) {
        there = threshold(at, footprint_m) <= share;
    }
    return there;
}
