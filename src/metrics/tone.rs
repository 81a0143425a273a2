//! How far apart the mean colours of two trees are.

use glam::{DVec3, Vec3};
use image::RgbaImage;

use crate::raster::{color_difference, encoded, to_linear};

/// CIEDE2000 between the mean colours of what is there in each picture: averaged in linear light, weighted by alpha. `None` where nothing is
/// in one of them.
pub fn mean_color_difference(a: &RgbaImage, b: &RgbaImage) -> Option<f64> {
    Some(color_difference(mean(a)?, mean(b)?))
}

/// Encoded sRGB, 0 to 255, not rounded: a byte's step would be as much as half a unit of the difference.
fn mean(picture: &RgbaImage) -> Option<Vec3> {
    let mut sum = glam::DVec4::ZERO;
    for p in picture.pixels().filter(|p| p.0[3] > 0) {
        let alpha = f64::from(p.0[3]) / 255.0;
        let [r, g, b] = [p.0[0], p.0[1], p.0[2]].map(|v| f64::from(to_linear(v)));
        sum += (alpha * DVec3::new(r, g, b)).extend(alpha);
    }
    (sum.w > 0.0).then(|| Vec3::from((sum.truncate() / sum.w).to_array().map(|v| 255.0 * encoded(v as f32))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn what_is_not_there_has_no_colour() {
        let tree = |color: [u8; 3]| {
            RgbaImage::from_fn(8, 8, |x, _| if x < 4 { Rgba([color[0], color[1], color[2], 255]) } else { Rgba([255, 0, 255, 0]) })
        };
        assert_eq!(mean_color_difference(&tree([60, 90, 30]), &tree([60, 90, 30])), Some(0.0));
        let darker = mean_color_difference(&tree([60, 90, 30]), &tree([57, 86, 28])).unwrap();
        assert!(darker > 0.5 && darker < 3.0, "{darker}");
        assert_eq!(mean_color_difference(&tree([1, 2, 3]), &RgbaImage::new(8, 8)), None);
    }
}
