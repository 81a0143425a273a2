// What stands between the sun and everything else: meshes into its map.
#import shared/corner
#import shared/cast

@vertex
fn vs_main(corner: Corner) -> Cast {
    return toward_sun(tree_of(corner), corner.position, corner.normal, corner.uv);
}
