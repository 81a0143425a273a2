//! Plain images: [`Mask`], float [`Layer`]s, PNG bytes and the small software rasteriser.

mod encode;
mod fill;
mod layer;
mod mask;
mod render;

pub use encode::png;
pub use fill::{fill_polygon, fill_triangle};
pub use layer::Layer;
pub use mask::{Mask, Rect};
pub use render::{Capture, Light, Material, View, render, to_linear, to_srgb};
