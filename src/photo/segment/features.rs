//! What is known about each pixel of the reduced photograph before its neighbours are asked: colour, texture, sky, place, and how the
//! pixels of its kind are spread over the picture.

use rayon::prelude::*;

use super::palette::Palette;
use super::profile::{PROFILE, profile};
use super::sky::Sky;
use super::small::{Plane, Small};

/// Numbers per pixel of the first look.
pub const FIRST: usize = 26;
/// Numbers per pixel of the second look.
pub const SECOND: usize = 30 + PROFILE + 1;
/// Groups of the palette.
const GROUPS: usize = 24;

/// Everything derived from the reduced photograph that both looks use.
pub struct Scene {
    /// The reduced photograph.
    pub small: Small,
    /// Its sky.
    pub sky: Sky,
    /// Its palette.
    pub palette: Palette,
    /// Logarithm of the lightness' deviation in windows of 3, 7 and 15 pixels.
    pub texture: [Plane; 3],
    /// Share of sky in windows of 17 and 49 pixels.
    pub sky_share: [Plane; 2],
}

impl Scene {
    /// Analyses a reduced photograph.
    pub fn new(small: Small) -> Self {
        let sky = Sky::new(&small);
        let lightness: Plane = small.lab.iter().map(|c| c[0]).collect();
        let texture = [1, 3, 7].map(|r| small.deviation(&lightness, r).iter().map(|v| (v + 1.0).ln() - 2.0).collect::<Plane>());
        let described: Vec<[f32; 5]> = small
            .lab
            .iter()
            .zip(&texture[1])
            .zip(&texture[0])
            .map(|((c, t), f)| [0.6 * c[0], c[1], c[2], 9.0 * t, 4.0 * f])
            .collect();
        let palette = Palette::new(&described, GROUPS);
        let grown: Plane = sky.grown.iter().map(|&g| f32::from(u8::from(g))).collect();
        let sky_share = [8, 24].map(|r| small.mean(&grown, r));
        Self { small, sky, palette, texture, sky_share }
    }

    /// Column and row of a pixel, -1..1 and 0..1.
    fn place(&self, i: usize) -> (f32, f32) {
        let (x, y) = (i % self.small.width, i / self.small.width);
        ((x as f32 + 0.5) / self.small.width as f32 * 2.0 - 1.0, (y as f32 + 0.5) / self.small.height as f32)
    }

    /// The first look, `FIRST` numbers per pixel.
    pub fn first(&self) -> Vec<f32> {
        let w = self.small.width;
        let count = self.small.count();
        let sky = Open::new(self);
        let over = |value: &(dyn Fn(f32, f32) -> f32 + Sync)| -> Plane {
            (0..count)
                .map(|i| {
                    let (x, y) = self.place(i);
                    value(x, y)
                })
                .collect()
        };
        let spread = |value: &(dyn Fn(f32, f32) -> f32 + Sync)| self.palette.spread(&over(value), |_| 1.0);
        let central = spread(&|x, y| (-(x * x) * 2.5 - (y - 0.45) * (y - 0.45) * 10.0).exp());
        let height = spread(&|_, y| y);
        let aside = spread(&|x, _| f32::from(x.abs() > 0.85));
        let below = spread(&|_, y| f32::from(y > 0.9));
        let above = spread(&|_, y| f32::from(y < 0.1));
        let near_sky = self.palette.spread(&self.sky_share[0], |_| 1.0);
        let mut out = vec![0.0; count * FIRST];
        out.par_chunks_mut(FIRST).enumerate().for_each(|(i, f)| {
            let ([l, a, b], (x, y)) = (self.small.lab[i], self.place(i));
            let sides = (sky.left[i], sky.right[i]);
            f.copy_from_slice(&[
                l / 25.0 - 2.0,
                a / 20.0,
                b / 20.0,
                (a * a + b * b).sqrt() / 20.0 - 1.0,
                self.texture[0][i],
                self.texture[1][i],
                self.texture[2][i],
                self.sky.likeness[i],
                f32::from(u8::from(self.sky.grown[i])),
                self.sky_share[0][i],
                self.sky_share[1][i],
                x.abs(),
                y,
                x * x,
                y * y,
                sky.covered[i],
                sky.row[i / w],
                sides.0.min(sides.1),
                sides.0.max(sides.1),
                sky.horizon - y,
                4.0 * central[i] - 1.0,
                2.0 * height[i] - 1.0,
                4.0 * aside[i],
                4.0 * below[i],
                4.0 * above[i],
                4.0 * near_sky[i],
            ]);
        });
        out
    }

    /// Mean colour of what is believed to be crown.
    fn core(&self, belief: &[f32]) -> [f32; 3] {
        let weight = |b: f32| (b - 0.5).max(0.0) + 1e-6;
        let total: f32 = belief.iter().map(|&b| weight(b)).sum();
        [0, 1, 2].map(|c: usize| self.small.lab.iter().zip(belief).map(|(p, &b)| p[c] * weight(b)).sum::<f32>() / total)
    }

    /// Difference of chromaticity from the crown's core.
    fn unlike(&self, i: usize, core: [f32; 3]) -> f32 {
        let [_, a, b] = self.small.lab[i];
        ((a - core[1]).hypot(b - core[2]) / 15.0).min(3.0)
    }

    /// The second look, `SECOND` numbers per pixel, given the first look's log-odds.
    pub fn second(&self, logits: &[f32]) -> Vec<f32> {
        let w = self.small.width;
        let belief: Plane = logits.iter().map(|v| 1.0 / (1.0 + (-v).exp())).collect();
        let (near, far) = (self.small.mean(&belief, 3), self.small.mean(&belief, 12));
        let alike = self.palette.spread(&belief, |_| 1.0);
        let body = Body::new(&self.small, &near);
        let rays = body.rays(&self.small, &near);
        let sky = Open::new(self);
        let smooth_alike = self.small.mean(&alike, 2);
        let rows = body.rows(&self.small, &belief);
        let columns = body.columns(&self.small, &belief);
        let profile = profile(&self.small, &near, body.x, body.half_width);
        let core = self.core(&belief);
        let mut out = vec![0.0; self.small.count() * SECOND];
        out.par_chunks_mut(SECOND).enumerate().for_each(|(i, f)| {
            let ([l, a, b], (x, y)) = (self.small.lab[i], self.place(i));
            let (dx, dy) = body.relative((i % w) as f32, (i / w) as f32);
            let (lowest, mean) = rays[i];
            f[30..30 + PROFILE].copy_from_slice(&profile[i / w]);
            f[30 + PROFILE] = self.unlike(i, core);
            f[..30].copy_from_slice(&[
                logits[i].clamp(-6.0, 6.0) / 3.0,
                2.0 * near[i] - 1.0,
                2.0 * far[i] - 1.0,
                2.0 * alike[i] - 1.0,
                2.0 * lowest - 1.0,
                2.0 * mean - 1.0,
                dx.abs(),
                dy,
                dx * dx,
                dy * dy,
                l / 25.0 - 2.0,
                a / 20.0,
                b / 20.0,
                self.texture[0][i],
                self.texture[1][i],
                self.sky.likeness[i],
                f32::from(u8::from(self.sky.grown[i])),
                self.sky_share[0][i],
                x.abs(),
                y,
                sky.covered[i],
                sky.row[i / w],
                sky.horizon - y,
                sky.left[i].min(sky.right[i]),
                2.0 * smooth_alike[i] - 1.0,
                rows[i / w].0,
                rows[i / w].1,
                columns[i % w].0,
                columns[i % w].1,
                sky.left[i].max(sky.right[i]),
            ]);
        });
        out
    }
}

/// Where a pixel lies with respect to the open sky, all lengths as shares of the picture's.
struct Open {
    /// What is not sky above the pixel in its column.
    covered: Plane,
    /// Way to the next sky on the left, and on the right; 1 when there is none.
    left: Plane,
    right: Plane,
    /// Share of sky in each row.
    row: Plane,
    /// Where the sky ends: the row below which a twentieth of it lies.
    horizon: f32,
}

impl Open {
    fn new(scene: &Scene) -> Self {
        let (w, h, grown) = (scene.small.width, scene.small.height, &scene.sky.grown);
        let mut covered = vec![0.0; w * h];
        for i in w..w * h {
            covered[i] = covered[i - w] + f32::from(u8::from(!grown[i])) / h as f32;
        }
        let side = |order: &dyn Fn(usize) -> usize| {
            let mut way = vec![1.0; w * h];
            for y in 0..h {
                let mut last = 1.0f32;
                for x in 0..w {
                    let i = y * w + order(x);
                    last = if grown[i] { 0.0 } else { (last + 1.0 / w as f32).min(1.0) };
                    way[i] = last;
                }
            }
            way
        };
        let counts: Vec<usize> = (0..h).map(|y| grown[y * w..(y + 1) * w].iter().filter(|&&g| g).count()).collect();
        let total: usize = counts.iter().sum();
        let mut seen = 0;
        let horizon = counts.iter().position(|&c| {
            seen += c;
            20 * seen >= 19 * total
        });
        Self {
            covered,
            left: side(&|x| x),
            right: side(&|x| w - 1 - x),
            row: counts.iter().map(|&c| c as f32 / w as f32).collect(),
            horizon: if total == 0 { 0.0 } else { horizon.unwrap_or(0) as f32 / h as f32 },
        }
    }
}

/// The crown as the first look sees it: a centre and half axes.
struct Body {
    x: f32,
    y: f32,
    half_width: f32,
    half_height: f32,
}

impl Body {
    /// Moments of the belief, sharpened so that a thin haze over the whole picture does not count.
    fn new(small: &Small, belief: &[f32]) -> Self {
        let (mut n, mut x, mut y, mut xx, mut yy) = (1e-6, 0.0f64, 0.0, 0.0, 0.0);
        for (i, &b) in belief.iter().enumerate() {
            let (px, py) = ((i % small.width) as f64, (i / small.width) as f64);
            let weight = f64::from((b - 0.4).max(0.0));
            n += weight;
            x += weight * px;
            y += weight * py;
            xx += weight * px * px;
            yy += weight * py * py;
        }
        let (mx, my) = (x / n, y / n);
        // Half the width of a uniform ellipse is twice its standard deviation.
        let half = |square: f64, mean: f64| (2.0 * (square / n - mean * mean).max(0.0).sqrt()).max(8.0) as f32;
        Self { x: mx as f32, y: my as f32, half_width: half(xx, mx), half_height: half(yy, my) }
    }

    fn relative(&self, x: f32, y: f32) -> (f32, f32) {
        let reach = |v: f32| v.clamp(-3.0, 3.0);
        (reach((x - self.x) / self.half_width), reach((y - self.y) / self.half_height))
    }

    /// For each row, the mean belief across the crown's core, and the lowest such mean on the way from the centre's row.
    fn rows(&self, small: &Small, belief: &[f32]) -> Vec<(f32, f32)> {
        let (from, to) = span(self.x, 0.6 * self.half_width, small.width);
        let mean = |y: usize| belief[y * small.width + from..y * small.width + to].iter().sum::<f32>() / (to - from) as f32;
        lowest_from(self.y as usize, &(0..small.height).map(mean).collect::<Vec<_>>())
    }

    /// The same for columns.
    fn columns(&self, small: &Small, belief: &[f32]) -> Vec<(f32, f32)> {
        let (from, to) = span(self.y, 0.6 * self.half_height, small.height);
        let mean = |x: usize| (from..to).map(|y| belief[y * small.width + x]).sum::<f32>() / (to - from) as f32;
        lowest_from(self.x as usize, &(0..small.width).map(mean).collect::<Vec<_>>())
    }

    /// For each pixel, the lowest and the mean belief on the straight way from the centre.
    fn rays(&self, small: &Small, belief: &[f32]) -> Vec<(f32, f32)> {
        const STEPS: usize = 24;
        (0..small.count())
            .into_par_iter()
            .map(|i| {
                let (x, y) = ((i % small.width) as f32, (i / small.width) as f32);
                let (mut lowest, mut sum) = (1.0f32, 0.0);
                for k in 1..=STEPS {
                    let t = k as f32 / STEPS as f32;
                    let at = |from: f32, to: f32, n: usize| ((from + t * (to - from)).round().max(0.0) as usize).min(n - 1);
                    let b = belief[at(self.y, y, small.height) * small.width + at(self.x, x, small.width)];
                    lowest = lowest.min(b);
                    sum += b;
                }
                (lowest, sum / STEPS as f32)
            })
            .collect()
    }
}

/// The whole pixels within `reach` of `centre`, at least one.
fn span(centre: f32, reach: f32, n: usize) -> (usize, usize) {
    let from = ((centre - reach).max(0.0) as usize).min(n - 1);
    (from, ((centre + reach) as usize + 1).clamp(from + 1, n))
}

/// Each value with the lowest between it and the start, both averaged over five neighbours and scaled to -1..1.
fn lowest_from(start: usize, values: &[f32]) -> Vec<(f32, f32)> {
    let n = values.len();
    let smooth = |i: usize| {
        let window = &values[i.saturating_sub(2)..(i + 3).min(n)];
        2.0 * window.iter().sum::<f32>() / window.len() as f32 - 1.0
    };
    let start = start.min(n - 1);
    let mut out: Vec<(f32, f32)> = (0..n).map(|i| (smooth(i), smooth(i))).collect();
    for i in start + 1..n {
        out[i].1 = out[i].1.min(out[i - 1].1);
    }
    for i in (0..start).rev() {
        out[i].1 = out[i].1.min(out[i + 1].1);
    }
    out
}
