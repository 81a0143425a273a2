//! Plain images: [`Mask`] and the small software rasteriser.

mod fill;
mod mask;

pub use fill::{fill_polygon, fill_triangle};
pub use mask::{Mask, Rect};
