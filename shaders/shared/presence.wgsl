// How much of a part is seen, and where a card turns. The same as repr::Seen reckons; render::scene leaves out what is not seen at all.
#import shared/part
#import shared/place

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

fn share_toward(toward: vec3f, normal: vec3f) -> f32 {
    if (PART_FACING & FACING) == 0u {
        return 1.0;
    }
    let level = vec2f(toward.x, toward.z);
    let long = length(level);
    var seen = toward;
    if (PART_FACING & FACING_LEVEL) != 0u {
        seen = select(vec3f(0.0, 0.0, 1.0), vec3f(level.x, 0.0, level.y) / max(long, 1e-20), long > 0.0);
    }
    let axis = select(presence.axis, normal, (PART_FACING & FACING_OWN) != 0u);
    var cosine = dot(axis, seen);
    if (PART_FACING & FACING_BOTH) != 0u {
        cosine = abs(cosine);
    }
    let share = share_between(presence.cosines, cosine);
    if (PART_FACING & FACING_SECTOR) == 0u {
        return share;
    }
    return share * share_between(presence.rises, toward.y) * (1.0 - share_between(presence.sinks, toward.y));
}

// How far the viewer is from a point of the tree, in its heights.
fn heights_to(tree: Standing, at: vec3f, for_sun: bool) -> f32 {
    if for_sun && frame.sun_level_m > 0.0 {
        return frame.sun_level_m / (tree.scale * material.tree_height_m);
    }
    let way = frame.heights.x + frame.heights.y * distance(frame.level_eye, still(tree, at));
    // Below 0: a level was told, wherever the viewer stands.
    return select(way / (tree.scale * material.tree_height_m), frame.heights.x, frame.heights.y < 0.0);
}

// 0 where nothing of a polygon of that normal (object space) is seen, 1 where all of it is. Distances are the viewer's in the sun's map too, so that what casts a shadow
// is what is seen; sides are those that the sun sees.
fn share_of(tree: Standing, normal: vec3f, for_sun: bool) -> f32 {
    if PART_FADE == FADE_NEVER {
        return 1.0;
    }
    let appeared = rise(presence.appears, heights_to(tree, presence.anchor, for_sun));
    let vanished = rise(presence.vanishes, heights_to(tree, presence.vanish_anchor, for_sun));
    return appeared * (1.0 - vanished) * share_toward(toward_seer(tree, presence.anchor, for_sun), normal);
}

// Right, up and towards whoever sees it for a card that turns to `toward` (unit length).
fn card_axes(toward: vec3f, upright: bool) -> mat3x3f {
    let out = length(toward.xz);
    // From straight above its right is +X, as raster::View::axes_from has it.
    let right = select(vec3f(1.0, 0.0, 0.0), vec3f(toward.z, 0.0, -toward.x) / max(out, 1e-20), out > 1e-6);
    if upright {
        return mat3x3f(right, vec3f(0.0, 1.0, 0.0), vec3f(-right.z, 0.0, right.x));
    }
    return mat3x3f(right, cross(toward, right), toward);
}

// A point or a normal of the part as it stands, turned to whoever sees it.
struct Posed {
    at: vec3f,
    normal: vec3f,
}

fn posed(tree: Standing, at: vec3f, normal: vec3f, for_sun: bool) -> Posed {
    if PART_TURNED != TURNED_UPRIGHT && PART_TURNED != TURNED_WHOLLY {
        return Posed(at, normal);
    }
    let axes = card_axes(toward_seer(tree, presence.pivot, for_sun), PART_TURNED == TURNED_UPRIGHT);
    return Posed(presence.pivot + axes * (at - presence.pivot), axes * normal);
}
