// Leaves of many levels of detail into the sun's map.
#import shared/leaves
#import shared/presence
#import shared/cast

@vertex
fn vs_main(@builtin(vertex_index) number: u32, bearer: Bearer) -> Cast {
    let tree = standing(bearer.place, bearer.rotation);
    let leaf = leaf_vertex(number);
    var out: Cast;
    out.position = frame.sun_clip_from_world * vec4f(swayed(tree, leaf.position, material.tree_height_m), 1.0);
    out.uv = leaf.uv;
    out.at = leaf.position;
    out.facing = dot(turned(tree.rotation, leaf.normal), frame.toward_sun);
    out.share = share_of(tree, true);
    return out;
}

@fragment
fn fs_main(out: Cast) {
    if !casts(out) {
        discard;
    }
}
