// Where a picture for a stand-in is taken from.
// Mirrors gpu::layout::CaptureView.
struct CaptureView {
    clip_from_object: mat4x4f,
    // Metres of depth 0, and from there to depth 1, along the line of sight from the middle of the view.
    far_m: f32,
    deep_m: f32,
    pad: vec2f,
}

@group(0) @binding(0) var<storage, read> view: CaptureView;
