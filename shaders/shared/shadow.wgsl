// How much sunlight arrives: the sun's depth map, in which nearer to the sun is more, as in every depth buffer here.
#import shared/frame

@group(2) @binding(0) var sun_map: texture_depth_2d;
@group(2) @binding(1) var sun_sampler: sampler_comparison;

// Texture coordinates and depth in the map. What lies behind the last caster keeps its shadow.
fn sun_place(world: vec3f) -> vec3f {
    let p = frame.sun_clip_from_world * vec4f(world, 1.0);
    return vec3f(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y, clamp(p.z, 0.0, 1.0));
}

// The share of the sun seen from a point of something solid: 0 in full shadow, edges soft over `soft_m` metres or a texel and a half.
fn sun_on_solid(world: vec3f, soft_m: f32) -> f32 {
    let place = sun_place(world);
    let texel = 1.0 / vec2f(textureDimensions(sun_map));
    let reach = clamp(0.5 * soft_m / max(frame.shadow_texel_m, 1e-6), 1.0, 3.0) * texel;
    if frame.shadow_texel_m == 0.0 || any(abs(place.xy - 0.5) > 0.5 + reach) {
        return 1.0;
    }
    // Four bilinear taps spread as wide as nine with a step of `reach` between them.
    let tap = 0.8165 * reach;
    let seen = vec4f(
        textureSampleCompareLevel(sun_map, sun_sampler, place.xy - tap, place.z),
        textureSampleCompareLevel(sun_map, sun_sampler, place.xy + vec2f(tap.x, -tap.y), place.z),
        textureSampleCompareLevel(sun_map, sun_sampler, place.xy + vec2f(-tap.x, tap.y), place.z),
        textureSampleCompareLevel(sun_map, sun_sampler, place.xy + tap, place.z),
    );
    return dot(seen, vec4f(0.25));
}

// The share of sunlight that reaches a point among leaves through what lies between it and the sun: thin foliage lets light through, by a
// factor of e for each `depth_m` metres (Beer's law). A surface never shadows itself: nothing lies between.
fn sun_through_leaves(world: vec3f, depth_m: f32) -> f32 {
    let place = sun_place(world);
    if frame.shadow_texel_m == 0.0 || any(abs(place.xy - 0.5) > vec2f(0.5)) {
        return 1.0;
    }
    let last = vec2i(textureDimensions(sun_map)) - 1;
    let at = place.xy * vec2f(textureDimensions(sun_map)) - 0.5;
    let corner = vec2i(floor(at));
    let t = at - floor(at);
    let fade = frame.sun_depth_m / depth_m;
    var light = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let texel = clamp(corner + vec2i(i & 1, i >> 1u), vec2i(0), last);
        light[i] = exp(-fade * max(textureLoad(sun_map, texel, 0) - place.z, 0.0));
    }
    return mix(mix(light.x, light.y, t.x), mix(light.z, light.w, t.x), t.y);
}
