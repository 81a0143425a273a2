//! Outlines compared: which pixels are there at all.

use image::RgbaImage;

use super::comparable;
use crate::Result;
use crate::raster::Mask;

/// The pixels of which at least half is there.
pub fn silhouette(picture: &RgbaImage) -> Mask {
    Mask::from_fn(picture.width(), picture.height(), |x, y| picture.get_pixel(x, y).0[3] >= 128)
}

/// Intersection over union of two silhouettes: 1 for the same, 0 for two that have no pixel in common; 1 when both are empty.
///
/// # Errors
/// [`Error::UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn silhouette_iou(a: &Mask, b: &Mask) -> Result<f64> {
    comparable((a.width(), a.height()), (b.width(), b.height()))?;
    Ok(a.iou(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn a_square_moved_by_half_its_side_shares_a_third() {
        let square = |left: u32| {
            let there = |x: u32, y: u32| (left..left + 8).contains(&x) && (4..12).contains(&y);
            silhouette(&RgbaImage::from_fn(24, 16, |x, y| Rgba([0, 0, 0, if there(x, y) { 128 } else { 127 }])))
        };
        assert_eq!(silhouette_iou(&square(4), &square(8)).unwrap(), 1.0 / 3.0);
        assert_eq!(silhouette_iou(&square(0), &square(8)).unwrap(), 0.0);
        assert_eq!(silhouette_iou(&square(4), &square(4)).unwrap(), 1.0);
    }
}
