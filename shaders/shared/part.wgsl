// What a part of a tree is made of, and when it is seen: bound by every drawer of parts, whatever places its vertices.
#import shared/frame
#import shared/seen

// Mirrors gpu::layout::Material.
struct Material {
    factor: vec4f,
    crown_center: vec3f,
    alpha_cutoff: f32,
    // Number of the crown within its tree, from 1.
    grows: u32,
    pad: u32,
    crown_reach: vec2f,
    tree_height_m: f32,
    tree_foot_m: f32,
    pad2: vec2f,
    // Box of the tree.
    tree_center: vec3f,
    pad3: f32,
    tree_half: vec3f,
    pad4: f32,
}

// Values of PART_FADE: always seen in full; thinned out by a hash of the place; by its alpha.
const FADE_NEVER: u32 = {FADE_NEVER};
const FADE_ALPHA: u32 = {FADE_ALPHA};
// Values of PART_TURNED: what else stands still.
const TURNED_UPRIGHT: u32 = {TURNED_UPRIGHT};
const TURNED_WHOLLY: u32 = {TURNED_WHOLLY};

// What is known of the part when its pipeline is made (render::pipelines): how it fades, from which sides it is seen, how it turns; whether
// it is leaves, a sphere-board crown, has normal_texture, is a picture for foliage elsewhere; whether its outline may grow.
const PART_FADE: u32 = {PART_FADE};
const PART_FACING: u32 = {PART_FACING};
const PART_TURNED: u32 = {PART_TURNED};
const FOLIAGE: bool = {FOLIAGE} != 0u;
const CROWN: bool = {CROWN} != 0u;
const NORMAL_MAPPED: bool = {NORMAL_MAPPED} != 0u;
const STAND_IN: bool = {STAND_IN} != 0u;
const GROWING: bool = {GROWING} != 0u;

@group(1) @binding(0) var<storage, read> material: Material;
@group(1) @binding(1) var color_texture: texture_2d<f32>;
@group(1) @binding(2) var color_sampler: sampler;
@group(1) @binding(3) var normal_texture: texture_2d<f32>;
@group(1) @binding(4) var<storage, read> presence: Presence;
