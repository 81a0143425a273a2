//! The photograph's own shading, so that it can be divided out before the tree is lit anew.
//!
//! Ours (She textures with the photograph as it is): large-scale shading is what a low-pass of the luminance shows, in linear light and
//! over foliage only. Dividing by it and multiplying by the crown's mean luminance keeps leaves and their small shadows.

use glam::{Vec3, Vec4};
use image::RgbImage;

use crate::raster::{Layer, Mask, Rect, to_linear};

/// Luminance weights of linear sRGB.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Side of the reduced picture on which shading and windows are found: fine enough for a crown, quick for any photograph.
const REDUCED_PX: f64 = 256.0;

/// The crown in a reduced picture.
#[derive(Debug, Clone)]
pub struct ReducedCrown {
    /// Foliage colours, linear light, times the part of the reduced pixel that is foliage, and that part.
    pub foliage: Layer,
    /// What part of the photograph it shows, pixels.
    pub bounds: Rect,
    /// Photograph pixels per reduced pixel, at least 1.
    pub step_px: f64,
}

impl ReducedCrown {
    /// Reduces the crown's bounding rectangle to at most 256 pixels a side; `None` for an empty crown. Masks are of the picture's size.
    pub fn of(image: &RgbImage, crown: &Mask, gaps: &Mask) -> Option<Self> {
        let bounds = crown.bounds()?;
        let step_px = (f64::from(bounds.width.max(bounds.height)) / REDUCED_PX).max(1.0);
        let size = |px: u32| ((f64::from(px) / step_px).ceil() as usize).max(1);
        let (width, height) = (size(bounds.width), size(bounds.height));
        let (origin, extent) = ([f64::from(bounds.x), f64::from(bounds.y)], [width as f64 * step_px, height as f64 * step_px]);
        let foliage = Layer::area_average(width, height, origin, extent, |x, y| match crown.get(x, y) && !gaps.get(x, y) {
            true => linear_at(image, x, y).extend(1.0),
            false => Vec4::ZERO,
        });
        Some(Self { foliage, bounds, step_px })
    }

    /// The part of each reduced pixel that `mask` covers, row by row.
    pub fn cover(&self, mask: &Mask) -> Vec<f32> {
        let (width, height) = (self.foliage.width, self.foliage.height);
        let origin = [f64::from(self.bounds.x), f64::from(self.bounds.y)];
        let extent = [width as f64 * self.step_px, height as f64 * self.step_px];
        let cover = Layer::area_average(width, height, origin, extent, |x, y| Vec4::splat(f32::from(mask.get(x, y))));
        cover.texels.iter().map(|t| t.w).collect()
    }

    /// Mean linear colour of the foliage; `None` without any.
    pub fn mean(&self) -> Option<Vec3> {
        let sum: Vec4 = self.foliage.texels.iter().sum();
        (sum.w > 0.0).then(|| sum.truncate() / sum.w)
    }
}

/// Weighted linear colour and weight where the photograph shows foliage of the crown, all 0 elsewhere. Pixels beside sky are mixed with
/// it: they count for little.
pub fn foliage_at(image: &RgbImage, crown: &Mask, gaps: &Mask, x: i64, y: i64) -> Vec4 {
    if !crown.get(x, y) || gaps.get(x, y) {
        return Vec4::ZERO;
    }
    let sky_within =
        |d: i64| [(-d, 0), (d, 0), (0, -d), (0, d)].iter().any(|(dx, dy)| gaps.get(x + dx, y + dy) || !crown.get(x + dx, y + dy));
    let weight = if sky_within(1) {
        0.02
    } else if sky_within(2) {
        0.1
    } else {
        1.0
    };
    weight * linear_at(image, x, y).extend(1.0)
}

/// Linear colour of a pixel inside the picture.
fn linear_at(image: &RgbImage, x: i64, y: i64) -> Vec3 {
    Vec3::from(image.get_pixel(x as u32, y as u32).0.map(to_linear))
}

/// What to multiply linear colours with, anywhere in the photograph.
#[derive(Debug, Clone)]
pub struct Shading {
    gain: Layer,
    bounds: Rect,
    step_px: f64,
}

impl Shading {
    /// The shading of a crown; `amount` 0 leaves the photograph as it is, 1 flattens it.
    pub fn of(crown: &ReducedCrown, amount: f64) -> Self {
        let radius = (0.07 * crown.foliage.width.min(crown.foliage.height) as f64).ceil() as usize;
        let soft = crown.foliage.low_pass(radius);
        let mean = crown.mean().map_or(0.0, |m| m.dot(LUMINANCE));
        let gain = |t: &Vec4| {
            let local = if t.w > 1e-4 { t.truncate().dot(LUMINANCE) / t.w } else { mean };
            // Bounded: a black corner must not become noise.
            let ratio = if local > 0.0 && mean > 0.0 { (mean / local).clamp(0.4, 2.5) } else { 1.0 };
            Vec4::splat(ratio.powf(amount as f32))
        };
        let texels = soft.texels.iter().map(gain).collect();
        Self { gain: Layer { texels, ..soft }, bounds: crown.bounds, step_px: crown.step_px }
    }

    /// Weighted linear colours of the rectangle from `origin` of `extent` pixels of the photograph, without its shading.
    pub fn removed(&self, colors: Layer, origin: [f64; 2], extent: [f64; 2]) -> Layer {
        let (width, height) = (colors.width as f64, colors.height as f64);
        Layer::from_fn(colors.width, colors.height, |x, y| {
            let t = colors.texels[y * colors.width + x];
            let at = |i: usize, n: f64, axis: usize| origin[axis] + (i as f64 + 0.5) / n * extent[axis];
            (self.gain(at(x, width, 0), at(y, height, 1)) * t.truncate()).extend(t.w)
        })
    }

    /// The factor at a place of the photograph, pixels; beyond the crown as at its border.
    pub fn gain(&self, x: f64, y: f64) -> f32 {
        let at = |v: f64, origin: u32, n: usize| ((v - f64::from(origin)) / self.step_px).clamp(0.0, n as f64) as f32;
        self.gain.bilinear(at(x, self.bounds.x, self.gain.width), at(y, self.bounds.y, self.gain.height)).x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn full_delighting_flattens_a_ramp_and_none_keeps_it() {
        let image = RgbImage::from_fn(300, 200, |x, y| Rgb([20, (60 + x / 3 + 40 * ((x / 2 + y / 2) % 2)) as u8, 30]));
        let (crown, gaps) = (Mask::from_fn(300, 200, |x, _| x >= 10), Mask::new(300, 200));
        let reduced = ReducedCrown::of(&image, &crown, &gaps).unwrap();
        let spread = |amount| {
            let shading = Shading::of(&reduced, amount);
            let mean = |from: i64| {
                let lum = |x: i64| {
                    (0..200).map(|y| foliage_at(&image, &crown, &gaps, x, y).y * shading.gain(x as f64 + 0.5, 100.0)).sum::<f32>()
                };
                (from..from + 40).map(lum).sum::<f32>()
            };
            mean(250) / mean(20)
        };
        assert!(spread(0.0) > 1.7 && (spread(1.0) - 1.0).abs() < 0.15, "{} {}", spread(0.0), spread(1.0));
    }
}
