//! Pipelines over the screen: their vertices come of their numbers alone, from no buffer.

use crate::gpu::{Gpu, Shader};

/// Such a pipeline. [`ScreenPipeline::new`] has it draw one triangle over all of the picture, whatever was there before.
pub struct ScreenPipeline<'a> {
    /// Its name, for messages of the driver.
    pub label: &'a str,
    /// `None` for that which the shader implies.
    pub layout: Option<&'a wgpu::PipelineLayout>,
    /// The shader.
    pub shader: &'a Shader,
    /// Where its vertex stage starts.
    pub vertex: &'a str,
    /// Where its fragment stage starts.
    pub fragment: &'a str,
    /// Numbers of the fragment stage by name.
    pub constants: &'a [(&'a str, f64)],
    /// What its vertices make.
    pub topology: wgpu::PrimitiveTopology,
    /// How depth counts; `None` for not at all.
    pub depth: Option<wgpu::DepthStencilState>,
    /// What it draws into.
    pub targets: &'a [Option<wgpu::ColorTargetState>],
}

impl<'a> ScreenPipeline<'a> {
    /// One triangle without depth.
    pub fn new(label: &'a str, shader: &'a Shader, targets: &'a [Option<wgpu::ColorTargetState>]) -> Self {
        let (layout, depth, topology) = (None, None, wgpu::PrimitiveTopology::TriangleList);
        Self { label, layout, shader, vertex: "vs_main", fragment: "fs_main", constants: &[], topology, depth, targets }
    }

    /// Compiles it.
    pub fn compiled(self, gpu: &Gpu) -> wgpu::RenderPipeline {
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: self.layout,
            vertex: wgpu::VertexState {
                module: &self.shader.0,
                entry_point: Some(self.vertex),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: self.topology, ..Default::default() },
            depth_stencil: self.depth,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.shader.0,
                entry_point: Some(self.fragment),
                compilation_options: wgpu::PipelineCompilationOptions { constants: self.constants, ..Default::default() },
                targets: self.targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
