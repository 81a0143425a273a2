//! Plain images: [`Mask`], float [`Layer`]s, mip chains, PNG bytes and the small software rasteriser.

mod depth;
mod encode;
mod facet;
mod fill;
mod layer;
mod mask;
mod mips;
mod moving;
mod render;
mod srgb;
mod texture;

pub use depth::exr_depth;
pub use encode::{PngEffort, jpeg, png, png_with};
pub use fill::{fill_polygon, fill_triangle};
pub use layer::Layer;
pub use mask::{Mask, Rect};
pub use mips::mip_chain;
pub use moving::{FRAME_MS, gif, webp};
pub use render::{Capture, Light, Material, View, Wrap, render, render_with};
pub use srgb::{color_difference, decoded, encoded, to_linear, to_srgb};
pub use texture::Texture;

/// Texels of less alpha, 0..=1, are gaps: in the atlas, in the file and in the preview alike.
pub const ALPHA_CUTOFF: f32 = 0.5;
