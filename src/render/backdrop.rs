//! What stands behind the trees: ground under the sky, or nothing.

use super::Background;
use super::placing::Groups;
use super::screen::ScreenPipeline;
use super::targets::{COLOR, Targets, color_attachment, depth_attachment, nearer};
use super::terrain::{Terrain, TerrainDrawer};
use crate::gpu::{Gpu, Shader, layout};

/// Draws the backdrop and clears the frame.
#[derive(Debug)]
pub struct Backdrop {
    /// Level ground to the horizon and all above.
    level: wgpu::RenderPipeline,
    /// What is at infinity, where no ground has been drawn: the sky, then the ridges on the horizon.
    sky: wgpu::RenderPipeline,
    ridges: wgpu::RenderPipeline,
    grounds: TerrainDrawer,
}

impl Backdrop {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("backdrop.layout"),
            bind_group_layouts: &[Some(&groups.frame), None, Some(&groups.sun)],
            immediate_size: 0,
        });
        let shader = Shader::load(gpu, "backdrop");
        let targets = [Some(COLOR.into())];
        let depth = |writes| wgpu::DepthStencilState {
            depth_write_enabled: Some(writes),
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            ..nearer()
        };
        let whole = |label, fragment, writes_depth| ScreenPipeline {
            layout: Some(&layout),
            fragment,
            depth: Some(depth(writes_depth)),
            ..ScreenPipeline::new(label, &shader, &targets)
        };
        let ring = ScreenPipeline {
            vertex: "vs_main_ridges",
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..whole("backdrop.ridges", "fs_main_ridges", false)
        };
        Self {
            level: whole("backdrop.level", "fs_main", true).compiled(gpu),
            sky: whole("backdrop.sky", "fs_main_sky", false).compiled(gpu),
            ridges: ring.compiled(gpu),
            grounds: TerrainDrawer::new(gpu, groups),
        }
    }

    /// Clears the frame and draws ground and what stands behind, with the shadows of `sun`'s map on it.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        sun: &wgpu::BindGroup,
        targets: &Targets,
        background: Background,
        ground: Option<&Terrain>,
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
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(2, sun, &[]);
        if let Some(ground) = ground {
            self.grounds.draw(&mut pass, ground);
        }
        match (background, ground) {
            (Background::Sky, None) => {
                pass.set_pipeline(&self.level);
                pass.draw(0..3, 0..1);
            }
            (Background::Sky, Some(_)) => {
                pass.set_pipeline(&self.sky);
                pass.draw(0..3, 0..1);
                pass.set_pipeline(&self.ridges);
                pass.draw(0..2 * (layout::BEARINGS + 1), 0..1);
            }
            _ => {}
        }
    }
}
