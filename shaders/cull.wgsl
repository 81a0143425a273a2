// Which of the trees that may be in a list are: test -> sum -> list -> calls (render::crowd::compute).
//
// The candidates of all lists lie in a row, those of each list from a whole block of 64 on; whole spans of them are told by where they
// begin. Each block is asked and remembers whom it keeps; each list sums up what its blocks keep before each of them; so every tree that is
// kept knows its place in its list. Order is that of the candidates, whatever the device does first.
#import shared/seen
#import shared/many

// Mirrors gpu::layout::CullLook.
struct CullLook {
    // Positive inside.
    planes: array<vec4f, 6>,
    eye: vec3f,
    // No tree is nearer.
    near_m: f32,
    // A metre at distance d is x + y / d pixels.
    px_per_m: vec2f,
    // The wind pushes a tree of height h at most x · h + y.
    sway: vec2f,
    // Trees lower than that in the picture are left out.
    least_px: f32,
    // 1: the lists of the sun's map.
    for_sun: u32,
    pad: vec2f,
}

// Mirrors gpu::layout::CullGroup.
struct CullGroup {
    seen: Presence,
    facing: u32,
    // Of the species, unscaled: its height; the ball around it, and how high the middle of that is.
    height_m: f32,
    radius_m: f32,
    center_m: f32,
}

// Mirrors gpu::layout::CullSpan.
struct CullSpan {
    at: u32,
    tree: u32,
    count_and_tests: u32,
}

// Mirrors gpu::layout::CullBlock.
struct CullBlock {
    list: u32,
    first_span: u32,
    // A bit for each candidate.
    kept_low: u32,
    kept_high: u32,
    // Kept by the list's blocks before it.
    before: u32,
}

// Mirrors gpu::layout::CullList.
struct CullList {
    first_block: u32,
    blocks: u32,
    kept: u32,
}

// Mirrors gpu::layout::CullCall: the arguments of an indirect draw, and whose trees it draws.
struct CullCall {
    corners: u32,
    trees: u32,
    first_corner: u32,
    base_vertex: u32,
    first_tree: u32,
    list: u32,
}

// Candidates of a block: the bits of two words.
const CULL_BLOCK: u32 = {CULL_BLOCK};
// Invocations that sum up a list.
const CULL_STRIPS: u32 = {CULL_STRIPS};
// What is to be asked of a span's trees: bits above the number of them.
const CULL_IN_PICTURE: u32 = {CULL_IN_PICTURE};
const CULL_LEVEL: u32 = {CULL_LEVEL};

// Beside the frame. The first step and the others have groups of their own, so that none needs more than the eight storage buffers that
// every adapter has.
@group(0) @binding(1) var<storage, read> spans: array<CullSpan>;
@group(0) @binding(2) var<storage, read_write> blocks: array<CullBlock>;
@group(1) @binding(0) var<storage, read> look: CullLook;
@group(1) @binding(1) var<storage, read> many: array<Placed>;
@group(1) @binding(2) var<storage, read> groups: array<CullGroup>;
@group(2) @binding(0) var<storage, read_write> lists: array<CullList>;
@group(2) @binding(1) var<storage, read_write> entries: array<u32>;
@group(2) @binding(2) var<storage, read_write> calls: array<CullCall>;

// More workgroups than one axis takes lie in rows.
fn number_of(workgroup: vec3u, workgroups: vec3u) -> u32 {
    return workgroup.x + workgroup.y * workgroups.x;
}

// A candidate: which tree, and what is to be asked of it.
struct Candidate {
    is_one: bool,
    tree: u32,
    tests: u32,
}

fn candidate(block: u32, number: u32) -> Candidate {
    let at = block * CULL_BLOCK + number;
    var span = blocks[block].first_span;
    // The last span of all is never reached: it begins beyond any candidate.
    while spans[span + 1u].at <= at {
        span++;
    }
    let found = spans[span];
    let count = found.count_and_tests & (min(CULL_LEVEL, CULL_IN_PICTURE) - 1u);
    return Candidate(at - found.at < count, found.tree + (at - found.at), found.count_and_tests);
}

// As render::crowd::cull has it.
fn is_in_picture(placed: Placed, scale: f32, group: CullGroup) -> bool {
    let center = placed.position + vec3f(0.0, scale * group.center_m, 0.0);
    let height_m = scale * group.height_m;
    let radius_m = scale * group.radius_m + look.sway.x * height_m + look.sway.y;
    var inside = true;
    for (var i = 0; i < 6; i++) {
        inside = inside && dot(look.planes[i], vec4f(center, 1.0)) >= -radius_m;
    }
    let px_per_m = look.px_per_m.x + look.px_per_m.y / max(distance(look.eye, center), look.near_m);
    return inside && px_per_m * height_m >= look.least_px;
}

fn is_kept(one: Candidate, list: u32) -> bool {
    let group = groups[list];
    let placed = many[one.tree];
    let tree = standing_of(placed);
    let in_picture = (one.tests & CULL_IN_PICTURE) == 0u || is_in_picture(placed, tree.scale, group);
    let share = share_seen(group.seen, group.facing, group.height_m, tree, vec3f(0.0), look.for_sun != 0u);
    return in_picture && ((one.tests & CULL_LEVEL) == 0u || share > 0.0);
}

var<workgroup> kept: array<atomic<u32>, 2>;

// Asks every candidate of a block.
@compute @workgroup_size(CULL_BLOCK)
fn cs_main_test(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let block = number_of(workgroup, workgroups);
    let one = candidate(block, number);
    if one.is_one && is_kept(one, blocks[block].list) {
        atomicOr(&kept[number >> 5u], 1u << (number & 31u));
    }
    workgroupBarrier();
    if number == 0u {
        blocks[block].kept_low = atomicLoad(&kept[0]);
        blocks[block].kept_high = atomicLoad(&kept[1]);
    }
}

var<workgroup> sums: array<u32, CULL_STRIPS>;

fn kept_by(block: u32) -> u32 {
    return countOneBits(blocks[block].kept_low) + countOneBits(blocks[block].kept_high);
}

// Sums up a list, in as many strips of its blocks as there are invocations.
@compute @workgroup_size(CULL_STRIPS)
fn cs_main_sum(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) strip: u32,
) {
    let number = min(number_of(workgroup, workgroups), arrayLength(&lists) - 1u);
    let first = lists[number].first_block;
    let end = first + lists[number].blocks;
    let long = (lists[number].blocks + CULL_STRIPS - 1u) / CULL_STRIPS;
    let begin = first + strip * long;
    var sum = 0u;
    for (var block = begin; block < min(begin + long, end); block++) {
        sum += kept_by(block);
    }
    sums[strip] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var other = 0u; other < strip; other++) {
        before += sums[other];
    }
    for (var block = begin; block < min(begin + long, end); block++) {
        blocks[block].before = before;
        before += kept_by(block);
    }
    if strip == CULL_STRIPS - 1u {
        lists[number].kept = before;
    }
}

// Puts those that are kept into their lists, each of which begins where its first candidate was.
@compute @workgroup_size(CULL_BLOCK)
fn cs_main_list(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let which = number_of(workgroup, workgroups);
    let block = blocks[which];
    let bit = 1u << (number & 31u);
    let high = number >= 32u;
    if (select(block.kept_low, block.kept_high, high) & bit) != 0u {
        let earlier = select(block.kept_low, block.kept_high, high) & (bit - 1u);
        let rank = countOneBits(earlier) + select(0u, countOneBits(block.kept_low), high);
        entries[lists[block.list].first_block * CULL_BLOCK + block.before + rank] = candidate(which, number).tree;
    }
}

// Tells every call how many trees it draws.
@compute @workgroup_size(CULL_BLOCK)
fn cs_main_calls(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&calls) {
        calls[id.x].trees = lists[calls[id.x].list].kept;
    }
}
