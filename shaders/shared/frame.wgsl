// What every pass knows of the frame; mirrors gpu::layout::Frame.
struct Frame {
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    sun_clip_from_world: mat4x4f,
    eye: vec3f,
    time_s: f32,
    toward_sun: vec3f,
    shading: u32,
    sun_color: vec3f,
    shadow_texel_m: f32,
    sky_color: vec3f,
    ground_m: f32,
    ground_color: vec3f,
    background: u32,
    size_px: vec2f,
    px_per_m: vec2f,
    lean: vec2f,
    flutter_m: f32,
    sun_depth_m: f32,
    backward: vec3f,
    // Parallel projection: what is deeper by so much is another layer. In perspective 0.
    layer: f32,
    // What is d metres away is x + y · d, in metres as in the picture for which distances are told (repr::REFERENCE_FOCAL_PX).
    heights: vec2f,
    // x: metres over which the air takes two thirds of what it ever takes of what is behind it; y: the share that this is at most.
    haze: vec2f,
    // From where distances are told by which levels of detail are chosen.
    level_eye: vec3f,
    // The sun chooses levels as for trees so many metres away in that picture; 0: as the viewer does.
    sun_level_m: f32,
}

// Values of shading.
const LIT: u32 = {LIT};
const NORMALS: u32 = {NORMALS};
const LEVELS: u32 = {LEVELS};

// Storage, here and in every other shader, not uniform: where a branch asks for a uniform, Mesa's software driver (22.3) makes the shader
// anew in every frame, and keeps the old ones, a megabyte each.
@group(0) @binding(0) var<storage, read> frame: Frame;

// A point of the picture at a depth, in world space.
fn unproject(ndc: vec2f, depth: f32) -> vec3f {
    let p = frame.world_from_clip * vec4f(ndc, depth, 1.0);
    return p.xyz / p.w;
}

// From where a point is seen: the eye, in parallel projection its own place in the viewer's plane.
fn eye_of(world: vec3f) -> vec3f {
    return select(frame.eye, world + dot(frame.eye - world, frame.backward) * frame.backward, frame.layer > 0.0);
}

// Towards that, unit length.
fn toward_eye(world: vec3f) -> vec3f {
    let way = frame.eye - world;
    let far = length(way);
    return select(way / max(far, 1e-20), frame.backward, frame.layer > 0.0 || far == 0.0);
}
