//! Colour profiles: pixels in a camera's own colour space (phones write Display P3) become sRGB.

use image::RgbImage;
use moxcms::{ColorProfile, DataColorSpace, Layout, Transform8BitExecutor, TransformOptions};
use rayon::prelude::*;
use std::sync::Arc;

/// Largest change that is left alone, 8-bit levels: rounding, not a different colour space.
const SAME_LEVELS: u8 = 1;

/// Converts `image` from the colour space of an ICC profile to sRGB. A profile that is damaged, is not of RGB colours (of a CMYK
/// picture that the decoder has converted), or is sRGB itself changes nothing.
pub fn convert_to_srgb(image: &mut RgbImage, icc: &[u8]) {
    let Some(transform) = transform_from(icc).filter(moves_colours) else { return };
    let row_bytes = 3 * image.width() as usize;
    (**image).par_chunks_mut(row_bytes.max(1)).for_each_init(Vec::new, |before, row| {
        before.clear();
        before.extend_from_slice(row);
        // Fails only for buffers of unlike lengths; the row would keep its colours.
        let _ = transform.transform(before, row);
    });
}

fn transform_from(icc: &[u8]) -> Option<Arc<Transform8BitExecutor>> {
    let profile = ColorProfile::new_from_slice(icc).ok().filter(|p| p.color_space == DataColorSpace::Rgb)?;
    profile.create_transform_8bit(Layout::Rgb, &ColorProfile::new_srgb(), Layout::Rgb, TransformOptions::default()).ok()
}

/// Whether any colour of a 6×6×6 grid changes visibly.
fn moves_colours(transform: &Arc<Transform8BitExecutor>) -> bool {
    let level = |i: u8| 51 * i;
    let grid: Vec<u8> = (0..216u8).flat_map(|i| [level(i / 36), level(i / 6 % 6), level(i % 6)]).collect();
    let mut moved = vec![0; grid.len()];
    let converted = transform.transform(&grid, &mut moved).is_ok();
    converted && grid.iter().zip(&moved).any(|(a, b)| a.abs_diff(*b) > SAME_LEVELS)
}
