// How much of a part is seen, and where a card turns.
#import shared/part
#import shared/seen

// 0 where nothing of a polygon of that normal (object space) is seen, 1 where all of it is.
fn share_of(tree: Standing, normal: vec3f, for_sun: bool) -> f32 {
    if PART_FADE == FADE_NEVER {
        return 1.0;
    }
    return share_seen(presence, PART_FACING, material.tree_height_m, tree, normal, for_sun);
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
