//! The trees' temporary picture goes into the frame where it is nearer (She §3.4, fig. 14), whole pixels or with smooth outlines
//! (fig. 15 d). Only the tiles that trees touch are drawn.

use super::bound::{PLAIN_COLOR, bind, group_layout, storage, texture, view};
use super::screen::ScreenPipeline;
use super::smoothing::Smoothing;
use super::targets::{COLOR, Targets, color_attachment, depth_attachment, nearer};
use crate::Result;
use crate::gpu::{Gpu, KeptBuffer, Shader};
use crate::raster::{to_linear, to_srgb};

/// Composites by depth.
#[derive(Debug)]
pub struct Composite {
    /// With what is covered in part over the frame, or as it is.
    over: wgpu::RenderPipeline,
    whole: wgpu::RenderPipeline,
    smoothing: Smoothing,
    tiles: KeptBuffer,
    layout: wgpu::BindGroupLayout,
    /// Of the tiles and targets as they are.
    group: Option<wgpu::BindGroup>,
}

impl Composite {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout) -> Self {
        let (color, depth) = (texture(PLAIN_COLOR), texture(wgpu::TextureSampleType::Depth));
        let layout = group_layout(gpu, "composite.layout", wgpu::ShaderStages::VERTEX_FRAGMENT, &[depth, color, storage(true)]);
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("composite.layout"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let shader = Shader::load(gpu, "composite");
        let pipeline = |label, blend| {
            let targets = [Some(wgpu::ColorTargetState { format: COLOR, blend, write_mask: wgpu::ColorWrites::ALL })];
            let pipeline = ScreenPipeline {
                layout: Some(&pipeline_layout),
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                depth: Some(nearer()),
                ..ScreenPipeline::new(label, &shader, &targets)
            };
            pipeline.compiled(gpu)
        };
        Self {
            over: pipeline("composite.over", Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING)),
            whole: pipeline("composite.whole", None),
            smoothing: Smoothing::new(gpu, frame),
            tiles: KeptBuffer::new(gpu, "composite.tiles", wgpu::BufferUsages::STORAGE),
            layout,
            group: None,
        }
    }

    /// Drops what belongs to targets that there will be no more.
    pub fn forget_targets(&mut self) {
        self.group = None;
        self.smoothing.forget_targets();
    }

    /// Draws the trees over the frame in the given tiles, with smooth outlines or whole pixels. Where nothing stood behind, the frame's
    /// colour is premultiplied afterwards.
    ///
    /// # Errors
    /// [`Error::OutlineSize`](crate::Error::OutlineSize) for a picture that is too large to smooth outlines in,
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
            self.smoothing.forget_tiles();
        }
        let count = tiles.len() as u32;
        if smooth {
            self.smoothing.mix(gpu, encoder, frame, targets, &self.tiles, count)?;
        }
        let resources = || [view(&targets.tree_depth), view(&targets.tree_color), self.tiles.get().as_entire_binding()];
        let group = match self.group.take() {
            Some(group) => group,
            None => gpu.guarded(|| bind(gpu, "composite.group", &self.layout, &resources()))?,
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composite"),
            color_attachments: &[color_attachment(&targets.frame_color, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.frame_depth, false)),
            ..Default::default()
        });
        pass.set_pipeline(if smooth { &self.over } else { &self.whole });
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..4, 0..count);
        if smooth {
            self.smoothing.draw(&mut pass);
        }
        self.group = Some(group);
        Ok(())
    }
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
