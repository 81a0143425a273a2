//! How far two outlines lie apart, and how much they cover.

use image::Luma;
use imageproc::distance_transform::euclidean_squared_distance_transform;

use super::comparable;
use crate::Result;
use crate::raster::Mask;

/// Hausdorff distance of two silhouettes, pixels: how far the pixel of either that lies farthest from the other lies from it. 0 for two empty
/// ones, infinite where only one is.
///
/// # Errors
/// [`Error::UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn hausdorff_px(a: &Mask, b: &Mask) -> Result<f64> {
    comparable((a.width(), a.height()), (b.width(), b.height()))?;
    Ok(match (a.count(), b.count()) {
        (0, 0) => 0.0,
        (0, _) | (_, 0) => f64::INFINITY,
        _ => one_way_px(a, b).max(one_way_px(b, a)),
    })
}

/// How far the pixel of `a` that lies farthest from `b` lies from it.
fn one_way_px(a: &Mask, b: &Mask) -> f64 {
    let squared = euclidean_squared_distance_transform(&b.to_gray());
    let inside = a.as_raw().iter().zip(squared.pixels()).filter(|(inside, _)| **inside != 0);
    inside.map(|(_, &Luma([squared]))| squared).fold(0.0, f64::max).sqrt()
}

/// How much more (above 0) or less `test` covers than `reference`, in parts of what that covers; infinite where that covers nothing.
pub fn covered_area_error(reference: &Mask, test: &Mask) -> f64 {
    match (reference.count() as f64, test.count() as f64) {
        (0.0, 0.0) => 0.0,
        (0.0, _) => f64::INFINITY,
        (reference, test) => test / reference - 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(left: i64, side: i64) -> Mask {
        Mask::from_fn(40, 30, |x, y| (left..left + side).contains(&i64::from(x)) && (5..5 + side).contains(&i64::from(y)))
    }

    #[test]
    fn a_shift_is_as_far_as_it_is_and_a_single_pixel_counts() {
        assert_eq!(hausdorff_px(&square(4, 8), &square(4, 8)).unwrap(), 0.0);
        assert_eq!(hausdorff_px(&square(4, 8), &square(7, 8)).unwrap(), 3.0);
        let mut stray = square(4, 8);
        stray.set(30, 12, true);
        assert_eq!(hausdorff_px(&square(4, 8), &stray).unwrap(), 19.0);
        assert_eq!(hausdorff_px(&square(4, 0), &square(4, 8)).unwrap(), f64::INFINITY);
        assert_eq!(hausdorff_px(&square(4, 0), &square(4, 0)).unwrap(), 0.0);
    }

    #[test]
    fn area_is_told_with_its_sign() {
        assert_eq!(covered_area_error(&square(4, 10), &square(4, 5)), -0.75);
        assert_eq!(covered_area_error(&square(4, 5), &square(9, 10)), 3.0);
        assert_eq!(covered_area_error(&square(4, 0), &square(4, 1)), f64::INFINITY);
    }
}
