//! The trees' temporary picture goes into the frame where it is nearer (She §3.4, fig. 14).

use super::targets::{COLOR, Targets, color_attachment, depth_attachment, nearer};
use crate::gpu::{Gpu, Shader};

/// Composites by depth.
#[derive(Debug)]
pub struct Composite {
    pipeline: wgpu::RenderPipeline,
}

impl Composite {
    /// Compiles its pipeline.
    pub fn new(gpu: &Gpu) -> Self {
        let shader = Shader::load(gpu, "composite");
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("composite.pipeline"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &shader.0,
                entry_point: Some("vs_main"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(nearer()),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader.0,
                entry_point: Some("fs_main"),
                compilation_options: Default::default(),
                targets: &[Some(COLOR.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline }
    }

    /// Draws the trees over the frame.
    pub fn draw(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("composite.group"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&targets.tree_color.view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&targets.tree_depth.view) },
            ],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composite"),
            color_attachments: &[color_attachment(&targets.frame_color, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.frame_depth, false)),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
