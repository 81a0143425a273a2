// Pixels that have grown, as points to draw; mirror gpu::layout::GrownPlace and GrownColor.
struct GrownPlace {
    // x | y << 16.
    pixel: u32,
    depth: f32,
}

struct GrownColor {
    red_green: u32,
    blue_coverage: u32,
}
