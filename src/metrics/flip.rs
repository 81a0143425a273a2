//! ꟻLIP (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"): the error that a person sees who flickers
//! between two pictures; NVIDIA's own code, through the crate `nv-flip`.

use image::RgbImage;

use super::comparable;
use crate::Result;

/// From how near the pictures are looked at: pixels in one degree of the field of view. FLIP's own default: a screen 0.7 m wide with
/// 3,840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// FLIP of two pictures: 0 where none sees a difference, 1 at most.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Flip {
    /// Mean over all pixels.
    pub mean: f64,
    /// 99 % of the pixels have this or less: what a mean hides where little changes much.
    pub p99: f64,
}

/// FLIP of two sRGB pictures at [`PIXELS_PER_DEGREE`].
///
/// # Errors
/// [`Error::UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn flip(reference: &RgbImage, test: &RgbImage) -> Result<Flip> {
    let mut errors = flip_map(reference, test)?;
    let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
    let rank = (errors.len() * 99).div_ceil(100) - 1;
    let (_, p99, _) = errors.select_nth_unstable_by(rank, f32::total_cmp);
    Ok(Flip { mean, p99: f64::from(*p99) })
}

/// FLIP of every pixel, row by row from the top left.
///
/// # Errors
/// [`Error::UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn flip_map(reference: &RgbImage, test: &RgbImage) -> Result<Vec<f32>> {
    comparable(reference.dimensions(), test.dimensions())?;
    let plain = |picture: &RgbImage| nv_flip::FlipImageRgb8::with_data(picture.width(), picture.height(), picture.as_raw());
    Ok(nv_flip::flip(plain(reference), plain(test), PIXELS_PER_DEGREE).to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// Stripes and a slow change of colour.
    fn picture() -> RgbImage {
        RgbImage::from_fn(64, 48, |x, y| Rgb([if x / 3 % 2 == 0 { 40 } else { 200 }, (4 * y) as u8, 90]))
    }

    #[test]
    fn the_same_picture_has_no_difference_and_its_opposite_a_large_one() {
        let mut opposite = picture();
        opposite.pixels_mut().for_each(|p| p.0 = p.0.map(|v| 255 - v));
        assert_eq!(flip(&picture(), &picture()).unwrap(), Flip { mean: 0.0, p99: 0.0 });
        let far = flip(&picture(), &opposite).unwrap();
        assert!(far.mean > 0.4 && far.p99 > far.mean && far.p99 <= 1.0, "{far:?}");
    }

    #[test]
    fn the_99th_percentile_sees_what_the_mean_hides() {
        let mut spot = picture();
        (0..8).for_each(|i| (0..8).for_each(|j| spot.put_pixel(20 + i, 20 + j, Rgb([255, 0, 255]))));
        let seen = flip(&picture(), &spot).unwrap();
        assert!(seen.mean < 0.05 && seen.p99 > 0.4, "{seen:?}");
    }

    #[test]
    fn black_against_white_is_1() {
        let [black, white] = [0, 255].map(|v| RgbImage::from_pixel(16, 16, Rgb([v; 3])));
        let seen = flip(&black, &white).unwrap();
        assert!((seen.mean - 1.0).abs() < 0.05, "{seen:?}");
    }
}
