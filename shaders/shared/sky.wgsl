// The sky, and the air between: analytic, ours, after what a clear day's photographs show.
#import shared/frame

// The sky's colour along a unit ray; below the horizon the horizon's.
fn sky(ray: vec3f) -> vec3f {
    let sun = frame.toward_sun;
    let up = max(ray.y, 0.0);
    let day = smoothstep(-0.18, 0.1, sun.y);
    // Low sun: the light has lost its blue, most near the sun.
    let low = exp(-7.0 * max(sun.y, 0.0));
    let facing = 0.5 + 0.5 * dot(ray, sun);
    let zenith = mix(vec3f(0.085, 0.225, 0.52), vec3f(0.06, 0.12, 0.30), low);
    let horizon = mix(vec3f(0.56, 0.69, 0.81), mix(vec3f(0.42, 0.44, 0.52), vec3f(0.95, 0.58, 0.30), facing * facing), low);
    var color = mix(zenith, horizon, exp(-3.6 * up) * (1.0 - 0.25 * up));
    let glow = mix(vec3f(1.0, 0.93, 0.80), vec3f(1.0, 0.62, 0.30), low);
    let near = max(dot(ray, sun), 0.0);
    color += glow * (0.10 * pow(near, 6.0) + 0.22 * pow(near, 48.0) + 0.5 * pow(near, 900.0) + 4.0 * smoothstep(0.99990, 0.99998, near));
    return color * (0.02 + 0.98 * day);
}

// A colour seen through the air between.
fn through_air(color: vec3f, from_m: vec3f, to_m: vec3f) -> vec3f {
    let way = to_m - from_m;
    let far_m = length(way);
    let ray = way / max(far_m, 1e-6);
    let taken = frame.haze.y * (1.0 - exp(-pow(far_m / frame.haze.x, 1.5)));
    return mix(color, sky(normalize(vec3f(ray.x, 1e-4, ray.z))), taken);
}
