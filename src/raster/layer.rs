//! A float image with a weight per texel: area averages, low-pass, hole filling and sharp resampling for everything that is baked.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::to_srgb;

/// Colour in `xyz` (which space is the owner's choice) and a weight or alpha in `w`, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width` × `height` texels.
    pub texels: Vec<Vec4>,
}

impl Layer {
    /// The layer of `texel(x, y)`, rows in parallel.
    pub fn from_fn(width: usize, height: usize, texel: impl Fn(usize, usize) -> Vec4 + Sync) -> Self {
        let mut texels = vec![Vec4::ZERO; width * height];
        texels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, t)| *t = texel(x, y));
        });
        Self { width, height, texels }
    }

    /// Area averages of a source picture: the rectangle from `origin` of `extent` source pixels becomes `width` × `height` texels.
    /// `source(x, y)` gives weighted colour and weight; so are the results.
    pub fn area_average(
        width: usize,
        height: usize,
        origin: [f64; 2],
        extent: [f64; 2],
        source: impl Fn(i64, i64) -> Vec4 + Sync,
    ) -> Self {
        let step = [extent[0] / width.max(1) as f64, extent[1] / height.max(1) as f64];
        Self::from_fn(width, height, |x, y| {
            let (left, top) = (origin[0] + x as f64 * step[0], origin[1] + y as f64 * step[1]);
            let (right, bottom) = (left + step[0], top + step[1]);
            let mut sum = Vec4::ZERO;
            for sy in top.floor() as i64..bottom.ceil() as i64 {
                let tall = bottom.min(sy as f64 + 1.0) - top.max(sy as f64);
                for sx in left.floor() as i64..right.ceil() as i64 {
                    let wide = right.min(sx as f64 + 1.0) - left.max(sx as f64);
                    sum += (tall * wide) as f32 * source(sx, sy);
                }
            }
            sum / (step[0] * step[1]) as f32
        })
    }

    /// Weighted linear colours as straight encoded sRGB 0..=255. A third of the full weight already counts fully, so that
    /// [`Layer::bleed`] changes nothing that was measured well.
    pub fn straightened(mut self) -> Self {
        self.texels.par_iter_mut().for_each(|t| {
            let color = if t.w > 1e-4 { t.truncate() / t.w } else { Vec3::ZERO };
            *t = Vec3::from(color.to_array().map(|v| f32::from(to_srgb(v)))).extend((3.0 * t.w).min(1.0));
        });
        self
    }

    /// Scales the channels, encoded sRGB 0..=255, until their mean under `weights` is `target`; a few rounds, since bright texels clip.
    pub fn shift_mean(&mut self, weights: &[f32], target: Vec3) {
        for _ in 0..4 {
            let sum: Vec4 = self.texels.iter().zip(weights).map(|(t, &w)| (w * t.truncate()).extend(w)).sum();
            if sum.w <= 0.0 {
                return;
            }
            let gain = (target / (sum.truncate() / sum.w).max(Vec3::ONE)).clamp(Vec3::splat(0.25), Vec3::splat(4.0));
            for t in &mut self.texels {
                *t = (gain * t.truncate()).min(Vec3::splat(255.0)).extend(t.w);
            }
        }
    }

    /// The texel at mirrored coordinates: the layer continues as its own reflection.
    pub fn mirrored(&self, x: i64, y: i64) -> Vec4 {
        let fold = |i: i64, n: usize| {
            let i = i.rem_euclid(2 * n as i64) as usize;
            if i < n { i } else { 2 * n - 1 - i }
        };
        self.texels[fold(y, self.height) * self.width + fold(x, self.width)]
    }

    /// Bilinear value at texel coordinates (texel centres at +0.5), mirrored outside.
    pub fn bilinear(&self, x: f32, y: f32) -> Vec4 {
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (floor(x), floor(y));
        let at = |dx, dy| self.mirrored(x0 as i64 + dx, y0 as i64 + dy);
        at(0, 0).lerp(at(1, 0), x - x0).lerp(at(0, 1).lerp(at(1, 1), x - x0), y - y0)
    }

    /// Catmull-Rom value at texel coordinates (texel centres at +0.5), mirrored outside: keeps the contrast bilinear weights lose.
    pub fn sharp(&self, x: f32, y: f32) -> Vec4 {
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (floor(x), floor(y));
        let (wx, wy) = (catmull_rom(x - x0), catmull_rom(y - y0));
        let (x0, y0) = (x0 as i64, y0 as i64);
        let inside = x0 >= 1 && y0 >= 1 && x0 + 2 < self.width as i64 && y0 + 2 < self.height as i64;
        let mut sum = Vec4::ZERO;
        for (j, wy) in wy.iter().enumerate() {
            let row = if inside {
                let start = (y0 as usize + j - 1) * self.width + x0 as usize - 1;
                wx.iter().zip(&self.texels[start..start + 4]).map(|(w, t)| *w * *t).sum::<Vec4>()
            } else {
                wx.iter().enumerate().map(|(i, w)| *w * self.mirrored(x0 + i as i64 - 1, y0 + j as i64 - 1)).sum()
            };
            sum += *wy * row;
        }
        sum
    }

    /// Adds `amount` of each colour's difference from the mean of its 3×3 surroundings; weights stay.
    pub fn sharpened(&self, amount: f32) -> Self {
        Self::from_fn(self.width, self.height, |x, y| {
            let around = (0..9).map(|i| self.mirrored(x as i64 + i % 3 - 1, y as i64 + i / 3 - 1)).sum::<Vec4>() / 9.0;
            let t = self.texels[y * self.width + x];
            (t + amount * (t - around)).truncate().extend(t.w)
        })
    }

    /// Three box filters of half-width `radius` in each direction: close to a Gaussian. Beyond the border nothing has weight.
    pub fn low_pass(&self, radius: usize) -> Self {
        let mut layer = self.clone();
        for _ in 0..3 {
            layer = layer.box_rows(radius).transposed();
            layer = layer.box_rows(radius).transposed();
        }
        layer
    }

    fn transposed(&self) -> Self {
        Self::from_fn(self.height, self.width, |x, y| self.texels[x * self.width + y])
    }

    fn box_rows(&self, radius: usize) -> Self {
        let mut out = self.clone();
        if self.width == 0 {
            return out;
        }
        out.texels.par_chunks_mut(self.width).zip(self.texels.par_chunks(self.width)).for_each(|(out, row)| {
            let mut sum: glam::DVec4 = row.iter().take(radius).map(|t| t.as_dvec4()).sum();
            for (x, out) in out.iter_mut().enumerate() {
                sum += row.get(x + radius).map_or(glam::DVec4::ZERO, |t| t.as_dvec4());
                *out = (sum / (2 * radius + 1) as f64).as_vec4();
                sum -= x.checked_sub(radius).map_or(glam::DVec4::ZERO, |i| row[i].as_dvec4());
            }
        });
        out
    }

    /// Colours for texels of weight 0 from their surroundings (push-pull, Gortler et al. 1996 §3.4); weights stay as they are, and
    /// a texel of weight below 1 keeps its share. A layer without any weight stays as it is.
    pub fn bleed(&mut self) {
        if self.texels.iter().all(|t| t.w >= 1.0) || self.texels.iter().all(|t| t.w <= 0.0) {
            return;
        }
        let mut pulled = self.clone();
        pulled.pull();
        self.texels.par_iter_mut().zip(&pulled.texels).for_each(|(t, p)| *t = p.truncate().extend(t.w));
    }

    /// Blends every texel with the coarser level in proportion to the weight it lacks.
    fn pull(&mut self) {
        if self.width * self.height <= 1 {
            return;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut coarse = Self::from_fn(width, height, |x, y| {
            let mut sum = Vec4::ZERO;
            for (x, y) in [(2 * x, 2 * y), (2 * x + 1, 2 * y), (2 * x, 2 * y + 1), (2 * x + 1, 2 * y + 1)] {
                if x < self.width && y < self.height {
                    let t = self.texels[y * self.width + x];
                    let w = t.w.clamp(0.0, 1.0);
                    sum += (w * t.truncate()).extend(w);
                }
            }
            if sum.w > 0.0 { (sum.truncate() / sum.w).extend(sum.w.min(1.0)) } else { Vec4::ZERO }
        });
        coarse.pull();
        let w = self.width;
        self.texels.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (x, t) in row.iter_mut().enumerate() {
                let share = t.w.clamp(0.0, 1.0);
                if share < 1.0 {
                    let below = coarse.bilinear(0.5 * (x as f32 + 0.5), 0.5 * (y as f32 + 0.5));
                    *t = below.truncate().lerp(t.truncate(), share).extend(1.0);
                }
            }
        });
    }
}

/// Like `f32::floor` for whatever an `i32` holds, without a call where the processor has no instruction for it.
pub(super) fn floor(v: f32) -> f32 {
    let t = v as i32 as f32;
    if t > v { t - 1.0 } else { t }
}

fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (-t + 2.0 * t2 - t3), 0.5 * (2.0 - 5.0 * t2 + 3.0 * t3), 0.5 * (t + 4.0 * t2 - 3.0 * t3), 0.5 * (t3 - t2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_average_keeps_the_total() {
        let source = |x: i64, y: i64| Vec4::splat(((x * 7 + y * 3) % 11) as f32);
        let total: f32 = (0..9).flat_map(|y| (0..10).map(move |x| source(x, y).x)).sum();
        for (width, height) in [(10, 9), (4, 3), (3, 7), (1, 1)] {
            let layer = Layer::area_average(width, height, [0.0, 0.0], [10.0, 9.0], source);
            let mean = layer.texels.iter().map(|t| t.x).sum::<f32>() / (width * height) as f32;
            assert!((mean - total / 90.0).abs() < 1e-4, "{width}×{height}: {mean}");
        }
    }

    #[test]
    fn both_samplers_reproduce_texels_at_their_centres() {
        let layer = Layer::from_fn(5, 4, |x, y| Vec4::splat((x * x + 3 * y) as f32));
        for (x, y) in [(0, 0), (2, 1), (4, 3)] {
            let (fx, fy) = (x as f32 + 0.5, y as f32 + 0.5);
            assert!((layer.bilinear(fx, fy) - layer.texels[y * 5 + x]).length() < 1e-5);
            assert!((layer.sharp(fx, fy) - layer.texels[y * 5 + x]).length() < 1e-5);
        }
    }

    #[test]
    fn bled_colours_come_from_the_nearest_weighted_texels() {
        let mut layer = Layer::from_fn(33, 17, |x, _| {
            if x < 3 {
                Vec4::new(1.0, 0.0, 0.0, 1.0)
            } else if x > 29 {
                Vec4::W + Vec4::Y
            } else {
                Vec4::ZERO
            }
        });
        layer.bleed();
        let at = |x: usize| layer.texels[8 * 33 + x];
        assert_eq!((at(0).w, at(15).w), (1.0, 0.0));
        assert!(at(5).x > 0.8 && at(27).y > 0.8 && at(15).x + at(15).y > 0.9);
        let mut empty = Layer::from_fn(3, 3, |_, _| Vec4::ZERO);
        empty.bleed();
        assert!(empty.texels.iter().all(|t| *t == Vec4::ZERO));
    }

    #[test]
    fn a_low_pass_keeps_the_mean_inside_and_spreads() {
        let layer = Layer::from_fn(41, 41, |x, y| if (x, y) == (20, 20) { Vec4::ONE } else { Vec4::ZERO });
        let soft = layer.low_pass(3);
        assert!((soft.texels.iter().map(|t| t.x).sum::<f32>() - 1.0).abs() < 1e-3);
        assert!(soft.texels[20 * 41 + 20].x < 0.05 && soft.texels[20 * 41 + 26].x > 0.0);
    }
}
