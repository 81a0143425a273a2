// Leaves on their way to another level of detail into the sun's map.
#import shared/leaves
#import shared/cast

@vertex
fn vs_main(corner: Corner) -> Cast {
    let leaf = on_its_way(corner);
    return toward_sun(standing(corner.place, corner.rotation), leaf.position, leaf.normal, corner.uv);
}
