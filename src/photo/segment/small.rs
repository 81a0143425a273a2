//! The photograph reduced to a size at which a whole crown is a few thousand pixels, and sums over windows of it.

use image::RgbImage;
use rayon::prelude::*;

use crate::raster::{Mask, decoded};

/// Long side of the reduced photograph, pixels: leaves are texture, boughs are shapes.
const LONG_SIDE_PX: u32 = 256;

/// One number per pixel of the reduced photograph, row by row.
pub type Plane = Vec<f32>;

/// The reduced photograph.
#[derive(Debug, Clone)]
pub struct Small {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Mean 8-bit sRGB of each pixel.
    pub rgb: Vec<[f32; 3]>,
    /// CIE L*a*b* (D65) of that mean.
    pub lab: Vec<[f32; 3]>,
}

impl Small {
    /// Reduces to the size at which crowns are found.
    pub fn new(image: &RgbImage) -> Self {
        Self::with_long_side(image, LONG_SIDE_PX)
    }

    /// Reduces by averaging boxes; a photograph smaller than the target keeps its size.
    pub fn with_long_side(image: &RgbImage, long_side_px: u32) -> Self {
        let (full_width, full_height) = (image.width() as usize, image.height() as usize);
        let shrink = (f64::from(long_side_px) / full_width.max(full_height) as f64).min(1.0);
        let size = |full: usize| ((full as f64 * shrink).round() as usize).max(1);
        let (width, height) = (size(full_width), size(full_height));
        let raw = image.as_raw();
        let rows = (0..height).into_par_iter().map(|y| {
            let (top, bottom) = (y * full_height / height, (y + 1) * full_height / height);
            let mut sums = vec![[0u32; 3]; width];
            for row in raw[3 * top * full_width..3 * bottom * full_width].chunks_exact(3 * full_width) {
                for (x, sum) in sums.iter_mut().enumerate() {
                    for p in row[3 * (x * full_width / width)..3 * ((x + 1) * full_width / width)].chunks_exact(3) {
                        (0..3).for_each(|c| sum[c] += u32::from(p[c]));
                    }
                }
            }
            let area = |x: usize| (((x + 1) * full_width / width - x * full_width / width) * (bottom - top)) as f32;
            sums.into_iter().enumerate().map(|(x, s)| s.map(|v| v as f32 / area(x))).collect::<Vec<_>>()
        });
        let rgb: Vec<[f32; 3]> = rows.flatten_iter().collect();
        let lab = rgb.par_iter().map(|&c| lab(c)).collect();
        Self { width, height, rgb, lab }
    }

    /// A full-size mask, seen at the middle of each pixel of a reduced photograph.
    pub fn new_mask(mask: &Mask, small: &Self) -> Vec<bool> {
        let at = |i: usize, n: usize, full: u32| ((2 * i + 1) * full as usize / (2 * n)) as i64;
        let (w, h) = (small.width, small.height);
        (0..small.count()).map(|i| mask.get(at(i % w, w, mask.width()), at(i / w, h, mask.height()))).collect()
    }

    /// A set of reduced pixels as a mask.
    pub fn to_mask(&self, set: &[bool]) -> Mask {
        Mask::from_fn(self.width as u32, self.height as u32, |x, y| set[y as usize * self.width + x as usize])
    }

    /// Pixels.
    pub fn count(&self) -> usize {
        self.width * self.height
    }

    /// Mean over the square window of half side `radius`, cut at the border.
    pub fn mean(&self, plane: &[f32], radius: usize) -> Plane {
        let sums = self.integral(plane);
        let stride = self.width + 1;
        let window = |i: usize, n: usize| (i.saturating_sub(radius), (i + radius + 1).min(n));
        let mut out = vec![0.0; self.count()];
        for (y, row) in out.chunks_mut(self.width).enumerate() {
            let (top, bottom) = window(y, self.height);
            for (x, value) in row.iter_mut().enumerate() {
                let (left, right) = window(x, self.width);
                let sum = sums[bottom * stride + right] + sums[top * stride + left]
                    - sums[bottom * stride + left]
                    - sums[top * stride + right];
                *value = (sum / ((bottom - top) * (right - left)) as f64) as f32;
            }
        }
        out
    }

    /// Standard deviation over the square window of half side `radius`.
    pub fn deviation(&self, plane: &[f32], radius: usize) -> Plane {
        let squares: Plane = plane.iter().map(|v| v * v).collect();
        let (mean, mean_square) = (self.mean(plane, radius), self.mean(&squares, radius));
        mean.iter().zip(&mean_square).map(|(m, s)| (s - m * m).max(0.0).sqrt()).collect()
    }

    /// Sums over all pixels above and to the left, with a border of zeros.
    fn integral(&self, plane: &[f32]) -> Vec<f64> {
        let stride = self.width + 1;
        let mut sums = vec![0.0; stride * (self.height + 1)];
        for (y, row) in plane.chunks(self.width).enumerate() {
            let mut along = 0.0;
            for (x, &v) in row.iter().enumerate() {
                along += f64::from(v);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + along;
            }
        }
        sums
    }
}

/// 8-bit sRGB to CIE L*a*b*.
pub fn lab(rgb: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(|v| decoded(v / 255.0));
    let f = |t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
    let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
    let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}
