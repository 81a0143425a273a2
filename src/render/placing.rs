//! How the shaders of drawers learn where a tree stands: from an [`Instance`](layout::Instance) of its own, or from its number among the
//! many of a [`Crowd`](super::Crowd).

use crate::gpu::{Gpu, layout};

/// Where the trees that are drawn stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placing {
    /// Each has an instance, the second vertex buffer.
    Each,
    /// They are a crowd's: the second vertex buffer has their numbers, group 3 their places.
    Many,
    /// The same, with a number for each vertex.
    Batched,
}

impl Placing {
    /// The vertex buffers.
    pub fn buffers(self) -> &'static [Option<wgpu::VertexBufferLayout<'static>>] {
        const EACH: &[Option<wgpu::VertexBufferLayout<'static>>] = &[Some(layout::Vertex::LAYOUT), Some(layout::Instance::LAYOUT)];
        const MANY: &[Option<wgpu::VertexBufferLayout<'static>>] = &[Some(layout::Vertex::LAYOUT), Some(layout::Placed::LIST)];
        const BATCHED: &[Option<wgpu::VertexBufferLayout<'static>>] = &[
            Some(layout::Vertex::LAYOUT),
            Some(wgpu::VertexBufferLayout { step_mode: wgpu::VertexStepMode::Vertex, ..layout::Placed::LIST }),
        ];
        match self {
            Self::Each => EACH,
            Self::Many => MANY,
            Self::Batched => BATCHED,
        }
    }
}

/// Layouts of the groups that drawers of parts bind.
#[derive(Debug)]
pub struct Groups {
    /// Group 0: the frame.
    pub frame: wgpu::BindGroupLayout,
    /// Group 1: the part.
    pub part: wgpu::BindGroupLayout,
    /// Group 2, where it is lit: the sun's map.
    pub sun: wgpu::BindGroupLayout,
    /// Group 3: the trees of a crowd.
    pub crowd: wgpu::BindGroupLayout,
}

impl Groups {
    /// The layout of a pipeline that draws parts; `own` is its drawer's own group 3.
    pub fn layout(&self, gpu: &Gpu, label: &'static str, lit: bool, own: Option<&wgpu::BindGroupLayout>) -> wgpu::PipelineLayout {
        let groups = [Some(&self.frame), Some(&self.part), lit.then_some(&self.sun), own];
        let last = groups.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let descriptor =
            wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: &groups[..last], immediate_size: 0 };
        gpu.device.create_pipeline_layout(&descriptor)
    }
}
