// Octahedral impostors into the sun's map.
#import shared/octahedral

@vertex
fn vs_main(corner: Corner) -> Looked {
    var seen = look(corner, true);
    seen.position = frame.sun_clip_from_world * vec4f(seen.world, 1.0);
    return seen;
}

@fragment
fn fs_main(seen: Looked) -> @builtin(frag_depth) f32 {
    let it = found(seen);
    if !is_found(it, seen) {
        discard;
    }
    return clamp((frame.sun_clip_from_world * vec4f(it.world, 1.0)).z, 0.0, 1.0);
}
