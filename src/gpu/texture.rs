//! Textures: render targets, and pictures uploaded with a mip chain that somebody else computed.

use image::RgbaImage;

use super::Gpu;

/// A texture that passes draw into, and its view.
#[derive(Debug)]
pub struct Target {
    /// The texture, for copies.
    pub texture: wgpu::Texture,
    /// All of it.
    pub view: wgpu::TextureView,
}

/// A render target that can also be sampled and read back.
pub fn target(gpu: &Gpu, label: &'static str, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> Target {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    Target { texture, view }
}

/// A sampled texture of the given levels, each half the size of the one before; `format` has four bytes a texel.
pub fn upload_mips(gpu: &Gpu, label: &'static str, format: wgpu::TextureFormat, levels: &[RgbaImage]) -> wgpu::TextureView {
    let (width, height) = levels[0].dimensions();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (level, picture) in levels.iter().enumerate() {
        let (width, height) = picture.dimensions();
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: level as u32,
                origin: wgpu::Origin3d::ZERO,
                aspect: wgpu::TextureAspect::All,
            },
            picture.as_raw(),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
