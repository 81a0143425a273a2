// Octahedral impostors into the temporary colour, depth and id buffers.
#import shared/octahedral
#import shared/shade

@vertex
fn vs_main(corner: Corner) -> Looked {
    var seen = look(corner, false);
    seen.position = frame.clip_from_world * vec4f(seen.world, 1.0);
    return seen;
}

struct Impostor {
    @location(0) color: vec4f,
    @location(1) id: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_main(seen: Looked) -> Impostor {
    let it = found(seen);
    if !is_found(it, seen) {
        discard;
    }
    let clip = frame.clip_from_world * vec4f(it.world, 1.0);
    let n = turned(seen.rotation, it.normal);
    // What would come to lie before the near plane is left on it.
    let depth = select(1.0, clamp(clip.z / clip.w, 0.0, 1.0), clip.w > 0.0);
    return Impostor(shown(it.color.rgb, it.world, n, it.at, seen.tree, it.leaf), 0u, depth);
}
