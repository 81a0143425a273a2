// Surfaces of placed trees into the temporary colour, depth and id buffers (She §3.4, fig. 14).
#import shared/frame
#import shared/tree
#import shared/id
#import shared/light
#import shared/shadow
#import shared/sky

// gpu::layout::Frame::background where there is air to see through.
const SKY: u32 = {SKY};

// Crowns near enough to grow, by slot.
@group(0) @binding(8) var<storage, read> crowns: array<GrowingCrown>;

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    // From the crown's centre, object space.
    @location(3) from_center: vec3f,
    // Slot of its first crown; 0 when none grows.
    @location(4) @interpolate(flat) slot: u32,
}

@vertex
fn vs_main(corner: Corner) -> Seen {
    let world = placed(corner);
    var seen: Seen;
    seen.position = frame.clip_from_world * vec4f(world, 1.0);
    seen.world = world;
    seen.from_center = corner.position - material.crown_center;
    seen.normal = turned(normalize(corner.rotation), crown_normal(corner.normal, seen.from_center));
    seen.uv = corner.uv;
    seen.slot = corner.id.y;
    return seen;
}

// A crown is lit as the rounded whole that it is, its lobes as half of that: between the surface's normal and its ellipsoid's.
fn crown_normal(normal: vec3f, from_center: vec3f) -> vec3f {
    let reach = material.crown_reach.xyx;
    let round = from_center / (reach * reach);
    return select(normal, normal + normalize(round + vec3f(0.0, 1e-6, 0.0)), material.grows != 0u);
}

// How much of the sky and the ground a point sees past its own tree, 0..1: less inside the crown and on its underside.
fn openness(from_center: vec3f) -> f32 {
    if material.grows == 0u {
        return mix(0.55, 0.75, material.foliage);
    }
    let p = from_center / material.crown_reach.xyx;
    let outside = smoothstep(0.35, 1.0, length(p));
    return mix(0.35, 1.0, outside) * mix(0.55, 1.0, smoothstep(-0.9, 0.5, p.y));
}

fn lit(albedo: vec3f, seen: Seen, n: vec3f) -> vec3f {
    var sun = vec3f(0.0);
    if material.foliage > 0.0 {
        let reach = select(0.1 * material.tree_height_m, min(material.crown_reach.x, material.crown_reach.y), material.grows != 0u);
        sun = sun_on_foliage(n, toward_eye(seen.world)) * sun_through_leaves(seen.world, 0.3 * reach);
    } else {
        sun = sun_on_face(n) * sun_on_solid(seen.world + 2.0 * frame.shadow_texel_m * n, 0.0);
    }
    let color = albedo * (sun + ambient(n) * openness(seen.from_center));
    return held(select(color, through_air(color, eye_of(seen.world), seen.world), frame.background == SKY));
}

struct Drawn {
    @location(0) color: vec4f,
    @location(1) id: u32,
}

@fragment
fn fs_main(seen: Seen, @builtin(front_facing) front: bool) -> Drawn {
    let color = material.factor * textureSample(color_texture, color_sampler, seen.uv);
    if color.a < material.alpha_cutoff {
        discard;
    }
    var shown = color.rgb;
    let n = normalize(select(-seen.normal, seen.normal, front));
    if frame.shading == LIT {
        shown = lit(shown, seen, n);
    } else if frame.shading == NORMALS {
        shown = 0.5 + 0.5 * n;
    }
    return Drawn(vec4f(shown, 1.0), id_of(seen));
}

fn id_of(seen: Seen) -> u32 {
    if material.grows == 0u || seen.slot == 0u {
        return 0u;
    }
    let slot = seen.slot + material.grows - 1u;
    return crown_id(slot, crowns[slot], seen.from_center, abs(dot(normalize(seen.normal), toward_eye(seen.world))));
}
