// Leaves of many levels of detail into the sun's map.
#import shared/leaves
#import shared/presence
#import shared/cast

@vertex
fn vs_main(@builtin(vertex_index) number: u32, bearer: Bearer) -> Cast {
    let tree = standing(bearer.place, bearer.rotation);
    let leaf = leaf_vertex(number);
    var cast: Cast;
    cast.position = frame.sun_clip_from_world * vec4f(swayed(tree, leaf.position, material.tree_height_m), 1.0);
    cast.uv = leaf.uv;
    cast.at = leaf.position;
    cast.facing = dot(turned(tree.rotation, leaf.normal), frame.toward_sun);
    cast.share = share_of(tree, leaf.normal, true);
    return cast;
}

@fragment
fn fs_main(cast: Cast) {
    if !casts(cast) {
        discard;
    }
}
