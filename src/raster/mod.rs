//! Plain images: [`Mask`] and the small software rasteriser.

mod mask;

pub use mask::{Mask, Rect};
