//! The exemplar: the most representative square of foliage (She §3.2, "texture sample of the crown").

use image::RgbaImage;

use crate::raster::Rect;

crate::params! {
    /// How the exemplar is chosen.
    pub struct ExemplarParams {
        /// How much of the photograph's own shading is flattened out of the exemplar, so that it can be lit anew.
        delight: f64 = 0.7, in 0.0..=1.0, unit "", source "ours: chosen by looking";
    }
}

/// A square of foliage to synthesise from.
#[derive(Debug, Clone)]
pub struct Exemplar {
    /// sRGB pixels; alpha 0 where the sky shows through.
    pub image: RgbaImage,
    /// Where it was cut from the photograph, in its pixels.
    pub window_px: Rect,
    /// Exemplar texels per pixel of the photograph.
    pub scale: f64,
}
