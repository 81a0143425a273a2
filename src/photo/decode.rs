//! Decoding: JPEG, PNG, WebP, TIFF and BMP to upright 8-bit sRGB pixels. The content decides, never the file's name.

use std::io::{Cursor, ErrorKind};
use std::path::Path;

use image::error::LimitErrorKind;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, RgbImage};

use super::profile::convert_to_srgb;
use super::rare_tiff;
use crate::raster::Mask;
use crate::{Error, Result, files};

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

/// Bytes per pixel that no uncompressed kind exceeds (four 32-bit floats), and room for headers, profiles and thumbnails.
const MOST_BYTES_PER_PIXEL: u64 = 16;
const MOST_HEADER_BYTES: u64 = 64 << 20;

/// Reads and decodes one photograph.
///
/// # Errors
/// Those of [`files::read_whole`], and [`Error::InFile`] around those of [`decode_bytes`].
pub fn decode(path: &Path, params: &DecodeParams) -> Result<Photo> {
    let max_pixels = (params.max_megapixels * 1e6).ceil() as u64;
    let bytes = files::read_whole(path, max_pixels * MOST_BYTES_PER_PIXEL + MOST_HEADER_BYTES)?;
    decode_bytes(&bytes, params).map_err(|cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) })
}

/// Decodes the bytes of one photograph.
///
/// Deeper samples are rounded to 8 bits, floating-point ones clamped to 0–1 first, grey and CMYK become RGB, and the orientation
/// that a camera noted in EXIF is applied, and so is an ICC profile of RGB colours. Pixels under full transparency keep the colour the file gives them.
///
/// # Errors
/// [`Error::EmptyFile`], [`Error::NotAnImage`], [`Error::TooManyPixels`], [`Error::Truncated`], [`Error::DamagedImage`] or
/// [`Error::UnsupportedImage`].
pub fn decode_bytes(bytes: &[u8], params: &DecodeParams) -> Result<Photo> {
    let (format, name) = recognise(bytes)?;
    let within_limit = |(width, height): (u32, u32)| {
        let fits = f64::from(width) * f64::from(height) <= params.max_megapixels * 1e6;
        if fits { Ok(()) } else { Err(Error::TooManyPixels { width, height, limit_megapixels: params.max_megapixels }) }
    };
    declared_size(bytes).map_or(Ok(()), within_limit)?;

    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.no_limits(); // Set below, once the header has told the size.
    let mut decoder = match reader.into_decoder() {
        Ok(decoder) => decoder,
        Err(error @ ImageError::Unsupported(_)) if format == ImageFormat::Tiff => {
            let most = (params.max_megapixels * 1e6) as usize * MOST_BYTES_PER_PIXEL as usize;
            let (image, orientation) = rare_tiff::decode(bytes, most).ok_or_else(|| explain(error, format, name, bytes))?;
            return Ok(upright(image, None, orientation));
        }
        Err(error) => return Err(explain(error, format, name, bytes)),
    };
    let (width, height) = decoder.dimensions();
    within_limit((width, height))?;
    if format == ImageFormat::Jpeg && !jpeg_reaches_its_end(bytes) {
        return Err(Error::Truncated { format: name, length: bytes.len() });
    }
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(4 * MOST_BYTES_PER_PIXEL * u64::from(width) * u64::from(height) + MOST_HEADER_BYTES);
    decoder.set_limits(limits).map_err(|e| explain(e, format, name, bytes))?;
    // A damaged EXIF block is no reason to refuse the pixels.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let profile = decoder.icc_profile().ok().flatten();
    let image = DynamicImage::from_decoder(decoder).map_err(|e| explain(e, format, name, bytes))?;
    if image.width() == 0 || image.height() == 0 {
        return Err(Error::DamagedImage { format: name, cause: "it has no pixels".to_owned() });
    }
    Ok(upright(image, profile.as_deref(), orientation))
}

/// Turns pixels of any kind into a [`Photo`].
fn upright(image: DynamicImage, profile: Option<&[u8]>, orientation: Orientation) -> Photo {
    let opaque = image.color().has_alpha().then(|| {
        let rgba = image.to_rgba8();
        let mut mask = DynamicImage::ImageLuma8(image::GrayImage::from_fn(rgba.width(), rgba.height(), |x, y| {
            image::Luma([rgba.get_pixel(x, y)[3]])
        }));
        mask.apply_orientation(orientation);
        Mask::from_gray(&mask.into_luma8())
    });
    let mut rgb = image.into_rgb8();
    if let Some(profile) = profile {
        convert_to_srgb(&mut rgb, profile);
    }
    let mut image = DynamicImage::ImageRgb8(rgb);
    image.apply_orientation(orientation);
    let says_something = |mask: &Mask| mask.as_raw().contains(&0);
    Photo { image: image.into_rgb8(), opaque: opaque.filter(says_something) }
}

/// The kind of picture by its first bytes.
fn recognise(bytes: &[u8]) -> Result<(ImageFormat, &'static str)> {
    if bytes.is_empty() {
        return Err(Error::EmptyFile);
    }
    match image::guess_format(bytes) {
        Ok(ImageFormat::Jpeg) => Ok((ImageFormat::Jpeg, "JPEG")),
        Ok(ImageFormat::Png) => Ok((ImageFormat::Png, "PNG")),
        Ok(ImageFormat::WebP) => Ok((ImageFormat::WebP, "WebP")),
        Ok(ImageFormat::Tiff) => Ok((ImageFormat::Tiff, "TIFF")),
        Ok(ImageFormat::Bmp) => Ok((ImageFormat::Bmp, "BMP")),
        _ => Err(Error::NotAnImage { found: describe(bytes) }),
    }
}

/// Words for files that people take for photographs.
fn describe(bytes: &[u8]) -> &'static str {
    let brand = bytes.get(4..12).unwrap_or(&[]);
    match bytes {
        _ if brand.starts_with(b"ftypavi") => "an AVIF picture",
        _ if brand.starts_with(b"ftyphei") || brand == b"ftypmif1" => "a HEIC picture (as iPhones write them)",
        _ if brand.starts_with(b"ftyp") => "a film",
        [b'G', b'I', b'F', b'8', ..] => "a GIF picture",
        [0xff, 0x0a, ..] | [0, 0, 0, 0x0c, b'J', b'X', b'L', ..] => "a JPEG XL picture",
        [b'%', b'P', b'D', b'F', ..] => "a PDF document",
        [b'8', b'B', b'P', b'S', ..] => "a Photoshop document",
        _ if std::str::from_utf8(&bytes[..bytes.len().min(64)]).is_ok_and(|t| !t.contains('\0')) => "text",
        _ => "something else",
    }
}

/// The size that the header declares, whether or not anything sensible follows it: decoders stumble on a huge one before they tell.
fn declared_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let size = imagesize::blob_size(bytes).ok()?;
    Some((u32::try_from(size.width).unwrap_or(u32::MAX), u32::try_from(size.height).unwrap_or(u32::MAX)))
}

/// Whether the end marker follows the picture's data. The decoder itself fills what is missing with grey, and an end marker
/// elsewhere (in an embedded thumbnail) proves nothing, so the markers are walked (ITU-T T.81, annex B).
fn jpeg_reaches_its_end(bytes: &[u8]) -> bool {
    let mut rest = bytes.get(2..).unwrap_or(&[]);
    while let Some(at) = rest.iter().position(|&b| b == 0xff) {
        rest = &rest[at + 1..];
        match rest {
            [0xd9, ..] => return true,
            // Stuffed zeros and restart marks inside the data, fill bytes before a marker.
            [0x00 | 0x01 | 0xd0..=0xd8 | 0xff, ..] => {}
            [_, high, low, ..] => rest = rest.get(1 + usize::from(u16::from_be_bytes([*high, *low]))..).unwrap_or(&[]),
            _ => return false,
        }
    }
    false
}

/// A decoder's complaint as one of our errors.
fn explain(error: ImageError, format: ImageFormat, name: &'static str, bytes: &[u8]) -> Error {
    let ends_early = match (&error, format) {
        (ImageError::IoError(e), _) => e.kind() == ErrorKind::UnexpectedEof,
        (_, ImageFormat::Jpeg) => !jpeg_reaches_its_end(bytes),
        (_, ImageFormat::WebP) => riff_length(bytes).is_none_or(|length| bytes.len() < length),
        _ => false,
    };
    let cause = error.to_string();
    match error {
        _ if ends_early => Error::Truncated { format: name, length: bytes.len() },
        ImageError::Unsupported(_) => Error::UnsupportedImage { format: name, cause },
        ImageError::Limits(limit) if limit.kind() == LimitErrorKind::InsufficientMemory => {
            Error::DamagedImage { format: name, cause: "it asks for more memory than its size explains".to_owned() }
        }
        _ => Error::DamagedImage { format: name, cause },
    }
}

/// The length in bytes that a WebP file declares for itself.
fn riff_length(bytes: &[u8]) -> Option<usize> {
    let declared = bytes.get(4..8)?.try_into().map(u32::from_le_bytes).ok()?;
    usize::try_from(declared).ok()?.checked_add(8)
}
