//! The pictures that a frame is made in.

use crate::gpu::{Gpu, Target, target};
use crate::{Error, Result};

/// Colour, linear values stored as sRGB.
pub const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Reversed depth.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Where on which crown a pixel lies; 0 where no tree is.
pub const ID: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// All targets of one picture size.
#[derive(Debug)]
pub struct Targets {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// The frame: backdrop, then the trees.
    pub frame_color: Target,
    /// Its depth.
    pub frame_depth: Target,
    /// The temporary picture of the trees (She §3.4).
    pub tree_color: Target,
    /// Its depth.
    pub tree_depth: Target,
    /// Its ids.
    pub tree_id: Target,
}

impl Targets {
    /// Targets of that size.
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Self {
        Self {
            size_px,
            frame_color: target(gpu, "frame.color", size_px, COLOR),
            frame_depth: target(gpu, "frame.depth", size_px, DEPTH),
            tree_color: target(gpu, "trees.color", size_px, COLOR),
            tree_depth: target(gpu, "trees.depth", size_px, DEPTH),
            tree_id: target(gpu, "trees.id", size_px, ID),
        }
    }
}

/// Pixels of a picture for which a buffer has room, of so many bytes each.
///
/// # Errors
/// [`Error::OutlineSize`] when it has not.
pub fn listed_pixels(gpu: &Gpu, size_px: [u32; 2], bytes_per_px: u64) -> Result<u64> {
    let pixels = u64::from(size_px[0]) * u64::from(size_px[1]);
    let limits = gpu.device.limits();
    let limit_px = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / bytes_per_px;
    if pixels > limit_px { Err(Error::OutlineSize { found: size_px, limit_px }) } else { Ok(pixels) }
}

/// A depth attachment, cleared to "nothing there" or kept.
pub fn depth_attachment(target: &Target, clear: bool) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let load = if clear { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
    wgpu::RenderPassDepthStencilAttachment {
        view: &target.view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

/// A colour attachment, cleared or kept.
pub fn color_attachment(target: &Target, clear: Option<wgpu::Color>) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let load = clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear);
    Some(wgpu::RenderPassColorAttachment {
        view: &target.view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    })
}

/// Nearer wins, and is kept.
pub fn nearer() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Greater),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}
