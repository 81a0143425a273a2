// Smooth outlines of the trees (She fig. 15 d): collect the pixels on outlines -> plan -> mix the colours that they have in the end.
// They are few. If every pixel were asked in a branch, all would pay for it: software drivers execute both sides.
#import shared/outline
#import shared/tile

// Mirrors gpu::layout::Smoothed.
struct Smoothed {
    // The first four are the arguments of the points' indirect draw.
    pixels: atomic<u32>,
    instances: u32,
    first_vertex: u32,
    first_instance: u32,
    tiles: u32,
}

@group(1) @binding(1) var tree_color: texture_2d<f32>;
// The frame before trees are composited into it.
@group(1) @binding(2) var frame_color: texture_2d<f32>;
@group(1) @binding(3) var frame_depth: texture_depth_2d;
@group(1) @binding(4) var depth_sampler: sampler;
@group(1) @binding(5) var<storage, read> tiles: array<u32>;
@group(1) @binding(6) var<storage, read_write> smoothed: Smoothed;
// x | y << 16. Room for all pixels of the picture, of which each is there once at most.
@group(1) @binding(7) var<storage, read_write> pixels: array<u32>;
// Premultiplied red and green, blue and alpha as 16-bit floats.
@group(1) @binding(8) var<storage, read_write> colors: array<vec2u>;
@group(2) @binding(0) var<storage, read_write> plan: array<u32, 3>;

// Invocations along each side of a tile.
const TILE_SIDE: u32 = TILE_PX / 2u;
const PIXELS_PER_GROUP: u32 = 64u;

// Each invocation looks at 2×2 pixels: four gathers bring them with their neighbours. Beyond the picture's edge a pixel is its own
// neighbour.
@compute @workgroup_size(TILE_SIDE, TILE_SIDE)
fn cs_main_collect(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let number = group.y * groups.x + group.x;
    if number >= smoothed.tiles {
        return;
    }
    let at = tile_corner(tiles[number]) + 2u * local.xy;
    let size = textureDimensions(tree_depth);
    let px = 1.0 / vec2f(size);
    let corner = vec2f(at) * px;
    // Bottom left, bottom right, top right, top left of the four pixels round a corner.
    let a = textureGather(tree_depth, depth_sampler, corner);
    let b = textureGather(tree_depth, depth_sampler, corner + vec2f(2.0, 0.0) * px);
    let c = textureGather(tree_depth, depth_sampler, corner + vec2f(0.0, 2.0) * px);
    let d = textureGather(tree_depth, depth_sampler, corner + vec2f(2.0, 2.0) * px);
    let room = at + 1u < size;
    // A bit for each of the four.
    var found = select(0u, 1u, is_outline(a.y, vec4f(b.x, a.z, a.x, c.z)) && all(at < size));
    found |= select(0u, 2u, is_outline(b.x, vec4f(b.y, b.w, a.y, d.w)) && room.x && at.y < size.y);
    found |= select(0u, 4u, is_outline(c.z, vec4f(d.w, a.y, c.w, c.y)) && at.x < size.x && room.y);
    found |= select(0u, 8u, is_outline(d.w, vec4f(d.z, b.x, c.z, d.x)) && all(room));
    if found == 0u {
        return;
    }
    var slot = atomicAdd(&smoothed.pixels, countOneBits(found));
    for (; found != 0u; found &= found - 1u) {
        let i = firstTrailingBit(found);
        pixels[slot] = (at.x + (i & 1u)) | ((at.y + (i >> 1u)) << 16u);
        slot++;
    }
}

// Whether an outline runs between a pixel and any of its neighbours.
fn is_outline(own: f32, beside: vec4f) -> bool {
    let farthest = min(min(beside.x, beside.y), min(beside.z, beside.w));
    let nearest = max(max(beside.x, beside.y), max(beside.z, beside.w));
    return is_before(own, farthest) || is_before(nearest, own);
}

@compute @workgroup_size(1)
fn cs_main_plan() {
    let groups = (atomicLoad(&smoothed.pixels) + PIXELS_PER_GROUP - 1u) / PIXELS_PER_GROUP;
    plan[0] = min(groups, 32768u);
    plan[1] = (groups + 32767u) / 32768u;
    plan[2] = 1u;
}

fn over(color: vec4f, below: vec4f) -> vec4f {
    return color + (1.0 - color.a) * below;
}

@compute @workgroup_size(PIXELS_PER_GROUP)
fn cs_main_mix(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let index = (group.y * groups.x + group.x) * PIXELS_PER_GROUP + local;
    if index >= atomicLoad(&smoothed.pixels) {
        return;
    }
    let pixel = pixels[index];
    let at = vec2i(vec2u(pixel & 0xffffu, pixel >> 16u));
    let depth = depth_of(at);
    // What is left of the pixel where the outline cuts it, and what nearer outlines gain of it.
    var left = textureLoad(tree_color, at, 0);
    var gained = vec4f(0.0);
    var nearest = 0.0;
    for (var sides = outlined_sides(at, depth); sides != 0u; sides &= sides - 1u) {
        let beside = at + side_step(firstTrailingBit(sides));
        let other = depth_of(beside);
        let loses = other < depth;
        let area = outline_area(select(beside, at, loses), select(at, beside, loses), min(depth, other));
        // Behind stands another tree, or what the frame already holds.
        let there = select(vec4f(0.0), textureLoad(tree_color, beside, 0), other > 0.0);
        left = mix(left, there, select(0.0, area.x, loses));
        gained += there * select(area.y, 0.0, loses);
        nearest = max(nearest, select(other, 0.0, loses));
    }
    let behind = textureLoad(frame_depth, at, 0);
    var color = textureLoad(frame_color, at, 0);
    color = select(color, over(left, color), depth > behind);
    color = select(color, over(gained / max(gained.a, 1.0), color), nearest > behind);
    colors[index] = vec2u(pack2x16float(color.rg), pack2x16float(color.ba));
}

// The neighbours of a pixel from which an outline parts it: bits R, T, L, B.
fn outlined_sides(at: vec2i, depth: f32) -> u32 {
    var sides = 0u;
    for (var side = 0u; side < 4u; side++) {
        let other = depth_of(at + side_step(side));
        sides |= select(0u, 1u << side, is_before(depth, other) || is_before(other, depth));
    }
    return sides;
}
