// What stands between the sun and everything else: depth alone, with the holes of cut-out foliage.
#import shared/frame
#import shared/tree

struct Cast {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    // Object space, in units of leaf clumps.
    @location(1) clump: vec3f,
    // Cosine of the angle between the normal and the sun.
    @location(2) facing: f32,
}

// A clump of leaves for a tree of one metre, metres.
const CLUMP: f32 = 0.014;

@vertex
fn vs_main(corner: Corner) -> Cast {
    let facing = dot(turned(normalize(corner.rotation), corner.normal), frame.toward_sun);
    let position = frame.sun_clip_from_world * vec4f(placed(corner), 1.0);
    return Cast(position, corner.uv, corner.position / (CLUMP * material.tree_height_m), facing);
}

fn lattice(p: vec3i) -> f32 {
    var h = bitcast<u32>(p.x) * 0x9E3779B1u ^ bitcast<u32>(p.y) * 0x85EBCA77u ^ bitcast<u32>(p.z) * 0xC2B2AE3Du;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// Smooth noise, 0..1.
fn noise(at: vec3f) -> f32 {
    let cell = vec3i(floor(at));
    let t = smoothstep(vec3f(0.0), vec3f(1.0), at - floor(at));
    var rows = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let row = cell + vec3i(0, i & 1, i >> 1u);
        rows[i] = mix(lattice(row), lattice(row + vec3i(1, 0, 0)), t.x);
    }
    return mix(mix(rows.x, rows.y, t.y), mix(rows.z, rows.w, t.y), t.z);
}

@fragment
fn fs_main(seen: Cast) {
    if material.factor.a * textureSample(color_texture, color_sampler, seen.uv).a < material.alpha_cutoff {
        discard;
    }
    // Light slips through a crown's rim, where it crosses few leaves: the shadow's edge is of leaves, not of polygons.
    if material.grows != 0u && seen.facing < 0.45 {
        if 0.55 * noise(seen.clump) + 0.45 * noise(2.3 * seen.clump) > 0.30 + 1.1 * seen.facing {
            discard;
        }
    }
}
