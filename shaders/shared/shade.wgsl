// The look of a fragment of a tree: what every drawer's fragment stage ends in.
#import shared/part
#import shared/fade
#import shared/id
#import shared/light
#import shared/shadow
#import shared/sky

// What is known of the picture when its pipelines are made (render::pipelines): what surfaces show, and whether there is air to see through.
const SHADING: u32 = {SHADING};
const AIR: bool = {AIR} != 0u;

// Crowns near enough to grow, by slot.
@group(0) @binding(8) var<storage, read> crowns: array<GrowingCrown>;

// What a vertex stage hands over.
struct Seen {
    @builtin(position) position: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    // From the crown's centre (the origin where there is none), object space before the wind.
    @location(3) from_center: vec3f,
    // Slot of its first crown; 0 when none grows.
    @location(4) @interpolate(flat) slot: u32,
    // How much of the part is seen.
    @location(5) @interpolate(flat) share: f32,
    // Middle of its tree's box, world space, and the tree's scale.
    @location(6) @interpolate(flat) tree: vec4f,
}

struct Drawn {
    @location(0) color: vec4f,
    @location(1) id: u32,
}

// How much of the sky and the ground a point sees past its own tree, 0..1: less inside the crown and on its underside.
// `leaf`: how much of it is foliage rather than wood.
fn openness(from_center: vec3f, leaf: f32) -> f32 {
    if !CROWN {
        return mix(0.55, 0.75, leaf);
    }
    let p = from_center / material.crown_reach.xyx;
    let outside = smoothstep(0.35, 1.0, length(p));
    return mix(0.35, 1.0, outside) * mix(0.55, 1.0, smoothstep(-0.9, 0.5, p.y));
}

// How far sunlight gets into a crown before e times as much is left outside, and how deep in it the leaves lie that are seen, in heights of
// the tree. Fitted, so that cards have the mean colour of the grown trees that they were taken of (tests/cards.rs).
const LIGHT_REACHES: f32 = 0.3;
const LEAVES_LIE: f32 = 0.14;
// And the wood that is seen between them: trunk and limbs are under the leaves.
const WOOD_LIES: f32 = 0.35;

// How far a ray goes on in the unit ball, in its own lengths; where it misses, to where it is nearest to the middle.
fn way_out(start: vec3f, along: vec3f) -> f32 {
    let a = dot(along, along);
    let b = dot(start, along);
    return (sqrt(max(b * b - a * (dot(start, start) - 1.0), 0.0)) - b) / a;
}

// Sunlight that reaches the leaves and the wood that a card shows, 0..1 each. They are not where the card is, so that whether the card lies in its tree's
// shadow says nothing of them: planes that cross would darken one another in hard edges, and one that faces the sun would be lit as if
// no leaf shaded another. So the crown is taken for the ellipsoid in its box, the leaves for lying a little behind the side of it that
// is seen, and light for growing weaker on its way to them (Beer's law). What other trees take is asked of the sun's map where the light
// comes in: outside of all that the tree itself is.
fn sun_at_card(world: vec3f, tree: vec4f) -> vec2f {
    let wide = 0.5 * (material.tree_half.x + material.tree_half.z);
    let half = tree.w * vec3f(wide, material.tree_half.y, wide);
    let height_m = tree.w * material.tree_height_m;
    let at = (world - tree.xyz) / half;
    let seer = toward_eye(world);
    let out = max(way_out(at, seer / half), 0.0);
    let to_sun = frame.toward_sun / half;
    let deep = vec2f(LEAVES_LIE, WOOD_LIES) * height_m;
    let way_m = vec2f(way_out(at + (out - deep.x) * seer / half, to_sun), way_out(at + (out - deep.y) * seer / half, to_sun));
    let entry = world + max(way_out(at / 1.75, frame.toward_sun / (1.75 * half)), 0.0) * frame.toward_sun;
    return exp(-max(way_m, vec2f(0.0)) / (LIGHT_REACHES * height_m)) * sun_through_leaves(entry, 0.03 * material.tree_height_m);
}

// Sunlight that reaches leaves of their own, 0..1.
fn sun_at_leaves(world: vec3f) -> f32 {
    let reach = select(0.1 * material.tree_height_m, min(material.crown_reach.x, material.crown_reach.y), CROWN);
    return sun_through_leaves(world, 0.3 * reach);
}

// Sunlight that reaches wood of its own, 0..1.
fn sun_at_wood(world: vec3f, n: vec3f) -> f32 {
    return sun_on_solid(world + 2.0 * frame.shadow_texel_m * n, 0.0);
}

// Sunlight on a point that is foliage to the share `leaf`; of surfaces only a card is both foliage and wood.
fn sun_at(world: vec3f, n: vec3f, tree: vec4f, leaf: f32) -> vec3f {
    if STAND_IN {
        let reaching = sun_at_card(world, tree);
        return leaf * reaching.x * sun_on_foliage(n, toward_eye(world)) + (1.0 - leaf) * reaching.y * sun_on_face(n);
    }
    if FOLIAGE {
        return sun_on_foliage(n, toward_eye(world)) * sun_at_leaves(world);
    }
    return sun_on_face(n) * sun_at_wood(world, n);
}

// A point in the light of sun and sky, through the air.
fn lit(albedo: vec3f, world: vec3f, n: vec3f, from_center: vec3f, tree: vec4f, leaf: f32) -> vec3f {
    let color = albedo * (sun_at(world, n, tree, leaf) + ambient(n) * openness(from_center, leaf));
    if !AIR {
        return held(color);
    }
    return held(through_air(color, eye_of(world), world));
}

// A hue for the distance from which on a part is seen, in heights of its tree: white where it is seen from the nearest on, round the circle
// once in five octaves.
fn level_hue() -> vec3f {
    let turn = log2(max(presence.appears.y, 1e-3)) / 5.0;
    let hue = saturate(abs(fract(vec3f(turn, turn + 2.0 / 3.0, turn + 1.0 / 3.0)) * 6.0 - 3.0) - 1.0);
    return select(hue, vec3f(1.0), presence.appears.y <= 0.0);
}

// What is shown of a point: its colour, the same in light or with its level's hue, or which way it faces.
fn shown(albedo: vec3f, world: vec3f, n: vec3f, from_center: vec3f, tree: vec4f, leaf: f32) -> vec4f {
    if SHADING == LIT {
        return vec4f(lit(albedo, world, n, from_center, tree, leaf), 1.0);
    }
    if SHADING == LEVELS {
        return vec4f(mix(2.0 * albedo, level_hue(), 0.5), 1.0);
    }
    return vec4f(select(albedo, 0.5 + 0.5 * n, SHADING == NORMALS), 1.0);
}

// The normal with what the part's normal map makes of it. Right and up of the texture on the surface come from how position and
// coordinates change from pixel to pixel (Schüler 2013, "Normal mapping without precomputed tangents"); in glTF's textures v runs down and
// green is up. On the back right and up stay where they are on the surface, and only the way out turns round: what is painted on both
// sides of a card leans the same way as seen from either.
fn mapped_normal(seen: Seen, front: bool) -> vec3f {
    let n = normalize(seen.normal);
    let out = select(-n, n, front);
    if !NORMAL_MAPPED {
        return out;
    }
    let px = dpdx(seen.world);
    let py = dpdy(seen.world);
    let ux = dpdx(seen.uv);
    let uy = dpdy(seen.uv);
    let bump = 2.0 * textureSample(normal_texture, color_sampler, seen.uv).xyz - 1.0;
    let across_y = cross(py, n);
    let across_x = cross(n, px);
    let side = select(-1.0, 1.0, dot(across_y, px) > 0.0);
    let right = across_y * ux.x + across_x * uy.x;
    let down = across_y * ux.y + across_x * uy.y;
    let along = side * (bump.x * right / max(length(right), 1e-20) - bump.y * down / max(length(down), 1e-20));
    let mapped = along + bump.z * out;
    let long = length(mapped);
    return select(out, mapped / max(long, 1e-6), long > 1e-3);
}

// How much of a surface is foliage rather than wood. Captured cards have it in the alpha of their normals (repr::card).
fn leaf_share(uv: vec2f) -> f32 {
    if !STAND_IN {
        return select(0.0, 1.0, FOLIAGE);
    }
    return textureSample(normal_texture, color_sampler, uv).a;
}

fn id_of(seen: Seen) -> u32 {
    if !CROWN || !GROWING || seen.slot == 0u {
        return 0u;
    }
    let slot = seen.slot + material.grows - 1u;
    return crown_id(slot, crowns[slot], seen.from_center, abs(dot(normalize(seen.normal), toward_eye(seen.world))));
}

// A fragment of a textured surface.
fn surface(seen: Seen, front: bool) -> Drawn {
    let color = material.factor * textureSample(color_texture, color_sampler, seen.uv);
    let n = mapped_normal(seen, front);
    let leaf = leaf_share(seen.uv);
    if !is_there(color.a, seen.share, seen.from_center, footprint(seen.from_center)) {
        discard;
    }
    return Drawn(shown(color.rgb, seen.world, n, seen.from_center, seen.tree, leaf), id_of(seen));
}
