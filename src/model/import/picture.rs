//! Textures of imported models: PNG, JPEG and WebP (and what else `image` reads, for OBJ) to 8-bit sRGB with straight alpha.

use std::io::Cursor;

use glam::Vec3;
use image::imageops::{self, FilterType};
use image::{ImageReader, Limits, RgbaImage};

use crate::model::glb::MAX_TEXTURE_PX;
use crate::raster::ALPHA_CUTOFF;

/// Longest side that is decoded at all; it is then shrunk to [`MAX_TEXTURE_PX`].
const LONGEST_PX: usize = 2 * MAX_TEXTURE_PX as usize;
/// How many pixels all textures of one file may have together: 1 GiB of memory.
const MOST_PIXELS: usize = 1 << 28;
/// Bytes per pixel that no kind of picture exceeds while it is decoded, and room for headers and profiles.
const MOST_BYTES_PER_PIXEL: u64 = 16;
const MOST_HEADER_BYTES: u64 = 64 << 20;

/// What is left of [`MOST_PIXELS`] for one file.
#[derive(Debug)]
pub struct PixelBudget(usize);

impl Default for PixelBudget {
    fn default() -> Self {
        Self(MOST_PIXELS)
    }
}

impl PixelBudget {
    /// Admits a picture by the size that its header declares, before memory is allocated for it.
    ///
    /// # Errors
    /// Why not, as the end of a sentence that begins with the picture.
    pub fn admit(&mut self, bytes: &[u8]) -> Result<(), String> {
        let size = imagesize::blob_size(bytes).map_err(|_| "is no PNG, JPEG or WebP picture".to_owned())?;
        if size.width == 0 || size.height == 0 {
            return Err("has no pixels".to_owned());
        }
        let pixels = size.width.saturating_mul(size.height);
        if size.width.max(size.height) > LONGEST_PX || !self.spend(pixels) {
            return Err(format!("has {}×{} pixels, which is too many", size.width, size.height));
        }
        Ok(())
    }

    /// Takes so many pixels out of the budget; false when it has fewer.
    pub fn spend(&mut self, pixels: usize) -> bool {
        let left = self.0.checked_sub(pixels);
        self.0 = left.unwrap_or(self.0);
        left.is_some()
    }
}

/// Decodes an admitted picture. One beyond [`MAX_TEXTURE_PX`] is shrunk.
///
/// # Errors
/// As [`PixelBudget::admit`].
pub fn decode(bytes: &[u8]) -> Result<RgbaImage, String> {
    let damaged = |cause: String| format!("cannot be decoded ({cause})");
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| damaged(e.to_string()))?;
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(LONGEST_PX as u32), Some(LONGEST_PX as u32));
    let size = imagesize::blob_size(bytes).map_err(|e| damaged(e.to_string()))?;
    limits.max_alloc = Some(MOST_BYTES_PER_PIXEL * size.width as u64 * size.height as u64 + MOST_HEADER_BYTES);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| damaged(e.to_string()))?.into_rgba8();
    let longest = image.width().max(image.height());
    if longest <= MAX_TEXTURE_PX {
        return Ok(image);
    }
    let side = |px: u32| (px as u64 * u64::from(MAX_TEXTURE_PX) / u64::from(longest)).max(1) as u32;
    Ok(imageops::resize(&image, side(image.width()), side(image.height()), FilterType::Triangle))
}

/// Whether the picture is cut out somewhere: a share of it that nobody would overlook is transparent.
pub fn has_cut_outs(picture: &RgbaImage) -> bool {
    let gaps = picture.pixels().filter(|p| f32::from(p[3]) < 255.0 * ALPHA_CUTOFF).count();
    gaps as f64 > 0.002 * f64::from(picture.width()) * f64::from(picture.height())
}

/// The picture with its mirror image beside and below it as asked, so that repeating it is mirrored repetition of the original.
pub fn unfolded(picture: &RgbaImage, across: bool, down: bool) -> RgbaImage {
    let (width, height) = picture.dimensions();
    let size = |px: u32, twice: bool| if twice { 2 * px } else { px };
    let folded = |at: u32, px: u32| if at < px { at } else { 2 * px - 1 - at };
    RgbaImage::from_fn(size(width, across), size(height, down), |x, y| *picture.get_pixel(folded(x, width), folded(y, height)))
}

/// The normals in the picture with slopes `scale` times as steep (glTF 2.0, 3.9.3: `normalTexture.scale`).
pub fn steeper(picture: &RgbaImage, scale: f32) -> RgbaImage {
    let mut steeper = picture.clone();
    for pixel in steeper.pixels_mut() {
        let [x, y, z] = [pixel[0], pixel[1], pixel[2]].map(|v| f32::from(v) / 127.5 - 1.0);
        let n = Vec3::new(x * scale, y * scale, z).normalize_or(Vec3::Z);
        for (channel, value) in n.to_array().into_iter().enumerate() {
            pixel[channel] = (127.5 * (value + 1.0)).round() as u8;
        }
    }
    steeper
}
