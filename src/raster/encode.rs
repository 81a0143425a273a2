//! Images to PNG and JPEG bytes.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageBuffer, ImageEncoder as _, Pixel, PixelWithColorType, RgbImage};

use crate::{Error, Result};

/// What an encoder aims at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PngEffort {
    /// Speed: pictures to look at.
    Quick,
    /// A small file: textures. Foliage barely compresses, so that the encoder's highest level would save another 0.5 % at most and take
    /// up to twice as long; this is the one below.
    Small,
}

/// An 8-bit image as a PNG file, quickly.
///
/// # Errors
/// Those of [`png_with`].
pub fn png<P>(image: &ImageBuffer<P, Vec<u8>>) -> Result<Vec<u8>>
where
    P: Pixel<Subpixel = u8> + PixelWithColorType,
{
    png_with(image, PngEffort::Quick)
}

/// An 8-bit image as a PNG file.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses the image, which it does for none with at least one pixel.
pub fn png_with<P>(image: &ImageBuffer<P, Vec<u8>>, effort: PngEffort) -> Result<Vec<u8>>
where
    P: Pixel<Subpixel = u8> + PixelWithColorType,
{
    let compression = match effort {
        PngEffort::Quick => CompressionType::Fast,
        PngEffort::Small => CompressionType::Default,
    };
    let mut bytes = Cursor::new(Vec::new());
    let encoder = PngEncoder::new_with_quality(&mut bytes, compression, FilterType::Adaptive);
    encoder
        .write_image(image.as_raw(), image.width(), image.height(), P::COLOR_TYPE)
        .map_err(|e| Error::Internal { stage: "png", what: e.to_string() })?;
    Ok(bytes.into_inner())
}

/// A picture as a JPEG file of that quality, 1..=100.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses the image, which it does only for one without pixels or beyond 65,535 a side.
pub fn jpeg(image: &RgbImage, quality: u8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode_image(image)
        .map_err(|e| Error::Internal { stage: "jpeg", what: e.to_string() })?;
    Ok(bytes)
}
