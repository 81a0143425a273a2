//! The trees' temporary picture goes into the frame where it is nearer (She §3.4, fig. 14), pixel by pixel or with smooth outlines
//! (fig. 15 d). Only the tiles that trees touch are drawn.

use super::screen::ScreenPipeline;
use super::targets::{COLOR, Targets, color_attachment, depth_attachment, nearer};
use crate::Result;
use crate::gpu::{Gpu, KeptBuffer, Shader};
use crate::raster::{to_linear, to_srgb};

/// Composites by depth.
#[derive(Debug)]
pub struct Composite {
    layout: wgpu::BindGroupLayout,
    hard: wgpu::RenderPipeline,
    smooth: wgpu::RenderPipeline,
    fringe: wgpu::RenderPipeline,
    tiles: KeptBuffer,
    /// Of the tiles and targets as they are.
    group: Option<wgpu::BindGroup>,
}

impl Composite {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout) -> Self {
        let layout = layout(gpu);
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("composite.layout"),
            bind_group_layouts: &[Some(frame), Some(&layout)],
            immediate_size: 0,
        });
        let shader = Shader::load(gpu, "composite");
        let pipeline = |label, fragment, blend, writes_depth| {
            let targets = [Some(wgpu::ColorTargetState { format: COLOR, blend, write_mask: wgpu::ColorWrites::ALL })];
            let pipeline = ScreenPipeline {
                layout: Some(&pipeline_layout),
                fragment,
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                depth: Some(wgpu::DepthStencilState { depth_write_enabled: Some(writes_depth), ..nearer() }),
                ..ScreenPipeline::new(label, &shader, &targets)
            };
            pipeline.compiled(gpu)
        };
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        Self {
            hard: pipeline("composite.hard", "fs_main", None, true),
            smooth: pipeline("composite.smooth", "fs_main_smooth", over, true),
            fringe: pipeline("composite.fringe", "fs_main_fringe", over, false),
            tiles: KeptBuffer::new(gpu, "composite.tiles", wgpu::BufferUsages::STORAGE),
            group: None,
            layout,
        }
    }

    /// Drops what belongs to targets that there will be no more.
    pub fn forget_targets(&mut self) {
        self.group = None;
    }

    /// Draws the trees over the frame in the given tiles, with smooth outlines or whole pixels. Where nothing stood behind, the frame's
    /// colour is premultiplied afterwards.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        targets: &Targets,
        tiles: &[u32],
        smooth: bool,
    ) -> Result<()> {
        if tiles.is_empty() {
            return Ok(());
        }
        if self.tiles.fill(gpu, bytemuck::cast_slice(tiles))? {
            self.group = None;
        }
        let group = match self.group.take() {
            Some(group) => group,
            None => gpu.guarded(|| bound(gpu, &self.layout, targets, self.tiles.get()))?,
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composite"),
            color_attachments: &[color_attachment(&targets.frame_color, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.frame_depth, false)),
            ..Default::default()
        });
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &group, &[]);
        let pipelines: &[_] = if smooth { &[&self.smooth, &self.fringe] } else { &[&self.hard] };
        for pipeline in pipelines {
            pass.set_pipeline(pipeline);
            pass.draw(0..4, 0..tiles.len() as u32);
        }
        self.group = Some(group);
        Ok(())
    }
}

fn bound(gpu: &Gpu, layout: &wgpu::BindGroupLayout, targets: &Targets, tiles: &wgpu::Buffer) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("composite.group"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&targets.tree_depth.view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&targets.tree_color.view) },
            wgpu::BindGroupEntry { binding: 2, resource: tiles.as_entire_binding() },
        ],
    })
}

/// From premultiplied to straight alpha, sRGB bytes: light is divided, not bytes, so that outlines get no dark fringe.
pub fn make_straight(rgba: &mut [u8]) {
    for pixel in rgba.chunks_exact_mut(4) {
        let alpha = f32::from(pixel[3]) / 255.0;
        if 0.0 < alpha && alpha < 1.0 {
            for channel in &mut pixel[..3] {
                *channel = to_srgb((to_linear(*channel) / alpha).min(1.0));
            }
        }
    }
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let tiles = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("composite.layout"),
        entries: &[
            entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, texture(wgpu::TextureSampleType::Depth)),
            entry(1, wgpu::ShaderStages::FRAGMENT, texture(wgpu::TextureSampleType::Float { filterable: false })),
            entry(2, wgpu::ShaderStages::VERTEX, tiles),
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_covered_pixel_keeps_its_colour() {
        let color = [200u8, 120, 40];
        let mut pixel = color.map(|c| to_srgb(0.5 * to_linear(c))).to_vec();
        pixel.push(128);
        make_straight(&mut pixel);
        assert!(pixel.iter().zip(color).all(|(a, b)| a.abs_diff(b) <= 2), "{pixel:?}");
        let mut others = [10, 20, 30, 255, 0, 0, 0, 0];
        make_straight(&mut others);
        assert_eq!(others, [10, 20, 30, 255, 0, 0, 0, 0]);
    }
}
