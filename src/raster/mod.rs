//! Plain images: [`Mask`], float [`Layer`]s and the small software rasteriser.

mod layer;
mod mask;
mod render;

pub use layer::Layer;
pub use mask::{Mask, Rect};
pub use render::{Capture, Light, Material, View, render, to_linear, to_srgb};
