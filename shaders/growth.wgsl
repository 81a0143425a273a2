// Growth of crown outlines (She §3.3, fig. 13) over the screen tiles that crowns near enough to grow touch:
// detect roots -> plan -> nearest depth per grown pixel -> settle ties -> emit winners as points -> forget.
// Every decision is made in whole numbers, so that the CPU twin (render::growth_twin) makes the same.
#import shared/id
#import shared/tile
#import shared/grown

// Mirrors gpu::layout::GrowthFrame.
struct GrowthFrame {
    size_px: vec2u,
    // Pixels per metre at depth d are x + y · d.
    px_per_m: vec2f,
    // Perspective: near plane · 2^24, metres; parallel: depth range, metres.
    depth_units: f32,
    orthographic: u32,
    // 1: the last, partly covered pixel of a growth is drawn with its coverage; 0: it is left out.
    tips: u32,
    // 1: outlines before deeper trees grow too.
    inner: u32,
    // 1: the paper's lengths, new for every pixel and frame.
    random: u32,
    frame: u32,
    // 1: pixels with two background neighbours beside each other are roots too.
    corners: u32,
    tile_count: u32,
    // No crown takes for background what is nearer than its own depth · x − y: a quick test that spares the exact one.
    alike: vec2f,
}

// Mirrors gpu::layout::Counts.
struct Counts {
    // The first four are the arguments of the points' indirect draw.
    grown: atomic<u32>,
    instances: u32,
    first_vertex: u32,
    first_instance: u32,
    roots: atomic<u32>,
}

@group(0) @binding(0) var<storage, read> growth: GrowthFrame;
@group(0) @binding(1) var tree_color: texture_2d<f32>;
@group(0) @binding(2) var tree_depth: texture_depth_2d;
@group(0) @binding(3) var<storage, read_write> counts: Counts;
// x: pixel x | y << 16; y: length in sixteenths of a pixel | sides << 16. Room for all pixels, of which each is a root once at most.
@group(0) @binding(4) var<storage, read_write> roots: array<vec2u>;
// What finds roots. Each step has a group of its own, so that none needs more than the eight storage buffers that every adapter has.
@group(1) @binding(0) var<storage, read> crowns: array<GrowingCrown>;
@group(1) @binding(1) var<storage, read> limbs: array<u32>;
@group(1) @binding(2) var<storage, read> tiles: array<u32>;
@group(1) @binding(3) var tree_id: texture_2d<u32>;
@group(1) @binding(4) var depth_sampler: sampler;
// What plans the walks along their growths.
@group(2) @binding(0) var<storage, read_write> plan: array<u32, 3>;
// What the walks fill; each pixel grows once at most.
@group(3) @binding(0) var<storage, read_write> nearest: array<atomic<u32>>;
@group(3) @binding(1) var<storage, read_write> keys: array<atomic<u32>>;
@group(3) @binding(2) var<storage, read_write> places: array<GrownPlace>;
@group(3) @binding(3) var<storage, read_write> colors: array<GrownColor>;

// Bits of the longest growth in pixels, and that in sixteenths.
const LENGTH_BITS: u32 = {LENGTH_BITS};
const LONGEST: f32 = f32(16u * ((1u << LENGTH_BITS) - 1u));
const NO_ROOT: u32 = 8u;
const ROOTS_PER_GROUP: u32 = {ROOTS_PER_GROUP};
// Invocations along each side of a tile.
const TILE_SIDE: u32 = TILE_PX / 2u;
// Facing up to which an outline grows in full, and what each step beyond takes off, of 64.
const FACING_FULL: u32 = 26u;
const FACING_LOSS: u32 = 3u;

// The neighbours R, T, L, B; y runs down.
fn side_step(side: u32) -> vec2i {
    // Arithmetic, since software drivers are slow with arrays.
    let s = i32(side);
    return select(vec2i(1 - s, 0), vec2i(0, s - 2), (side & 1u) == 1u);
}

// The i-th pixel of a growth, seen from its root. Steps alternate between two sides, so that slanted growths of neighbouring roots
// leave no holes; straight growths have the same side twice.
fn offset_of(sides: u32, i: i32) -> vec2i {
    return ((i + 1) / 2) * side_step(sides & 3u) + (i / 2) * side_step(sides >> 2u);
}

// The two sides that a growth towards `octant` alternates between, first one that is background.
fn sides_of(axis: u32, octant: u32) -> u32 {
    let before = (octant >> 1u) & 3u;
    let after = ((octant + 1u) >> 1u) & 3u;
    var first = axis >> 1u;
    if (axis & 1u) == 1u {
        // A corner: both of its sides are; of the growth between them the level one comes first.
        let level = select(before, after, (before & 1u) == 1u);
        first = select(select(after, before, octant == ((axis + 2u) & 7u)), level, octant == axis);
    }
    first = select(first, before, before == after);
    let second = select(after, before, first == after);
    return first | (second << 2u);
}

// How many octants a root turns from its axis towards a direction `turn` octants from it: one, and a corner two (fig. 13c).
fn way_of(axis: u32, turn: u32) -> u32 {
    let most = 1u + (axis & 1u);
    return select(select(8u - min(8u - turn, most), min(turn, most), turn < 4u), 0u, turn == 0u || turn == 4u);
}

fn in_picture(at: vec2i) -> bool {
    return all(at >= vec2i(0)) && all(at < vec2i(growth.size_px));
}

// Depth as a whole number.
fn whole(depth: f32) -> u32 {
    return u32(depth * 16777216.0);
}

fn depth_at(at: vec2i) -> u32 {
    return whole(textureLoad(tree_depth, at, 0));
}

// Whether what has depth `other` is background for a root of depth `own`.
fn is_behind(own: u32, other: u32, gap_m: f32) -> bool {
    if other == 0u {
        return true;
    }
    if growth.inner == 0u || other >= own {
        return false;
    }
    let product = select(f32(own) * f32(other), 16777216.0, growth.orthographic != 0u);
    return growth.depth_units * f32(own - other) > gap_m * product;
}

fn scrambled(word: u32) -> u32 {
    // Lowbias32 of Wellons' hash prospector.
    var h = word;
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    return h ^ (h >> 16u);
}

// Length in sixteenths of a pixel, and sides, of the growth of a root whose background lies in octant `axis`.
fn growth_of(at: vec2i, id: u32, axis: u32) -> vec2u {
    let crown = crowns[slot_of(id)];
    let place = id & ((1u << PLACE_BITS) - 1u);
    let facing = (id >> PLACE_BITS) & ((1u << FACING_BITS) - 1u);
    var limb = limbs[crown.first + ((place * crown.count) >> PLACE_BITS)];
    if growth.random != 0u {
        let h = scrambled(scrambled(u32(at.y) * growth.size_px.x + u32(at.x)) ^ growth.frame);
        let way = (axis + ((0x710u >> (4u * ((h >> 16u) % 3u))) & 7u)) & 7u;
        limb = (h & 0xffffu) | (way << 21u);
    }
    let scale = u32(min(growth.px_per_m.x + growth.px_per_m.y * textureLoad(tree_depth, at, 0), 65535.0) * 256.0);
    let longest = u32(min(crown.max_units * f32(scale), LONGEST));
    let shortest = min(u32(min(crown.min_units * f32(scale), LONGEST)), longest);
    if longest < 16u {
        return vec2u(0u);
    }
    let full = shortest + (((longest - shortest) * (limb & 0xffffu)) >> 16u);
    let loss = min((max(facing, FACING_FULL) - FACING_FULL) * FACING_LOSS, 64u);
    let turn = ((((limb >> 16u) + 16u) >> 5u) - axis) & 7u;
    let way = way_of(axis, turn);
    return vec2u((full * (64u - loss)) >> 6u, sides_of(axis, (axis + way) & 7u));
}

// The growth without what would run out of the picture or into something that is not behind its root.
fn clipped(at: vec2i, own: u32, gap_m: f32, growing: vec2u) -> u32 {
    let last = i32((growing.x + 15u) / 16u);
    for (var i = 1; i <= last; i++) {
        let next = at + offset_of(growing.y, i);
        if !in_picture(next) || !is_behind(own, depth_at(next), gap_m) {
            return min(growing.x, u32(i - 1) * 16u);
        }
    }
    return growing.x;
}

// The octant towards the background of a root, of whose neighbours those in `open` (bits R, T, L, B) are background: exactly one
// (fig. 13b) or, where corners grow, two beside each other.
fn axis_of(open: u32) -> u32 {
    // Four bits for each of the sixteen; 8 is no root.
    let axis = (select(0x83841208u, 0x88858876u, open >= 8u) >> (4u * (open & 7u))) & 15u;
    return select(axis, NO_ROOT, growth.corners == 0u && (axis & 1u) == 1u);
}

// Each invocation looks at 2×2 pixels: four gathers bring them with their neighbours. Beyond the picture's edge a pixel is its own
// neighbour.
@compute @workgroup_size(TILE_SIDE, TILE_SIDE)
fn cs_main_detect(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let number = group.y * groups.x + group.x;
    if number >= growth.tile_count {
        return;
    }
    let at = vec2i(tile_corner(tiles[number]) + 2u * local.xy);
    if !in_picture(at) {
        return;
    }
    let px = 1.0 / vec2f(growth.size_px);
    let corner = vec2f(at) * px;
    // Bottom left, bottom right, top right, top left of the four pixels round a corner.
    let a = textureGather(tree_depth, depth_sampler, corner);
    let b = textureGather(tree_depth, depth_sampler, corner + vec2f(2.0, 0.0) * px);
    let c = textureGather(tree_depth, depth_sampler, corner + vec2f(0.0, 2.0) * px);
    let d = textureGather(tree_depth, depth_sampler, corner + vec2f(2.0, 2.0) * px);
    detect(at, a.y, vec4f(b.x, a.z, a.x, c.z));
    detect(at + vec2i(1, 0), b.x, vec4f(b.y, b.w, a.y, d.w));
    detect(at + vec2i(0, 1), c.z, vec4f(d.w, a.y, c.w, c.y));
    detect(at + vec2i(1, 1), d.w, vec4f(d.z, b.x, c.z, d.x));
}

// Makes a pixel of depth `near`, whose neighbours R, T, L, B have the depths `beside`, a root if it is one.
fn detect(at: vec2i, near: f32, beside: vec4f) {
    // Most pixels lie inside a crown or where nothing is.
    let lowest = min(min(beside.x, beside.y), min(beside.z, beside.w));
    if near == 0.0 || lowest > max(near * growth.alike.x - growth.alike.y, 0.0) || !in_picture(at) {
        return;
    }
    let id = textureLoad(tree_id, at, 0).x;
    let slot = slot_of(id);
    if slot == 0u {
        return;
    }
    let own = whole(near);
    let gap_m = crowns[slot].gap_m;
    let open = select(0u, 1u, is_behind(own, whole(beside.x), gap_m)) | select(0u, 2u, is_behind(own, whole(beside.y), gap_m))
        | select(0u, 4u, is_behind(own, whole(beside.z), gap_m)) | select(0u, 8u, is_behind(own, whole(beside.w), gap_m));
    let axis = axis_of(open);
    if axis == NO_ROOT {
        return;
    }
    let growing = growth_of(at, id, axis);
    let length = clipped(at, own, gap_m, growing);
    if length + growth.tips * 15u < 16u {
        return;
    }
    roots[atomicAdd(&counts.roots, 1u)] = vec2u(u32(at.x) | (u32(at.y) << 16u), length | (growing.y << 16u));
}

@compute @workgroup_size(1)
fn cs_main_plan() {
    let groups = (atomicLoad(&counts.roots) + ROOTS_PER_GROUP - 1u) / ROOTS_PER_GROUP;
    plan[0] = min(groups, 32768u);
    plan[1] = (groups + 32767u) / 32768u;
    plan[2] = 1u;
}

struct Path {
    root: vec2i,
    sides: u32,
    length: u32,
    // Pixels on it.
    count: i32,
    // Of the root, as bits: greater is nearer.
    depth: u32,
}

// The growth of the root that an invocation has to walk; of no pixels where there is none.
fn path_of(group: vec3u, groups: vec3u, local: u32) -> Path {
    let index = (group.y * groups.x + group.x) * ROOTS_PER_GROUP + local;
    if index >= atomicLoad(&counts.roots) {
        return Path();
    }
    let root = roots[index];
    let at = vec2i(vec2u(root.x & 0xffffu, root.x >> 16u));
    let length = root.y & 0xffffu;
    let count = i32((length + growth.tips * 15u) / 16u);
    return Path(at, root.y >> 16u, length, count, bitcast<u32>(textureLoad(tree_depth, at, 0)));
}

fn index_of(at: vec2i) -> u32 {
    return u32(at.y) * growth.size_px.x + u32(at.x);
}

// Greater wins: fewer steps from the root, then the lower root. Never 0, which stands for none.
fn key_of(path: Path, i: i32) -> u32 {
    let bits = LENGTH_BITS + 1u;
    let back = vec2u(vec2i(1 << LENGTH_BITS) - offset_of(path.sides, i));
    return 0xffffffffu - ((u32(i) << (2u * bits)) | (back.y << bits) | back.x);
}

// What pixel `i` of a path weighs where growths meet: whole pixels before tips, then the nearer.
fn rank_of(path: Path, i: i32) -> u32 {
    return path.depth | select(0u, 0x80000000u, u32(i) * 16u <= path.length);
}

@compute @workgroup_size(ROOTS_PER_GROUP)
fn cs_main_nearest(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let path = path_of(group, groups, local);
    for (var i = 1; i <= path.count; i++) {
        atomicMax(&nearest[index_of(path.root + offset_of(path.sides, i))], rank_of(path, i));
    }
}

@compute @workgroup_size(ROOTS_PER_GROUP)
fn cs_main_settle(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let path = path_of(group, groups, local);
    for (var i = 1; i <= path.count; i++) {
        let index = index_of(path.root + offset_of(path.sides, i));
        if atomicLoad(&nearest[index]) == rank_of(path, i) {
            atomicMax(&keys[index], key_of(path, i));
        }
    }
}

@compute @workgroup_size(ROOTS_PER_GROUP)
fn cs_main_emit(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let path = path_of(group, groups, local);
    let color = textureLoad(tree_color, path.root, 0);
    for (var i = 1; i <= path.count; i++) {
        let at = path.root + offset_of(path.sides, i);
        let index = index_of(at);
        if atomicLoad(&nearest[index]) != rank_of(path, i) || atomicLoad(&keys[index]) != key_of(path, i) {
            continue;
        }
        let slot = atomicAdd(&counts.grown, 1u);
        let coverage = f32(min(path.length - u32(i - 1) * 16u, 16u)) / 16.0;
        places[slot] = GrownPlace(u32(at.x) | (u32(at.y) << 16u), bitcast<f32>(path.depth));
        colors[slot] = GrownColor(pack2x16float(color.rg), pack2x16float(vec2f(color.b, coverage)));
    }
}

// What was touched is made clean, so that the next frame need not clear everything.
@compute @workgroup_size(ROOTS_PER_GROUP)
fn cs_main_forget(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let path = path_of(group, groups, local);
    for (var i = 1; i <= path.count; i++) {
        let index = index_of(path.root + offset_of(path.sides, i));
        atomicStore(&nearest[index], 0u);
        atomicStore(&keys[index], 0u);
    }
}
