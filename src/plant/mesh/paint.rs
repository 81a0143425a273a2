//! What the leaf and bark pictures are painted with: polygons drawn large and reduced, colours bled under alpha, noise that tiles.

use glam::{Vec2, Vec3, Vec4};
use image::{Rgba, RgbaImage};
use imageproc::drawing::draw_polygon_mut;
use imageproc::point::Point;

use crate::Seed;
use crate::raster::{to_linear, to_srgb};

/// Pictures are painted this many times larger each way, and reduced.
const OVERSIZE: u32 = 4;

/// A square canvas; coordinates are fractions of its side, x right, y down.
pub struct Canvas {
    large: RgbaImage,
}

impl Canvas {
    /// An empty canvas for a picture of `side_px`².
    pub fn new(side_px: u32) -> Self {
        Self { large: RgbaImage::new(side_px * OVERSIZE, side_px * OVERSIZE) }
    }

    /// Fills a polygon with a colour (sRGB, 0..=255).
    pub fn polygon(&mut self, corners: &[Vec2], color: Vec3) {
        let side = self.large.width() as f32;
        let mut points: Vec<Point<i32>> = corners
            .iter()
            .map(|p| (*p * side).round().clamp(Vec2::splat(-side), Vec2::splat(2.0 * side)))
            .map(|p| Point::new(p.x as i32, p.y as i32))
            .collect();
        points.dedup();
        // The library closes polygons itself and refuses closed ones.
        while points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        if points.len() > 2 {
            let [r, g, b] = color.to_array().map(|c| c.round().clamp(0.0, 255.0) as u8);
            draw_polygon_mut(&mut self.large, &points, Rgba([r, g, b, 255]));
        }
    }

    /// A straight stroke that narrows from `width.0` to `width.1`.
    pub fn stroke(&mut self, from: Vec2, to: Vec2, width: (f32, f32), color: Vec3) {
        let across = 0.5 * (to - from).normalize_or_zero().perp();
        self.polygon(&[from - width.0 * across, from + width.0 * across, to + width.1 * across, to - width.1 * across], color);
    }

    /// The picture in its own size: averaged in linear light, colours bled under alpha.
    pub fn finish(self) -> RgbaImage {
        let side = self.large.width() / OVERSIZE;
        let texel = |x: u32, y: u32| {
            let block =
                (0..OVERSIZE * OVERSIZE).map(|i| self.large.get_pixel(x * OVERSIZE + i % OVERSIZE, y * OVERSIZE + i / OVERSIZE));
            let sum: Vec4 =
                block.filter(|p| p[3] > 0).map(|p| Vec4::new(to_linear(p[0]), to_linear(p[1]), to_linear(p[2]), 1.0)).sum();
            (sum.truncate() / sum.w.max(1.0)).extend(sum.w / (OVERSIZE * OVERSIZE) as f32)
        };
        bled((0..side * side).map(|i| texel(i % side, i / side)).collect(), side)
    }
}

/// Gives texels without alpha the colour of their surroundings, so that no filter of any width draws a halo into the cut-out: every
/// halving averages by alpha, and every empty texel takes the colour of the one above it.
fn bled(texels: Vec<Vec4>, side: u32) -> RgbaImage {
    let mut levels = vec![(texels, side as usize)];
    while let Some((fine, n)) = levels.last().filter(|(_, n)| *n > 1) {
        let half = n.div_ceil(2);
        let coarse = (0..half * half).map(|i| {
            let (x, y) = (2 * (i % half), 2 * (i / half));
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| fine[y.min(n - 1) * n + x.min(n - 1)]);
            let alpha: f32 = four.iter().map(|t| t.w).sum();
            let color: Vec3 = four.iter().map(|t| t.w * t.truncate()).sum();
            (color / alpha.max(1e-6)).extend(alpha.min(1.0))
        });
        let coarse = coarse.collect();
        levels.push((coarse, half));
    }
    for level in (1..levels.len()).rev() {
        let (fine, coarse) = levels.split_at_mut(level);
        let (Some((fine, n)), (coarse, half)) = (fine.last_mut(), &coarse[0]) else { continue };
        for (i, texel) in fine.iter_mut().enumerate().filter(|(_, t)| t.w <= 0.0) {
            *texel = coarse[(i / *n / 2) * half + (i % *n) / 2].truncate().extend(0.0);
        }
    }
    let texels = &levels[0].0;
    RgbaImage::from_fn(side, side, |x, y| {
        let t = texels[(y * side + x) as usize];
        Rgba([to_srgb(t.x), to_srgb(t.y), to_srgb(t.z), (255.0 * t.w).round() as u8])
    })
}

/// Smooth noise in 0..=1 that repeats with period 1 in both directions: values on a grid of `columns` × `rows`, and finer octaves.
pub struct Noise {
    octaves: Vec<(usize, usize, Vec<f32>)>,
}

impl Noise {
    /// `count` octaves, each twice as fine as the one before and half as strong.
    pub fn new(seed: Seed, item: u64, columns: usize, rows: usize, count: usize) -> Self {
        let mut draws = seed.keyed("noise", item);
        let octave = |o: usize| {
            let (nx, ny) = (columns << o, rows << o);
            (nx, ny, (0..nx * ny).map(|_| draws.unit() as f32).collect())
        };
        Self { octaves: (0..count).map(octave).collect() }
    }

    /// The noise at a place.
    pub fn at(&self, at: Vec2) -> f32 {
        let (mut sum, mut weights, mut weight) = (0.0, 0.0, 1.0);
        for (nx, ny, values) in &self.octaves {
            let p = (at - at.floor()) * Vec2::new(*nx as f32, *ny as f32);
            let (cell, f) = (p.floor(), p.fract());
            let s = f * f * (3.0 - 2.0 * f);
            let value = |dx: usize, dy: usize| values[(cell.y as usize + dy) % ny * nx + (cell.x as usize + dx) % nx];
            let row = |dy| value(0, dy) + s.x * (value(1, dy) - value(0, dy));
            sum += weight * (row(0) + s.y * (row(1) - row(0)));
            weights += weight;
            weight *= 0.5;
        }
        sum / weights
    }
}

/// 0 below `from`, 1 above `to`, smooth between.
pub fn smoothstep(from: f32, to: f32, value: f32) -> f32 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
