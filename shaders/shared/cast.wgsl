// Surfaces into the sun's map: depth alone, with the holes of cut-out foliage. Drawers bring the vertex stage.
#import shared/part
#import shared/fade
#import shared/presence

// What a vertex stage hands over.
struct Cast {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    // Object space before the wind.
    @location(1) at: vec3f,
    // Cosine of the angle between the normal and the sun.
    @location(2) facing: f32,
    // How much of the part is seen.
    @location(3) @interpolate(flat) share: f32,
}

// A vertex of a tree, with the normal of its polygon, as the sun sees it.
fn toward_sun(tree: Standing, at: vec3f, normal: vec3f, uv: vec2f) -> Cast {
    let pose = posed(tree, at, normal, true);
    var seen: Cast;
    seen.position = frame.sun_clip_from_world * vec4f(swayed(tree, pose.at, material.tree_height_m, material.tree_foot_m), 1.0);
    seen.uv = uv;
    seen.at = at;
    seen.facing = dot(turned(tree.rotation, pose.normal), frame.toward_sun);
    seen.share = share_of(tree, normal, true);
    return seen;
}

// A clump of leaves for a tree of one metre, metres.
const CLUMP: f32 = 0.014;

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

fn casts(seen: Cast) -> bool {
    let alpha = material.factor.a * textureSample(color_texture, color_sampler, seen.uv).a;
    if !is_there(alpha, seen.share, seen.at, footprint(seen.at)) {
        return false;
    }
    // Light slips through a crown's rim, where it crosses few leaves: the shadow's edge is of leaves, not of polygons.
    if material.grows != 0u && seen.facing < 0.45 {
        let clump = seen.at / (CLUMP * material.tree_height_m);
        return 0.55 * noise(clump) + 0.45 * noise(2.3 * clump) <= 0.30 + 1.1 * seen.facing;
    }
    return true;
}

@fragment
fn fs_main(seen: Cast) {
    if !casts(seen) {
        discard;
    }
}
