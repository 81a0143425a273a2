//! Which square of the crown is most like the whole crown (ours; She leaves the choice to the user).

use glam::Vec3;

use super::delight::{ReducedCrown, Shading};
use crate::raster::{Mask, Rect, to_srgb};

/// Bins of each of the three channels (brightness, red against green, yellow against blue).
const BINS: usize = 8;
/// Planes of the integral image: crown, gaps, sum of brightness, three histograms.
const PLANES: usize = 3 + 3 * BINS;

/// Finds the window, pixels of the photograph; a square inside the picture. `mask` is the crown and not empty.
pub(super) fn find(crown: &ReducedCrown, mask: &Mask, shading: &Shading) -> Rect {
    let photo_size = (mask.width(), mask.height());
    let sums = Sums::of(crown, &crown.cover(mask), shading);
    let (width, height) = (crown.foliage.width, crown.foliage.height);
    let inscribed = (1..=width.min(height)).rev().find(|&side| sums.windows(side, 1).any(|(x, y)| sums.inside(x, y, side) > 0.98));
    let inscribed = inscribed.unwrap_or(1);
    let whole = sums.window(0, 0, width, height);
    let sides: Vec<usize> =
        [0.6, 0.5, 0.42, 0.35, 0.29, 0.24].iter().map(|f| ((f * inscribed as f64).round() as usize).max(1)).collect();
    let mut best = (f32::INFINITY, Rect { x: 0, y: 0, width: 1, height: 1 });
    for &side in &sides {
        let stride = (side / 16).max(1);
        for (x, y) in sums.windows(side, stride).filter(|&(x, y)| sums.inside(x, y, side) > 0.98) {
            // Halving the window's area costs as much as a seventh of the histograms being off.
            let size = 0.14 * (inscribed as f32 / side as f32).log2();
            let cost = sums.cost(x, y, side, &whole) + size;
            if cost < best.0 {
                best = (cost, Rect { x: x as u32, y: y as u32, width: side as u32, height: side as u32 });
            }
        }
    }
    let px = |v: u32| (f64::from(v) * crown.step_px).floor() as u32;
    let side = ((f64::from(best.1.width) * crown.step_px).round() as u32).clamp(1, photo_size.0.min(photo_size.1));
    let x = (crown.bounds.x + px(best.1.x)).min(photo_size.0 - side);
    let y = (crown.bounds.y + px(best.1.y)).min(photo_size.1 - side);
    Rect { x, y, width: side, height: side }
}

/// Integral images over the reduced crown.
struct Sums {
    width: usize,
    height: usize,
    table: Vec<[f32; PLANES]>,
}

impl Sums {
    fn of(crown: &ReducedCrown, inside: &[f32], shading: &Shading) -> Self {
        let (width, height) = (crown.foliage.width, crown.foliage.height);
        let mut table = vec![[0.0; PLANES]; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = [0.0; PLANES];
            for x in 0..width {
                let (t, inside) = (crown.foliage.texels[y * width + x], inside[y * width + x]);
                row[0] += inside;
                row[1] += (inside - t.w).max(0.0);
                if t.w > 0.0 {
                    let at = |v: usize, origin: u32| f64::from(origin) + (v as f64 + 0.5) * crown.step_px;
                    let gain = shading.gain(at(x, crown.bounds.x), at(y, crown.bounds.y));
                    let [r, g, b] = (gain * t.truncate() / t.w).to_array().map(|v| f32::from(to_srgb(v)) / 255.0);
                    let brightness = Vec3::new(r, g, b).dot(Vec3::new(0.3, 0.6, 0.1));
                    row[2] += t.w * brightness;
                    let channels = [brightness, 0.5 + 1.2 * (r - g), 0.5 + 0.6 * (r + g - 2.0 * b)];
                    for (c, v) in channels.iter().enumerate() {
                        row[3 + c * BINS + ((v * BINS as f32) as usize).min(BINS - 1)] += t.w;
                    }
                }
                let above = table[y * (width + 1) + x + 1];
                table[(y + 1) * (width + 1) + x + 1] = std::array::from_fn(|i| above[i] + row[i]);
            }
        }
        Self { width, height, table }
    }

    /// Top left corners of the squares of that side.
    fn windows(&self, side: usize, stride: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (columns, rows) = ((self.width + 1).saturating_sub(side), (self.height + 1).saturating_sub(side));
        (0..rows).step_by(stride).flat_map(move |y| (0..columns).step_by(stride).map(move |x| (x, y)))
    }

    fn window(&self, x: usize, y: usize, w: usize, h: usize) -> [f32; PLANES] {
        let at = |x: usize, y: usize| &self.table[y * (self.width + 1) + x];
        let (a, b, c, d) = (at(x, y), at(x + w, y), at(x, y + h), at(x + w, y + h));
        std::array::from_fn(|i| d[i] - b[i] - c[i] + a[i])
    }

    /// The part of the square inside the crown.
    fn inside(&self, x: usize, y: usize, side: usize) -> f32 {
        let at = |x: usize, y: usize| self.table[y * (self.width + 1) + x][0];
        (at(x + side, y + side) - at(x + side, y) - at(x, y + side) + at(x, y)) / (side * side) as f32
    }

    /// How unlike the whole crown the square is; 0 would be a perfect sample.
    fn cost(&self, x: usize, y: usize, side: usize, whole: &[f32; PLANES]) -> f32 {
        let sum = self.window(x, y, side, side);
        let foliage = |p: &[f32; PLANES]| p[3..3 + BINS].iter().sum::<f32>().max(1e-6);
        let histogram: f32 = (3..PLANES).map(|i| (sum[i] / foliage(&sum) - whole[i] / foliage(whole)).abs()).sum::<f32>() / 6.0;
        let gap = |p: &[f32; PLANES]| p[1] / p[0].max(1e-6);
        // Sky beyond the crown's own share is worse than too little of it,
        // but a dense corner of a crown that lets the sky through is no sample of it either.
        let (more, less) = ((gap(&sum) - gap(whole)).max(0.0), (gap(whole) - gap(&sum) - 0.06).max(0.0));
        let half = (side / 2).max(1);
        let mean = |p: [f32; PLANES]| p[2] / foliage(&p);
        let halves = [
            (self.window(x, y, half, side), self.window(x + side - half, y, half, side)),
            (self.window(x, y, side, half), self.window(x, y + side - half, side, half)),
        ];
        let level = mean(sum).max(0.02);
        let slope = halves.map(|(a, b)| (mean(a) - mean(b)).abs() / level).iter().sum::<f32>();
        // Gaps gathered on one side are a bay of the outline or a missing branch, and would be strewn all over.
        let patchy = halves.map(|(a, b)| (gap(&a) - gap(&b)).abs()).iter().sum::<f32>();
        // So would a branch or a deep shadow: no sixteenth may differ much from the whole square.
        let part = (side / 4).max(1);
        let parts = (0..16).map(|i| self.window(x + (i % 4) * (side - part) / 3, y + (i / 4) * (side - part) / 3, part, part));
        let hole = parts.clone().map(|p| gap(&p)).fold(0.0, f32::max) - gap(&sum);
        let odd = parts.map(|p| (3..PLANES).map(|i| (p[i] / foliage(&p) - sum[i] / foliage(&sum)).abs()).sum::<f32>() / 6.0);
        let oddest = odd.fold(0.0, f32::max);
        histogram + 0.5 * slope + 4.0 * more + 1.6 * less + 1.5 * patchy + 0.4 * hole + 1.3 * oddest
    }
}
