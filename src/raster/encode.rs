//! Images to PNG bytes.

use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageBuffer, ImageEncoder as _, Pixel, PixelWithColorType};

use crate::{Error, Result};

/// An 8-bit image as a PNG file.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses the image, which it does for none with at least one pixel.
pub fn png<P>(image: &ImageBuffer<P, Vec<u8>>) -> Result<Vec<u8>>
where
    P: Pixel<Subpixel = u8> + PixelWithColorType,
{
    let mut bytes = Cursor::new(Vec::new());
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    encoder
        .write_image(image.as_raw(), image.width(), image.height(), P::COLOR_TYPE)
        .map_err(|e| Error::Internal { stage: "png", what: e.to_string() })?;
    Ok(bytes.into_inner())
}
