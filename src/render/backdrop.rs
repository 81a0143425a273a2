//! What stands behind the trees: sky above level ground, or nothing.

use super::Background;
use super::screen::ScreenPipeline;
use super::targets::{COLOR, Targets, color_attachment, depth_attachment, nearer};
use crate::gpu::{Gpu, Shader};

/// Draws the backdrop and clears the frame.
#[derive(Debug)]
pub struct Backdrop {
    pipeline: wgpu::RenderPipeline,
}

impl Backdrop {
    /// Compiles its pipeline.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout, sun: &wgpu::BindGroupLayout) -> Self {
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("backdrop.layout"),
            bind_group_layouts: &[Some(frame), None, Some(sun)],
            immediate_size: 0,
        });
        let shader = Shader::load(gpu, "backdrop");
        let depth = wgpu::DepthStencilState { depth_compare: Some(wgpu::CompareFunction::GreaterEqual), ..nearer() };
        let targets = [Some(COLOR.into())];
        let pipeline = ScreenPipeline {
            layout: Some(&layout),
            depth: Some(depth),
            ..ScreenPipeline::new("backdrop.pipeline", &shader, &targets)
        };
        Self { pipeline: pipeline.compiled(gpu) }
    }

    /// Clears the frame and draws what stands behind, with the shadows of `sun`'s map on it.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        sun: &wgpu::BindGroup,
        targets: &Targets,
        background: Background,
    ) {
        let plain = match background {
            Background::White => wgpu::Color::WHITE,
            Background::Black | Background::Sky => wgpu::Color::BLACK,
            Background::Alpha => wgpu::Color::TRANSPARENT,
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("backdrop"),
            color_attachments: &[color_attachment(&targets.frame_color, Some(plain))],
            depth_stencil_attachment: Some(depth_attachment(&targets.frame_depth, true)),
            ..Default::default()
        });
        if background == Background::Sky {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, frame, &[]);
            pass.set_bind_group(2, sun, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
