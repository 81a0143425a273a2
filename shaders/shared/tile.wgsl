// Tiles of the picture, in which work on outlines is done: column | row << 16.
const TILE_PX: u32 = {TILE_PX};

// The top left pixel of a tile.
fn tile_corner(tile: u32) -> vec2u {
    return vec2u(tile & 0xffffu, tile >> 16u) * TILE_PX;
}
