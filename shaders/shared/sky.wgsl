// The sky, and the air between: analytic, ours, after what a clear day's photographs show.
#import shared/frame

// How low the sun stands, 0..1: its light has lost its blue then, most near the sun.
fn low_sun() -> f32 {
    return exp(-7.0 * max(frame.toward_sun.y, 0.0));
}

fn daylight() -> f32 {
    return 0.02 + 0.98 * smoothstep(-0.18, 0.1, frame.toward_sun.y);
}

// The colour of the horizon towards which `facing` is the cosine of the angle from the sun.
fn horizon_color(facing: f32, low: f32) -> vec3f {
    let half_facing = 0.5 + 0.5 * facing;
    let lit = mix(vec3f(0.42, 0.44, 0.52), vec3f(0.95, 0.58, 0.30), half_facing * half_facing);
    return mix(vec3f(0.56, 0.69, 0.81), lit, low);
}

// The wide glow round the sun: cosines to the power of 6 and 48.
fn glow(near: f32) -> vec2f {
    let n2 = near * near;
    let n6 = n2 * n2 * n2;
    let n12 = n6 * n6;
    let n24 = n12 * n12;
    return vec2f(n6, n24 * n24);
}

fn glow_color(low: f32) -> vec3f {
    return mix(vec3f(1.0, 0.93, 0.80), vec3f(1.0, 0.62, 0.30), low);
}

// The sky's colour along a unit ray; below the horizon the horizon's.
fn sky(ray: vec3f) -> vec3f {
    let low = low_sun();
    let up = max(ray.y, 0.0);
    let facing = dot(ray, frame.toward_sun);
    let zenith = mix(vec3f(0.085, 0.225, 0.52), vec3f(0.06, 0.12, 0.30), low);
    let color = mix(zenith, horizon_color(facing, low), exp(-3.6 * up) * (1.0 - 0.25 * up));
    let near = max(facing, 0.0);
    let wide = glow(near);
    // And close to it, to the power of 912.
    let n96 = wide.y * wide.y;
    let n192 = n96 * n96;
    let n384 = n192 * n192;
    let close = n384 * n384 * n96 * wide.y;
    let light = 0.10 * wide.x + 0.22 * wide.y + 0.5 * close + 4.0 * smoothstep(0.99990, 0.99998, near);
    return (color + glow_color(low) * light) * daylight();
}

// What the air far off has: the horizon's colour in the direction of a ray, without the sun itself.
fn haze_color(ray: vec3f) -> vec3f {
    let low = low_sun();
    let facing = dot(ray.xz, frame.toward_sun.xz) * inverseSqrt(max(dot(ray.xz, ray.xz), 1e-12));
    let wide = glow(max(facing, 0.0));
    return (horizon_color(facing, low) + glow_color(low) * (0.10 * wide.x + 0.22 * wide.y)) * daylight();
}

// A colour seen through the air between.
fn through_air(color: vec3f, from_m: vec3f, to_m: vec3f) -> vec3f {
    let way = to_m - from_m;
    let far = length(way) / frame.haze.x;
    return mix(color, haze_color(way), frame.haze.y * (1.0 - exp(-far * sqrt(far))));
}
