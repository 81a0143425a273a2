// Octahedral impostors (Brucks 2018; repr::Octahedral): a card that faces whoever sees it, on which the pictures from the three nearest of
// many directions are laid over one another, each shifted by its depth to where the line of sight meets what it shows.
#import shared/corner
#import shared/presence
#import shared/fade

struct Looked {
    @builtin(position) position: vec4f,
    // On the card: object space, and world space in the wind.
    @location(0) at: vec3f,
    @location(1) world: vec3f,
    // The eye (w = 1), or the direction towards it (w = 0), object space.
    @location(2) @interpolate(flat) eye: vec4f,
    // The frame at the corner of the cell of the grid that is looked from, and which of its two triangles.
    @location(3) @interpolate(flat) cell: vec3u,
    // Of the frame at the cell's corner, of its neighbour along that triangle, of the far corner.
    @location(4) @interpolate(flat) weights: vec3f,
    @location(5) @interpolate(flat) rotation: vec4f,
    // Middle of the tree's box, world space, and the tree's scale.
    @location(6) @interpolate(flat) tree: vec4f,
    @location(7) @interpolate(flat) share: f32,
}

// How often a picture's depth is asked for where its part of the line of sight is.
const REFINED: i32 = 2;

// The largest that a card gets to hide all of a ball near the eye.
const LARGEST: f32 = 2.0;

// Where on the square of frames (0..grid − 1) a direction lies; from below the horizon, that of the horizon.
fn on_grid(toward: vec3f) -> vec2f {
    var up = vec3f(toward.x, max(toward.y, 0.0), toward.z);
    let size = abs(up.x) + up.y + abs(up.z);
    up = select(vec3f(0.0, 0.0, 1.0), up / max(size, 1e-6), size > 1e-6);
    return 0.5 * f32(presence.grid - 1u) * (vec2f(up.x - up.z, up.x + up.z) + 1.0);
}

// Towards the viewer of a frame, unit length: repr::Octahedral::direction.
fn frame_direction(place: vec2u) -> vec3f {
    let uv = 2.0 * vec2f(place) / f32(presence.grid - 1u) - 1.0;
    let level = 0.5 * vec2f(uv.x + uv.y, uv.y - uv.x);
    return normalize(vec3f(level.x, 1.0 - abs(level.x) - abs(level.y), level.y));
}

fn look(corner: Corner, for_sun: bool) -> Looked {
    let tree = tree_of(corner);
    let toward = toward_seer(tree, presence.pivot, for_sun);
    let pose = posed(tree, corner.position, corner.normal, for_sun);
    var seen: Looked;
    seen.eye = vec4f(toward, 0.0);
    var larger = 1.0;
    if !for_sun && frame.layer == 0.0 {
        seen.eye = vec4f(turned_back(tree.rotation, frame.eye - tree.foot) / tree.scale, 1.0);
        // A ball hides more of its plane than its own radius, the nearer the more.
        let near = presence.radius_m / max(distance(seen.eye.xyz, presence.pivot), 1e-6);
        larger = min(inverseSqrt(max(1.0 - near * near, 1e-6)), LARGEST);
    }
    seen.at = presence.pivot + larger * (pose.at - presence.pivot);
    seen.world = swayed(tree, seen.at, material.tree_height_m, material.tree_foot_m);
    let place = on_grid(toward);
    let first = clamp(floor(place), vec2f(0.0), vec2f(f32(presence.grid - 2u)));
    let part = place - first;
    let below = part.x > part.y;
    seen.cell = vec3u(vec2u(first), select(0u, 1u, below));
    // Squared: leaves of several pictures never quite meet, and the more one picture leads the crisper they are.
    let weights = vec3f(1.0 - max(part.x, part.y), abs(part.x - part.y), min(part.x, part.y));
    seen.weights = weights * weights / dot(weights, weights);
    seen.rotation = tree.rotation;
    seen.tree = vec4f(still(tree, material.tree_center), tree.scale);
    seen.share = share_of(tree, toward, for_sun);
    return seen;
}

// What is found on a line of sight.
struct Found {
    // Straight alpha.
    color: vec4f,
    // How much of it is foliage rather than wood, 0..1.
    leaf: f32,
    // Object space.
    normal: vec3f,
    at: vec3f,
    // World space.
    world: vec3f,
}

// A frame's texture coordinates at a place of it, metres from its middle; half a texel of its smaller sizes is kept from its edge.
fn in_atlas(place: vec2u, at: vec2f, edge: f32) -> vec2f {
    let uv = clamp(0.5 + 0.5 * vec2f(at.x, -at.y) / presence.radius_m, vec2f(edge), vec2f(1.0 - edge));
    return (vec2f(place) + uv) / f32(presence.grid);
}

// The normal that is seen from the front at a place of its stereographic projection: means of places are nearly those of directions.
fn toward_viewer(place: vec2f) -> vec3f {
    let square = dot(place, place);
    return vec3f(2.0 * place, 1.0 - square) / (1.0 + square);
}

fn found(seen: Looked) -> Found {
    let toward = select(seen.eye.xyz, normalize(seen.eye.xyz - seen.at), seen.eye.w > 0.0);
    let across_px = f32(textureDimensions(color_texture).x) / f32(presence.grid);
    let finest = log2(max(footprint(seen.at) * across_px / (2.0 * presence.radius_m), 1e-6));
    let level = clamp(finest, 0.0, max(log2(across_px) - 2.0, 0.0));
    let edge = 0.5 * exp2(ceil(level)) / across_px;
    let from_middle = seen.at - presence.pivot;
    var color = vec4f(0.0);
    var normal = vec3f(0.0);
    var nearer = 0.0;
    var leaf = 0.0;
    for (var k = 0; k < 3; k++) {
        let side = select(vec2u(0u, 1u), vec2u(1u, 0u), seen.cell.z == 1u);
        let place = seen.cell.xy + select(select(vec2u(0u), side, k == 1), vec2u(1u), k == 2);
        let axes = card_axes(frame_direction(place), false);
        // Seen edge-on, as by who stands below the horizon, a picture's depth would lead astray.
        let facing = max(dot(toward, axes[2]), 0.25);
        var way = -dot(from_middle, axes[2]) / facing;
        for (var i = 0; i < REFINED; i++) {
            let p = from_middle + way * toward;
            let depth = textureSampleLevel(normal_texture, color_sampler, in_atlas(place, vec2f(dot(p, axes[0]), dot(p, axes[1])), edge), level).a;
            way = ((2.0 * depth - 1.0) * presence.radius_m - dot(from_middle, axes[2])) / facing;
        }
        let p = from_middle + way * toward;
        let at = vec2f(dot(p, axes[0]), dot(p, axes[1]));
        let uv = in_atlas(place, at, edge);
        let texel = textureSampleLevel(color_texture, color_sampler, uv, level);
        let inside = max(abs(at.x), abs(at.y)) < presence.radius_m;
        let weight = select(0.0, seen.weights[k] * texel.a, inside);
        color += weight * vec4f(texel.rgb, 1.0);
        let painted = textureSampleLevel(normal_texture, color_sampler, uv, level);
        let n = toward_viewer(2.0 * painted.rg - 1.0);
        normal += weight * (n.x * axes[0] + n.y * axes[1] + n.z * axes[2]);
        leaf += weight * painted.b;
        nearer += weight * way;
    }
    let whole = 1.0 / max(color.a, 1e-6);
    let long = length(normal);
    var it: Found;
    it.color = material.factor * vec4f(whole * color.rgb, color.a);
    it.leaf = whole * leaf;
    it.normal = select(vec3f(0.0, 1.0, 0.0), normal / max(long, 1e-6), long > 1e-6);
    it.at = seen.at + whole * nearer * toward;
    it.world = seen.world + seen.tree.w * turned(seen.rotation, whole * nearer * toward);
    return it;
}

fn is_found(it: Found, seen: Looked) -> bool {
    return is_there(it.color.a, seen.share, it.at, footprint(seen.at));
}
