//! Kinds of TIFF that the general decoder leaves out: grey with alpha, grey floating point, and 8-bit palettes.

use std::borrow::Cow;
use std::io::Cursor;

use image::metadata::Orientation;
use image::{DynamicImage, GrayAlphaImage, GrayImage, LumaA, Rgb, RgbImage};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// `PhotometricInterpretation` and two of its values (TIFF 6.0, p. 37).
const PHOTOMETRIC: u16 = 262;
const BLACK_IS_ZERO: u16 = 1;
const PALETTE: u16 = 3;

/// Decodes a TIFF of one of these kinds, with the orientation that it notes; `None` for any other or a damaged one.
/// No more than `max_bytes` are allocated for its samples.
pub fn decode(bytes: &[u8], max_bytes: usize) -> Option<(DynamicImage, Orientation)> {
    let (bytes, has_palette) = palette_as_grey(bytes);
    let mut limits = Limits::default();
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (max_bytes, max_bytes);
    let mut file = Decoder::new(Cursor::new(&*bytes)).ok()?.with_limits(limits);
    let (width, height) = file.dimensions().ok()?;
    let per_pixel = match file.colortype().ok()? {
        tiff::ColorType::Gray(_) => 1,
        tiff::ColorType::Multiband { num_samples, .. } if !has_palette => usize::from(num_samples),
        _ => return None,
    };
    let in_planes = file.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).ok()?.is_some_and(|layout| layout != 1);
    if in_planes && per_pixel > 1 {
        return None;
    }
    let orientation = file.find_tag_unsigned::<u8>(Tag::Orientation).ok().flatten().and_then(Orientation::from_exif);
    let colours =
        if has_palette { Some(file.get_tag_u16_vec(Tag::ColorMap).ok().filter(|map| map.len() == 3 * 256)?) } else { None };
    let samples = bytes_of(file.read_image().ok()?)?;
    if samples.is_empty() || samples.len() != width as usize * height as usize * per_pixel {
        return None;
    }
    let at = |x: u32, y: u32| (y as usize * width as usize + x as usize) * per_pixel;
    let image = match colours {
        Some(map) => {
            let colour = |index: usize| Rgb([0, 256, 512].map(|channel| (map[channel + index] >> 8) as u8));
            DynamicImage::ImageRgb8(RgbImage::from_fn(width, height, |x, y| colour(usize::from(samples[at(x, y)]))))
        }
        // A second sample is alpha; what further ones mean, nobody says.
        None if per_pixel == 2 => {
            let pixel = |x, y| LumaA([samples[at(x, y)], samples[at(x, y) + 1]]);
            DynamicImage::ImageLumaA8(GrayAlphaImage::from_fn(width, height, pixel))
        }
        None => DynamicImage::ImageLuma8(GrayImage::from_fn(width, height, |x, y| image::Luma([samples[at(x, y)]]))),
    };
    Some((image, orientation.unwrap_or(Orientation::NoTransforms)))
}

/// The samples as 8-bit ones; floating-point ones are clamped to 0–1.
fn bytes_of(samples: DecodingResult) -> Option<Vec<u8>> {
    let from_unit = |v: f64| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
    Some(match samples {
        DecodingResult::U8(values) => values,
        DecodingResult::U16(values) => values.iter().map(|&v| ((u32::from(v) + 128) / 257) as u8).collect(),
        DecodingResult::F32(values) => values.iter().map(|&v| from_unit(v.into())).collect(),
        DecodingResult::F64(values) => values.into_iter().map(from_unit).collect(),
        _ => return None,
    })
}

/// A file of 8-bit palette indices with its tag changed to grey, since the decoder reads the indices only so; whether it was one.
fn palette_as_grey(bytes: &[u8]) -> (Cow<'_, [u8]>, bool) {
    match photometric_value_at(bytes) {
        Some((at, big_endian)) if two(bytes, at, big_endian) == Some(PALETTE) => {
            let mut patched = bytes.to_vec();
            let grey = if big_endian { BLACK_IS_ZERO.to_be_bytes() } else { BLACK_IS_ZERO.to_le_bytes() };
            patched[at..at + 2].copy_from_slice(&grey);
            (patched.into(), true)
        }
        _ => (bytes.into(), false),
    }
}

/// Where the first directory keeps the value of `PhotometricInterpretation`, and the file's byte order.
fn photometric_value_at(bytes: &[u8]) -> Option<(usize, bool)> {
    let big_endian = bytes.starts_with(b"MM");
    let word: [u8; 4] = bytes.get(4..8)?.try_into().ok()?;
    let directory = if big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) } as usize;
    let entries = usize::from(two(bytes, directory, big_endian)?);
    // Entries of 12 bytes: tag, type, count, value.
    let mut starts = (0..entries).map(|entry| directory + 2 + 12 * entry);
    starts.find(|&at| two(bytes, at, big_endian) == Some(PHOTOMETRIC)).map(|at| (at + 8, big_endian))
}

fn two(bytes: &[u8], at: usize, big_endian: bool) -> Option<u16> {
    let pair = bytes.get(at..at.checked_add(2)?)?.try_into().ok()?;
    Some(if big_endian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) })
}
