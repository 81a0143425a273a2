//! How the shaders of drawers learn where a tree stands: from an [`Instance`](layout::Instance) of its own, or from its number among the
//! many of a [`Crowd`](super::Crowd).

use crate::gpu::{Gpu, Shader, layout};

/// Where the trees that are drawn stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placing {
    /// Each has an instance, the second vertex buffer.
    Each,
    /// They are a crowd's: the second vertex buffer has their numbers, group 3 their places.
    Many,
}

impl Placing {
    /// Of two shaders' names, each for this placing and the other, those for this.
    pub fn shaders<const N: usize>(self, gpu: &Gpu, names: [[&'static str; 2]; N]) -> [Shader; N] {
        names.map(|pair| Shader::load(gpu, pair[usize::from(self == Self::Many)]))
    }

    /// The vertex buffers.
    pub fn buffers(self) -> [Option<wgpu::VertexBufferLayout<'static>>; 2] {
        let places = if self == Self::Each { layout::Instance::LAYOUT } else { layout::Placed::LIST };
        [Some(layout::Vertex::LAYOUT), Some(places)]
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
    /// The layout of a pipeline that draws parts.
    pub fn layout(&self, gpu: &Gpu, label: &'static str, placing: Placing, lit: bool) -> wgpu::PipelineLayout {
        let groups =
            [Some(&self.frame), Some(&self.part), lit.then_some(&self.sun), (placing == Placing::Many).then_some(&self.crowd)];
        let last = groups.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let descriptor =
            wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: &groups[..last], immediate_size: 0 };
        gpu.device.create_pipeline_layout(&descriptor)
    }
}
