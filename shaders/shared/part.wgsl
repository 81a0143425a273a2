// What a part of a tree is made of, and when it is seen: bound by every drawer of parts, whatever places its vertices.
#import shared/frame

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
    // 1 where normal_texture holds something.
    normal_mapped: u32,
    // 1 for a picture that stands for foliage elsewhere.
    stand_in: u32,
    // Box of the tree.
    tree_center: vec3f,
    tree_foot_m: f32,
    tree_half: vec3f,
    pad2: f32,
}

// Mirrors gpu::layout::Presence.
struct Presence {
    anchor: vec3f,
    fade: u32,
    appears: vec2f,
    vanishes: vec2f,
    axis: vec3f,
    facing: u32,
    cosines: vec2f,
    drawn: u32,
    grid: u32,
    pivot: vec3f,
    radius_m: f32,
    vanish_anchor: vec3f,
    pad: f32,
    rises: vec2f,
    sinks: vec2f,
}

// Bits of Presence.facing.
const FACING: u32 = {FACING};
const FACING_LEVEL: u32 = {FACING_LEVEL};
const FACING_BOTH: u32 = {FACING_BOTH};
const FACING_OWN: u32 = {FACING_OWN};
const FACING_SECTOR: u32 = {FACING_SECTOR};
// Values of Presence.fade: always seen in full; thinned out by a hash of the place; by its alpha.
const FADE_NEVER: u32 = {FADE_NEVER};
const FADE_ALPHA: u32 = {FADE_ALPHA};
// Values of Presence.drawn: what else stands still.
const TURNED_UPRIGHT: u32 = {TURNED_UPRIGHT};
const TURNED_WHOLLY: u32 = {TURNED_WHOLLY};

@group(1) @binding(0) var<storage, read> material: Material;
@group(1) @binding(1) var color_texture: texture_2d<f32>;
@group(1) @binding(2) var color_sampler: sampler;
@group(1) @binding(3) var normal_texture: texture_2d<f32>;
@group(1) @binding(4) var<storage, read> presence: Presence;
