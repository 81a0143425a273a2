// Surfaces of placed trees into the temporary colour, depth and id buffers (She §3.4, fig. 14).
#import shared/frame
#import shared/id

// Mirrors gpu::layout::Material.
struct Material {
    factor: vec4f,
    crown_center: vec3f,
    alpha_cutoff: f32,
    grows: u32,
    two_sided: u32,
    pad: vec2u,
}

// Crowns near enough to grow, by slot.
@group(0) @binding(8) var<storage, read> crowns: array<GrowingCrown>;
@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var color_texture: texture_2d<f32>;
@group(1) @binding(2) var color_sampler: sampler;

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) place: vec4f,
    @location(4) rotation: vec4f,
    @location(5) id: vec2u,
}

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

fn turned(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

@vertex
fn vs_main(corner: Corner) -> Seen {
    let q = normalize(corner.rotation);
    let world = corner.place.xyz + corner.place.w * turned(q, corner.position);
    var seen: Seen;
    seen.position = frame.clip_from_world * vec4f(world, 1.0);
    seen.world = world;
    seen.normal = turned(q, corner.normal);
    seen.uv = corner.uv;
    seen.from_center = corner.position - material.crown_center;
    seen.slot = corner.id.y;
    return seen;
}

struct Drawn {
    @location(0) color: vec4f,
    @location(1) id: u32,
}

@fragment
fn fs_main(seen: Seen, @builtin(front_facing) front: bool) -> Drawn {
    let color = material.factor * textureSample(color_texture, color_sampler, seen.uv);
    if color.a < material.alpha_cutoff || (!front && material.two_sided == 0u) {
        discard;
    }
    var n = normalize(seen.normal);
    if !front {
        n = -n;
    }
    let sun = max(dot(n, frame.toward_sun), 0.0) * frame.sun_color;
    let light = mix(vec3f(1.0), sun + mix(frame.ground_color, frame.sky_color, 0.5 + 0.5 * n.y), frame.lit);
    return Drawn(vec4f(color.rgb * light, 1.0), id_of(seen, n));
}

fn id_of(seen: Seen, n: vec3f) -> u32 {
    if material.grows == 0u || seen.slot == 0u {
        return 0u;
    }
    let slot = seen.slot + material.grows - 1u;
    return crown_id(slot, crowns[slot], seen.from_center, abs(dot(n, normalize(frame.eye - seen.world))));
}
