// Surfaces of placed trees, standing or turned to the viewer, into the temporary colour, depth and id buffers (She §3.4, fig. 14).
#import shared/corner
#import shared/presence
#import shared/shade

@vertex
fn vs_main(corner: Corner) -> Seen {
    let tree = tree_of(corner);
    let pose = posed(tree, corner.position, corner.normal, false);
    let world = swayed(tree, pose.at, material.tree_height_m, material.tree_foot_m);
    var seen: Seen;
    seen.position = frame.clip_from_world * vec4f(world, 1.0);
    seen.world = world;
    // As it stands unturned: so what is hashed by it stays on the card.
    seen.from_center = corner.position - material.crown_center;
    seen.normal = turned(tree.rotation, crown_normal(pose.normal, seen.from_center));
    seen.uv = corner.uv;
    seen.slot = growing_slot(corner);
    seen.share = share_of(tree, corner.normal, false);
    if PART_FADE != FADE_NEVER {
        // What is not seen from here covers no pixel.
        seen.position = select(seen.position, vec4f(2.0, 2.0, 2.0, 1.0), seen.share <= 0.0);
    }
    seen.tree = vec4f(still(tree, material.tree_center), tree.scale);
    return seen;
}

// A crown is lit as the rounded whole that it is, its lobes as half of that: between the surface's normal and its ellipsoid's.
fn crown_normal(normal: vec3f, from_center: vec3f) -> vec3f {
    let reach = material.crown_reach.xyx;
    let round = from_center / (reach * reach);
    return select(normal, normal + normalize(round + vec3f(0.0, 1e-6, 0.0)), CROWN);
}

@fragment
fn fs_main(seen: Seen, @builtin(front_facing) front: bool) -> Drawn {
    return surface(seen, front);
}
