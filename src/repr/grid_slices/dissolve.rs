//! Noise in the alpha of a slice, so that it dissolves when the cutoff of its alpha test rises (Truelsen §7.4.2: noise in the shader
//! "showed some visual improvements", and "a proper implementation of this feature would be to apply the alpha noise to the texture at
//! creation time"; §9.2).

use image::RgbaImage;

use crate::Seed;
use crate::raster::ALPHA_CUTOFF;

/// Grains of noise along the longer side of a picture: at the distances where slices go, a grain is about a pixel or two.
const GRAINS: f32 = 64.0;

/// How much finer noise counts beside the grains, to break up their shapes.
const FINE: f64 = 0.35;

/// Gives every texel that is there an alpha between the cutoff and 1 by noise, all of them equally often: raising the cutoff half-way
/// takes half of them. What is not there keeps its alpha, so that nothing changes while the slice is seen in full.
pub fn bake(picture: &mut RgbaImage, seed: Seed, slice: u64) {
    let least = (255.0 * ALPHA_CUTOFF).ceil() as u8;
    let (width, height) = picture.dimensions();
    let noise = Noise::new(width.max(height), seed, slice);
    let there = |at: &u32| picture.get_pixel(at % width, at / width).0[3] >= least;
    let mut texels: Vec<(f64, u32)> = (0..width * height).filter(there).map(|at| (noise.at(at % width, at / width), at)).collect();
    texels.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let levels = f64::from(256 - u32::from(least));
    let count = texels.len() as f64;
    for (rank, (_, at)) in texels.into_iter().enumerate() {
        let alpha = f64::from(least) + (rank as f64 / count * levels).floor();
        picture.get_pixel_mut(at % width, at / width).0[3] = alpha as u8;
    }
}

/// Values at the corners of square grains, smooth between, and finer noise on them.
struct Noise {
    corners: Vec<f64>,
    across: usize,
    texels_per_grain: f32,
    seed: Seed,
    slice: u64,
}

impl Noise {
    fn new(longest_px: u32, seed: Seed, slice: u64) -> Self {
        let across = GRAINS as usize + 2;
        let mut draws = seed.keyed("grid-slices grains", slice);
        let corners = (0..across * across).map(|_| draws.unit()).collect();
        Self { corners, across, texels_per_grain: (longest_px as f32 / GRAINS).max(1.0), seed, slice }
    }

    fn at(&self, x: u32, y: u32) -> f64 {
        let place = |k: u32| {
            let along = (k as f32 + 0.5) / self.texels_per_grain;
            let part = f64::from(along.fract());
            (along as usize, part * part * (3.0 - 2.0 * part))
        };
        let ((i, u), (j, v)) = (place(x), place(y));
        let corner = |i: usize, j: usize| self.corners[j.min(self.across - 1) * self.across + i.min(self.across - 1)];
        let row = |j: usize| corner(i, j) + u * (corner(i + 1, j) - corner(i, j));
        let fine = self.seed.keyed("grid-slices fine", self.slice << 32 | u64::from(y) << 16 | u64::from(x)).unit();
        row(j) + v * (row(j + 1) - row(j)) + FINE * fine
    }
}
