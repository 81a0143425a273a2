// Parts of placed trees as every pass sees them: the corners that come in, what they are made of, and where the wind has put them.
#import shared/frame
#import shared/sway

// Mirrors gpu::layout::Material.
struct Material {
    factor: vec4f,
    crown_center: vec3f,
    alpha_cutoff: f32,
    grows: u32,
    two_sided: u32,
    crown_reach: vec2f,
    tree_height_m: f32,
    foliage: f32,
    pad: vec2f,
}

@group(1) @binding(0) var<storage, read> material: Material;
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

fn turned(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

// Where a corner stands, world space, metres.
fn placed(corner: Corner) -> vec3f {
    let upright = turned(normalize(corner.rotation), corner.position);
    return corner.place.xyz + corner.place.w * (upright + sway(corner.position, material.tree_height_m, corner.place.xyz));
}
