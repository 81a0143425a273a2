// Leaves of many levels of detail into the sun's map.
#import shared/leaves
#import shared/presence
#import shared/cast

@vertex
fn vs_main(@builtin(vertex_index) number: u32, bearer: Bearer) -> Cast {
    let tree = standing(bearer.place, bearer.rotation);
    let leaf = leaf_vertex(number);
    var thrown: Cast;
    thrown.position = frame.sun_clip_from_world * vec4f(swayed(tree, leaf.position, material.tree_height_m, material.tree_foot_m), 1.0);
    thrown.uv = leaf.uv;
    thrown.at = leaf.position;
    thrown.facing = dot(turned(tree.rotation, leaf.normal), frame.toward_sun);
    thrown.share = share_of(tree, leaf.normal, true);
    return thrown;
}

@fragment
fn fs_main(thrown: Cast) {
    if !casts(thrown) {
        discard;
    }
}
