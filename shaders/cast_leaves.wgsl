// Leaves of many levels of detail into the sun's map.
#import shared/leaves
#import shared/cast

@vertex
fn vs_main(@builtin(vertex_index) number: u32, bearer: Bearer) -> Cast {
    let leaf = leaf_vertex(number);
    return toward_sun(standing(bearer.place, bearer.rotation), leaf.position, leaf.normal, leaf.uv);
}
