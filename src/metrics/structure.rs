//! SSIM (Wang et al. 2004): how alike the patterns of two pictures are, whatever their brightness; through the crate `image-compare`.

use image::{DynamicImage, RgbImage};
use image_compare::Algorithm;

use super::comparable;
use crate::{Error, Result};

/// Mean SSIM of the luma of two sRGB pictures over windows of 8 × 8 pixels: 1 for the same, about 0 for unlike ones. The crate sums squares
/// over a window where Wang takes their mean, so that flat windows are judged more harshly; `python_tools` holds both definitions.
///
/// # Errors
/// [`Error::UnlikeSizes`].
pub fn ssim(a: &RgbImage, b: &RgbImage) -> Result<f64> {
    comparable(a.dimensions(), b.dimensions())?;
    let [a, b] = [a, b].map(|picture| DynamicImage::from(picture.clone()).into_luma8());
    let alike = image_compare::gray_similarity_structure(&Algorithm::MSSIMSimple, &a, &b);
    alike.map(|found| found.score).map_err(|e| Error::Internal { stage: "metrics::ssim", what: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn patterns_count_and_brightness_hardly_does() {
        let stripes = |moved: u32, by: f32| {
            RgbImage::from_fn(64, 64, |x, y| {
                let v = if ((x + moved + y / 8) / 4).is_multiple_of(2) { 60.0 } else { 180.0 };
                Rgb([(v * by) as u8; 3])
            })
        };
        let truth = stripes(0, 1.0);
        assert_eq!(ssim(&truth, &truth).unwrap(), 1.0);
        let (darker, shifted) = (ssim(&truth, &stripes(0, 0.95)).unwrap(), ssim(&truth, &stripes(4, 1.0)).unwrap());
        assert!(darker > 0.98 && shifted < 0.0, "{darker} {shifted}");
    }
}
