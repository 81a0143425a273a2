//! Decoding: JPEG, PNG, WebP, TIFF and BMP to upright 8-bit sRGB pixels.

use image::RgbImage;

use crate::raster::Mask;

crate::params! {
    /// How much picture is accepted.
    pub struct DecodeParams {
        /// Largest accepted photograph; a larger one is refused before memory is allocated for it.
        max_megapixels: f64 = 200.0, in 0.000001..=4000.0, unit "MP", source "ours: the largest phone cameras of 2026";
    }
}

/// A decoded photograph.
#[derive(Debug, Clone)]
pub struct Photo {
    /// 8-bit sRGB pixels, upright (EXIF orientation applied).
    pub image: RgbImage,
    /// The pixels at least half opaque, when the file has transparency that says something (a cut-out).
    pub opaque: Option<Mask>,
}
