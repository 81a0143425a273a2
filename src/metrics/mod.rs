//! How alike two pictures are: pictures in, numbers out.
//!
//! * [`flip`]: what a person flickering between the two would see (Andersson et al. 2020), mean and 99th percentile;
//! * [`ssim`]: how alike their patterns are, whatever their brightness;
//! * [`silhouette_iou`], [`hausdorff_px`], [`covered_area_error`]: how far two outlines cover the same pixels;
//! * [`mean_color_difference`]: how far their tones are apart;
//! * [`depth_rms_m`]: how far what is seen lies apart in depth;
//! * [`film_quality_jod`]: how much worse a film looks, flicker and jumps included (Mantiuk et al. 2024);
//! * [`difference`]: the plain figures of OpenImageIO's `idiff`, for any samples, depth among them.
//!
//! Pictures of two sizes are an error, never scaled. Transparent pictures are laid over something first: see [`over`].

mod depth;
mod difference;
mod flip;
mod outline;
mod silhouette;
mod structure;
mod tone;
mod video;

use image::{RgbImage, RgbaImage};

pub use depth::depth_rms_m;
pub use difference::{Difference, difference, difference_of_pictures};
pub use flip::{Flip, PIXELS_PER_DEGREE, flip, flip_map};
pub use outline::{covered_area_error, hausdorff_px};
pub use silhouette::{silhouette, silhouette_iou};
pub use structure::ssim;
pub use tone::mean_color_difference;
pub use video::{FRAMES_PER_SECOND, film_quality_jod};

use crate::{Error, Result};

/// A picture with straight alpha laid over one colour. Mixed as the bytes are (sRGB), which is what picture viewers do.
pub fn over(picture: &RgbaImage, below: [u8; 3]) -> RgbImage {
    RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
        let [r, g, b, a] = picture.get_pixel(x, y).0.map(u32::from);
        let mix = |top: u32, below: u8| ((top * a + u32::from(below) * (255 - a) + 127) / 255) as u8;
        image::Rgb([mix(r, below[0]), mix(g, below[1]), mix(b, below[2])])
    })
}

/// Both of one size, and of any.
fn comparable(a: (u32, u32), b: (u32, u32)) -> Result<()> {
    if a == b && a.0 > 0 && a.1 > 0 { Ok(()) } else { Err(Error::UnlikeSizes { a: a.into(), b: b.into() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn laid_over_black_and_white_a_half_transparent_pixel_is_half_of_it() {
        let picture = RgbaImage::from_fn(3, 1, |x, _| Rgba([200, 100, 0, [0, 255, 128][x as usize]]));
        assert_eq!(over(&picture, [0; 3]).into_raw(), [0, 0, 0, 200, 100, 0, 100, 50, 0]);
        assert_eq!(over(&picture, [255; 3]).into_raw(), [255, 255, 255, 200, 100, 0, 227, 177, 127]);
    }

    #[test]
    fn other_sizes_and_no_size_are_refused() {
        let sizes = [(0, 0), (0, 4), (4, 4), (4, 5)];
        for a in sizes {
            for b in sizes {
                let [one, two] = [a, b].map(|(w, h)| RgbaImage::new(w, h));
                let alike = a == b && a.0 > 0;
                assert_eq!(silhouette_iou(&silhouette(&one), &silhouette(&two)).is_ok(), alike);
                assert_eq!(difference_of_pictures(&one, &two, 0.0).is_ok(), alike);
                assert_eq!(flip(&over(&one, [0; 3]), &over(&two, [0; 3])).is_ok(), alike);
            }
        }
        let words = difference_of_pictures(&RgbaImage::new(4, 4), &RgbaImage::new(4, 5), 0.0).unwrap_err().to_string();
        assert!(words.contains("4×4") && words.contains("4×5"), "{words}");
    }
}
