// Leaves on their way to another level of detail into the temporary colour, depth and id buffers (Rebollo §IV).
#import shared/leaves
#import shared/presence
#import shared/shade

@vertex
fn vs_main(corner: Corner) -> Seen {
    let tree = standing(corner.place, corner.rotation);
    let leaf = on_its_way(corner);
    let world = swayed(tree, leaf.position, material.tree_height_m, material.tree_foot_m);
    var seen: Seen;
    seen.position = frame.clip_from_world * vec4f(world, 1.0);
    seen.world = world;
    seen.from_center = leaf.position;
    seen.normal = turned(tree.rotation, leaf.normal);
    seen.uv = corner.uv;
    seen.slot = 0u;
    seen.share = share_of(tree, leaf.normal, false);
    seen.tree = vec4f(still(tree, material.tree_center), tree.scale);
    return seen;
}

@fragment
fn fs_main(seen: Seen, @builtin(front_facing) front: bool) -> Drawn {
    return surface(seen, front);
}
