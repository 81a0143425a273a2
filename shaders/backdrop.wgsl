// What stands behind the trees: a plain colour, or sky above level ground.
#import shared/frame
#import shared/screen

const SKY: u32 = 0u;

@vertex
fn vs_main(@builtin(vertex_index) vertex: u32) -> Screen {
    return screen(vertex);
}

struct Drawn {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(seen: Screen) -> Drawn {
    let near = unproject(seen.ndc, 1.0);
    let ray = normalize(unproject(seen.ndc, 1e-4) - near);
    let drop = near.y - frame.ground_m;
    if ray.y < -1e-5 && drop > 0.0 {
        let hit = near - ray * (drop / ray.y);
        let clip = frame.clip_from_world * vec4f(hit, 1.0);
        let haze = 1.0 - exp(-distance(hit, near) / 400.0);
        let grass = vec3f(0.105, 0.135, 0.045) * mix(vec3f(1.0), frame.sun_color * max(frame.toward_sun.y, 0.0) + frame.sky_color, frame.lit);
        return Drawn(vec4f(mix(grass, vec3f(0.55, 0.66, 0.75), haze), 1.0), clip.z / clip.w);
    }
    let sky = mix(vec3f(0.60, 0.71, 0.82), vec3f(0.16, 0.33, 0.62), clamp(ray.y, 0.0, 1.0));
    return Drawn(vec4f(sky, 1.0), 0.0);
}
