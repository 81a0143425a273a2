// When a part of a placed tree is seen, for those who draw it and for who culls. The same as repr::Seen reckons.
#import shared/place

// Mirrors gpu::layout::Presence.
struct Presence {
    anchor: vec3f,
    grid: u32,
    appears: vec2f,
    vanishes: vec2f,
    axis: vec3f,
    radius_m: f32,
    pivot: vec3f,
    pad: f32,
    vanish_anchor: vec3f,
    pad2: f32,
    cosines: vec2f,
    rises: vec2f,
    sinks: vec2f,
    pad3: vec2f,
}

// From which sides a part is seen: bits.
const FACING: u32 = {FACING};
const FACING_LEVEL: u32 = {FACING_LEVEL};
const FACING_BOTH: u32 = {FACING_BOTH};
const FACING_OWN: u32 = {FACING_OWN};
const FACING_SECTOR: u32 = {FACING_SECTOR};

fn rise(ends: vec2f, distance: f32) -> f32 {
    if distance < ends.x {
        return 0.0;
    }
    if distance >= ends.y {
        return 1.0;
    }
    return (distance - ends.x) / (ends.y - ends.x);
}

// By a cosine or a sine; ends that fall count the other way round.
fn share_between(ends: vec2f, cosine: f32) -> f32 {
    if ends.y != ends.x {
        return saturate((cosine - ends.x) / (ends.y - ends.x));
    }
    return select(0.0, 1.0, cosine >= ends.y);
}

// By the direction to whoever sees it, of a polygon of that normal; `facing`: the bits above.
fn share_toward(seen: Presence, facing: u32, toward: vec3f, normal: vec3f) -> f32 {
    if (facing & FACING) == 0u {
        return 1.0;
    }
    let level = vec2f(toward.x, toward.z);
    let long = length(level);
    var out = toward;
    if (facing & FACING_LEVEL) != 0u {
        out = select(vec3f(0.0, 0.0, 1.0), vec3f(level.x, 0.0, level.y) / max(long, 1e-20), long > 0.0);
    }
    let axis = select(seen.axis, normal, (facing & FACING_OWN) != 0u);
    var cosine = dot(axis, out);
    if (facing & FACING_BOTH) != 0u {
        cosine = abs(cosine);
    }
    let share = share_between(seen.cosines, cosine);
    if (facing & FACING_SECTOR) == 0u {
        return share;
    }
    return share * share_between(seen.rises, toward.y) * (1.0 - share_between(seen.sinks, toward.y));
}

// How far the viewer is from a point of the tree, in its heights.
fn heights_to(tree: Standing, tree_height_m: f32, at: vec3f, for_sun: bool) -> f32 {
    if for_sun && frame.sun_level_m > 0.0 {
        return frame.sun_level_m / (tree.scale * tree_height_m);
    }
    let way = frame.heights.x + frame.heights.y * distance(frame.level_eye, still(tree, at));
    // Below 0: a level was told, wherever the viewer stands.
    return select(way / (tree.scale * tree_height_m), frame.heights.x, frame.heights.y < 0.0);
}

// How much is seen of a polygon of that normal, object space. Distances are the viewer's in the sun's map too, so that what casts a shadow is
// what is seen; sides are those that the sun sees.
fn share_seen(seen: Presence, facing: u32, tree_height_m: f32, tree: Standing, normal: vec3f, for_sun: bool) -> f32 {
    let appeared = rise(seen.appears, heights_to(tree, tree_height_m, seen.anchor, for_sun));
    let vanished = rise(seen.vanishes, heights_to(tree, tree_height_m, seen.vanish_anchor, for_sun));
    return appeared * (1.0 - vanished) * share_toward(seen, facing, toward_seer(tree, seen.anchor, for_sun), normal);
}
