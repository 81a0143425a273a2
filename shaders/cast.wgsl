// What stands between the sun and everything else: depth alone, with the holes of cut-out foliage.
#import shared/corner
#import shared/presence
#import shared/cast

@vertex
fn vs_main(corner: Corner) -> Cast {
    let tree = tree_of(corner);
    let pose = posed(tree, corner.position, corner.normal, true);
    var seen: Cast;
    seen.position = frame.sun_clip_from_world * vec4f(swayed(tree, pose.at, material.tree_height_m, material.tree_foot_m), 1.0);
    seen.uv = corner.uv;
    seen.at = corner.position;
    seen.facing = dot(turned(tree.rotation, pose.normal), frame.toward_sun);
    seen.share = share_of(tree, corner.normal, true);
    return seen;
}

@fragment
fn fs_main(seen: Cast) {
    if !casts(seen) {
        discard;
    }
}
