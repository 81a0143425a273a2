// A vertex of a mesh and the tree that it belongs to: gpu::layout::Vertex and Instance.
struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) place: vec4f,
    @location(4) rotation: vec4f,
    @location(5) id: vec2u,
}
