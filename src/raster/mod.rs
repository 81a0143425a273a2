//! Plain images: [`Mask`] and the small software rasteriser.

mod encode;
mod mask;

pub use encode::png;
pub use mask::{Mask, Rect};
