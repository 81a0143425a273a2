//! Grain: how much a picture's colours change from texel to texel, and giving back to the atlas what resampling took of it.
//!
//! Ours (She §3.2 only asks that seams be "eliminated"; blur would be no cure). Colours in encoded sRGB 0..=255, distances in texels.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::measure::{Shaded, step};
use crate::raster::{ALPHA_CUTOFF, Layer};

/// Distances between neighbours at which a picture's grain is measured, texels.
const DISTANCES: [f32; 4] = [0.5, 1.0, 2.0, 4.0];

/// Mean colour step between neighbouring texels of a picture that is resampled to texels of [`DISTANCES`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Grain([f64; DISTANCES.len()]);

impl Grain {
    /// Coarser texels average those they cover, finer ones interpolate between them.
    pub(super) fn of(layer: &Layer) -> Self {
        let (half, quarter) = (averaged(layer, 2), averaged(layer, 4));
        let at = |i: usize| mean_step([layer, layer, &half, &quarter][i], DISTANCES[i].min(1.0));
        // Too few texels to be averaged or interpolated: as at the density before.
        let one = at(1).unwrap_or(0.0);
        let two = at(2).unwrap_or(one);
        Self([at(0).unwrap_or(0.5 * one), one, two, at(3).unwrap_or(two)])
    }

    /// The step between texels `distance` apart; at least a thousandth, so that ratios exist.
    pub(super) fn at(&self, distance: f32) -> f64 {
        let next = DISTANCES.iter().position(|&d| d > distance);
        let step = match next {
            Some(0) => self.0[0] * f64::from(distance / DISTANCES[0]),
            Some(i) => {
                let part = f64::from((distance - DISTANCES[i - 1]) / (DISTANCES[i] - DISTANCES[i - 1]));
                self.0[i - 1] + part * (self.0[i] - self.0[i - 1])
            }
            None => self.0[DISTANCES.len() - 1],
        };
        step.max(1e-3)
    }
}

/// The layer in texels `factor` times as large; colours are means of what the alpha test keeps.
fn averaged(layer: &Layer, factor: usize) -> Layer {
    Layer::from_fn(layer.width / factor, layer.height / factor, |x, y| {
        let texels = (0..factor * factor).map(|i| layer.texels[(y * factor + i / factor) * layer.width + x * factor + i % factor]);
        let sum: Vec4 = texels.filter(|t| t.w >= ALPHA_CUTOFF).map(|t| t.truncate().extend(1.0)).sum();
        (sum.truncate() / sum.w.max(1.0)).extend(sum.w / (factor * factor) as f32)
    })
}

/// Mean step between places `distance` texels apart along x and y; `None` for a picture without such.
fn mean_step(layer: &Layer, distance: f32) -> Option<f64> {
    let row = |y: usize| {
        let (mut sum, mut count) = (0.0, 0u32);
        for x in 0..layer.width {
            let t = layer.texels[y * layer.width + x];
            for (x, y) in [(x as f32 + 0.5 + distance, y as f32 + 0.5), (x as f32 + 0.5, y as f32 + 0.5 + distance)] {
                if x < layer.width as f32
                    && y < layer.height as f32
                    && let Some(step) = step(t, layer.sharp(x, y))
                {
                    sum += step;
                    count += 1;
                }
            }
        }
        (sum, count)
    };
    // Added up in order, whatever the number of threads.
    let rows: Vec<(f64, u32)> = (0..layer.height).into_par_iter().map(row).collect();
    let (sum, count) = rows.iter().fold((0.0, 0), |(sum, count), row| (sum + row.0, count + row.1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Adds `amount` of each texel's difference from the mean of its 3×3 surroundings.
pub(super) fn strengthen(shaded: &mut [Option<Shaded>], size: usize, amount: f32) {
    let colors: Vec<Option<Vec3>> = shaded.iter().map(|s| s.as_ref().map(|s| s.color.truncate())).collect();
    shaded.par_iter_mut().enumerate().for_each(|(i, s)| {
        let Some(s) = s else { return };
        let (x, y) = (i % size, i / size);
        let rows = y.saturating_sub(1)..=(y + 1).min(size - 1);
        let around = rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(size - 1)).map(move |x| y * size + x));
        let (sum, count) = around.filter_map(|i| colors[i]).fold((Vec3::ZERO, 0.0), |(sum, n), c| (sum + c, n + 1.0));
        let color = s.color.truncate();
        let color = (color + amount * (color - sum / count)).clamp(Vec3::ZERO, Vec3::splat(255.0));
        s.color = color.extend(s.color.w);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grain_is_the_step_at_that_density() {
        let ramp = Layer::from_fn(32, 32, |x, y| Vec4::new((x + y) as f32, 0.0, 0.0, 1.0));
        let grain = Grain::of(&ramp);
        for distance in [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0] {
            assert!((grain.at(distance) - f64::from(distance)).abs() < 0.05 * f64::from(distance), "{distance}: {grain:?}");
        }
        let checker = Layer::from_fn(32, 32, |x, y| Vec4::new(if (x + y).is_multiple_of(2) { 100.0 } else { 0.0 }, 0.0, 0.0, 1.0));
        let grain = Grain::of(&checker);
        assert!((grain.at(1.0) - 100.0).abs() < 1e-6 && grain.at(2.0) < 0.01, "averaging a checker leaves nothing: {grain:?}");
        assert!(Grain::of(&Layer { width: 0, height: 0, texels: vec![] }).at(1.0) > 0.0);
    }

    #[test]
    fn strengthening_raises_steps_and_keeps_the_mean() {
        let texel = |i: usize| {
            let v = if (i + i / 16).is_multiple_of(2) { 120.0 } else { 80.0 };
            Shaded { color: Vec4::new(v, v, v, 1.0), ..Shaded::default() }
        };
        let mut shaded: Vec<Option<Shaded>> = (0..256).map(|i| Some(texel(i))).collect();
        strengthen(&mut shaded, 16, 0.5);
        let at = |i: usize| shaded[i].as_ref().map_or(0.0, |s| s.color.x);
        assert!((at(100) - at(101)).abs() > 55.0);
        let mean = (0..256).map(at).sum::<f32>() / 256.0;
        assert!((mean - 100.0).abs() < 0.5, "{mean}");
    }
}
