//! Plain images: [`Mask`] and the small software rasteriser.

mod encode;
mod mask;
mod render;

pub use encode::png;
pub use mask::{Mask, Rect};
pub use render::{Capture, Light, Material, View, render, to_linear, to_srgb};
