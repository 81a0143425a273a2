//! Frames onto a window's surface, with a panel of text over them.

use image::{Rgba, RgbaImage};

use super::screen::ScreenPipeline;
use super::{Renderer, Shot, World};
use crate::gpu::{Gpu, Shader, upload_mips};
use crate::{Error, Result};

/// The part of a window that frames are shown in.
#[derive(Debug)]
pub struct Window {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    pipeline: wgpu::RenderPipeline,
}

impl Window {
    /// Readies a window for `renderer`'s frames.
    ///
    /// # Errors
    /// [`Error::NoWindow`] when the adapter cannot draw into it.
    pub fn new(renderer: &Renderer, window: impl Into<wgpu::SurfaceTarget<'static>>, size_px: [u32; 2]) -> Result<Self> {
        let gpu = &renderer.gpu;
        let refused = |what: String| Error::NoWindow { what };
        let surface = gpu.instance.create_surface(window).map_err(|e| refused(e.to_string()))?;
        let [width, height] = size_px.map(|side| side.max(1));
        let mut config = surface
            .get_default_config(&gpu.adapter, width, height)
            .ok_or_else(|| refused(format!("{} cannot draw into windows; try another --adapter", gpu.info.name)))?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        config.format = formats.iter().copied().find(wgpu::TextureFormat::is_srgb).unwrap_or(config.format);
        let pipeline = gpu.guarded(|| pipeline(gpu, config.format))?;
        let pane = Self { surface, config, pipeline };
        gpu.guarded(|| pane.surface.configure(&gpu.device, &pane.config))?;
        Ok(Self { config: wgpu::SurfaceConfiguration { width: size_px[0], height: size_px[1], ..pane.config }, ..pane })
    }

    /// Width and height, pixels; 0 while minimised.
    pub fn size_px(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Takes note of a new size. A minimised window has none and is left alone until it has one again.
    pub fn resize(&mut self, renderer: &Renderer, size_px: [u32; 2]) {
        let limit = renderer.gpu.device.limits().max_texture_dimension_2d;
        [self.config.width, self.config.height] = size_px.map(|side| side.min(limit));
        if !size_px.contains(&0) {
            self.surface.configure(&renderer.gpu.device, &self.config);
        }
    }

    /// Draws a frame and shows it, `panel` in its top left corner. False when the window was hidden or just changing, so that nothing
    /// was drawn.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn show<'a>(
        &mut self,
        renderer: &mut Renderer,
        shot: &Shot,
        world: impl Into<World<'a>>,
        panel: Option<&RgbaImage>,
    ) -> Result<bool> {
        use wgpu::CurrentSurfaceTexture::{Lost, Outdated, Suboptimal, Success};
        let frame = match self.surface.get_current_texture() {
            Success(frame) | Suboptimal(frame) => frame,
            Outdated | Lost => {
                self.surface.configure(&renderer.gpu.device, &self.config);
                return renderer.gpu.check().map(|()| false);
            }
            _ => return renderer.gpu.check().map(|()| false),
        };
        renderer.draw(shot, world.into())?;
        let (gpu, picture) = (&renderer.gpu, renderer.drawn());
        let blank = RgbaImage::from_pixel(1, 1, Rgba([0; 4]));
        let panel =
            upload_mips(gpu, "present.panel", wgpu::TextureFormat::Rgba8UnormSrgb, std::slice::from_ref(panel.unwrap_or(&blank)));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("present.group"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&picture.view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&panel) },
            ],
        });
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("present") });
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("present"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
                })],
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..3, 0..1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.queue.present(frame);
        // Waiting makes the time of a frame the time it took.
        gpu.wait().map(|()| true)
    }
}

fn pipeline(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let shader = Shader::load(gpu, "present");
    // A surface that does not encode sRGB by itself is given encoded values.
    let constants = [("ENCODE", if format.is_srgb() { 0.0 } else { 1.0 })];
    let targets = [Some(format.into())];
    ScreenPipeline { constants: &constants, ..ScreenPipeline::new("present.pipeline", &shader, &targets) }.compiled(gpu)
}
