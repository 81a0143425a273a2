//! Sky seen through the crown (She fig. 5 shows such gaps; telling them from leaves is ours). Each pixel of the crown is a mixture of the
//! foliage and the sky around it; its sky share is measured in the colour direction in which foliage varies least, as in Bayesian
//! matting (Chuang et al. 2001): bright leaves are no sky, and a few blue pixels are.

use glam::{Mat3, Vec3};
use image::RgbImage;

use super::bits::Bits;
use super::features::Scene;
use super::sky::colour_table;
use super::small::Small;
use crate::raster::Mask;

/// Sky share from which a pixel is a gap.
const GAP_SHARE: f32 = 0.4;
/// Sky share that is a gap however much the foliage varies.
const SURE_SHARE: f32 = 0.8;
/// Standard deviations of foliage by which a gap differs from it at least: one leaf in a thousand does by chance.
const UNLIKE_LEAVES: f32 = 3.0;
/// Deviation of foliage colours, 8-bit levels, that is always assumed: noise and compression.
const NOISE: f32 = 9.0;
/// Part of the picture that open sky takes at least where it can tell of the sky behind the crown.
const LEAST_OPEN: f32 = 0.02;
/// Pixels of a side of the photograph that are looked at for statistics.
const SAMPLES: usize = 600;

/// The crown's pixels that show mostly sky (the crown is given both ways); none where no sky stands beside or above the crown.
pub fn find(image: &RgbImage, scene: &Scene, crown: &Bits, crown_mask: &Mask) -> Bits {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let none = || Bits::from_rows(width, height, |_, _| ());
    let small = &scene.small;
    let inside = Small::new_mask(crown_mask, small);
    let Some(Backdrop { colour: sky, chances, colours: sky_colours }) = Backdrop::of(scene, &inside) else { return none() };
    let mut is_sky = |p: [u8; 3], _: usize| sky_colours[five_bits(p)];
    let Some(first) = Leaves::of(image, small, &inside, &mut is_sky) else { return none() };
    let first = Cells::new(&first, &sky, &chances);
    // Once more with what is now known: mixed pixels would count as leaves of strange colours.
    let mut is_mixed =
        |p: [u8; 3], cell: usize| first.share(cell, p) > 0.5 * first.enough[cell].min(1.0) || sky_colours[five_bits(p)];
    let Some(leaves) = Leaves::of(image, small, &inside, &mut is_mixed) else { return none() };
    let cells = Cells::new(&leaves, &sky, &chances);
    let columns: Vec<usize> = (0..width).map(|x| x * small.width / width).collect();
    let (raw, spans) = (image.as_raw(), crown.spans());
    let like = Bits::from_rows(width, height, |y, row| {
        let Some((start, end)) = spans[y] else { return };
        let from = y * small.height / height * small.width;
        for (x, p) in (start..end).zip(raw[3 * (y * width + start)..].chunks_exact(3)) {
            let (cell, p) = (from + columns[x], [p[0], p[1], p[2]]);
            // A colour of the open sky needs no leaves to compare with, as in a willow that is mostly sky.
            let open_sky = sky_colours[five_bits(p)] && chances[y * small.height / height] > 0.4;
            row[x / 64] |= u64::from(open_sky || cells.share(cell, p) > cells.enough[cell]) << (x % 64);
        }
    });
    like.and(crown)
}

/// Index of a colour in [`colour_table`].
fn five_bits(p: [u8; 3]) -> usize {
    usize::from(p[0] >> 3) << 10 | usize::from(p[1] >> 3) << 5 | usize::from(p[2] >> 3)
}

fn vec3(p: [u8; 3]) -> Vec3 {
    Vec3::from(p.map(f32::from))
}

/// The colours of foliage: its local mean, and how it varies.
struct Leaves {
    mean: Vec<Vec3>,
    covariance: Mat3,
}

impl Leaves {
    /// From the crown's pixels that are not `other`; `None` when there are none.
    fn of(image: &RgbImage, small: &Small, crown: &[bool], other: &mut dyn FnMut([u8; 3], usize) -> bool) -> Option<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let step = (width.max(height) / SAMPLES).max(1);
        let mut sums = vec![(Vec3::ZERO, 0.0f32); small.count()];
        let mut samples = Vec::new();
        for y in (0..height).step_by(step) {
            for x in (0..width).step_by(step) {
                let cell = y * small.height / height * small.width + x * small.width / width;
                let p = image.get_pixel(x as u32, y as u32).0;
                if crown[cell] && !other(p, cell) {
                    sums[cell].0 += vec3(p);
                    sums[cell].1 += 1.0;
                    samples.push((cell, vec3(p)));
                }
            }
        }
        let mean = smooth(small, &sums)?;
        let mut covariance = Mat3::ZERO;
        for (cell, p) in &samples {
            let d = *p - mean[*cell];
            covariance += Mat3::from_cols(d * d.x, d * d.y, d * d.z);
        }
        let covariance = covariance * (1.0 / samples.len() as f32) + Mat3::from_diagonal(Vec3::splat(NOISE * NOISE));
        Some(Self { mean, covariance })
    }
}

/// The sky behind the crown.
struct Backdrop {
    /// Its colour around every cell.
    colour: Vec<Vec3>,
    /// What [`chances`] says of every row.
    chances: Vec<f32>,
    /// Which colours are its own, by [`five_bits`].
    colours: Vec<bool>,
}

impl Backdrop {
    /// The open sky beside the crown; where a crown that fills the frame leaves hardly any, what has a sky's colour, in the crown and
    /// beside it. `None` without either.
    fn of(scene: &Scene, crown: &[bool]) -> Option<Self> {
        let small = &scene.small;
        let open = |i: usize| scene.sky.grown[i] && !crown[i] && scene.sky.likeness[i] > 0.5;
        let is_open = (0..small.count()).filter(|&i| open(i)).count() as f32 > LEAST_OPEN * small.count() as f32;
        let by_colour = |i: usize| has_sky_colour(small.lab[i]);
        let sky: Vec<bool> = (0..small.count()).map(|i| if is_open { open(i) } else { by_colour(i) }).collect();
        let of = |(&sky, &rgb): (&bool, &[f32; 3])| if sky { (Vec3::from(rgb), 1.0) } else { (Vec3::ZERO, 0.0) };
        Some(Self {
            colour: smooth(small, &sky.iter().zip(&small.rgb).map(of).collect::<Vec<_>>())?,
            chances: chances(small, if is_open { &scene.sky.grown } else { &sky }, crown),
            colours: if is_open { scene.sky.colours() } else { colour_table(has_sky_colour) },
        })
    }
}

/// Whether a colour is a sky's rather than a leaf's whatever the picture: blue and not dark, or white. L*a*b*.
fn has_sky_colour([l, a, b]: [f32; 3]) -> bool {
    (l > 50.0 && b < -6.0 && a > b) || (l > 85.0 && a.hypot(b) < 10.0)
}

/// Local weighted means: of a small window where it holds enough, else of larger ones; `None` without any weight.
fn smooth(small: &Small, sums: &[(Vec3, f32)]) -> Option<Vec<Vec3>> {
    let total = sums.iter().fold((Vec3::ZERO, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if total.1 <= 0.0 {
        return None;
    }
    let overall = total.0 / total.1;
    let plane = |f: &dyn Fn(&(Vec3, f32)) -> f32| sums.iter().map(f).collect::<Vec<f32>>();
    let planes = [plane(&|s| s.0.x), plane(&|s| s.0.y), plane(&|s| s.0.z), plane(&|s| s.1)];
    let mut out = vec![overall; sums.len()];
    // Large windows first; each smaller one overrules in proportion to what it holds.
    for radius in [48, 16, 6] {
        let mean = planes.each_ref().map(|p| small.mean(p, radius));
        for (i, value) in out.iter_mut().enumerate() {
            let weight = mean[3][i].max(0.0);
            let prior = 0.05 * total.1 / sums.len() as f32 + 1e-6;
            *value = (Vec3::new(mean[0][i], mean[1][i], mean[2][i]) + prior * *value) / (weight + prior);
        }
    }
    Some(out)
}

/// For each row, how much of what stands beside the crown is sky, 0..1, rows above counting where the crown fills the row.
fn chances(small: &Small, sky: &[bool], crown: &[bool]) -> Vec<f32> {
    let (w, h) = (small.width, small.height);
    let mut chance = 1.0f32;
    let few = 0.04 * w as f32;
    (0..h)
        .map(|y| {
            let outside = (y * w..(y + 1) * w).filter(|&i| !crown[i]);
            let (sky, all) = outside.fold((0.0, 0.0), |(s, n), i| (s + f32::from(u8::from(sky[i])), n + 1.0));
            chance = (sky + few * chance) / (all + few);
            chance
        })
        .collect()
}

/// What decides in each cell of the reduced photograph.
struct Cells {
    /// Sky share of a colour p: `direction · p - offset`.
    direction: Vec<Vec3>,
    offset: Vec<f32>,
    /// Share that makes a gap.
    enough: Vec<f32>,
}

impl Cells {
    fn new(leaves: &Leaves, sky: &[Vec3], chances: &[f32]) -> Self {
        let inverse = leaves.covariance.inverse();
        let width = sky.len() / chances.len().max(1);
        let (mut direction, mut offset, mut enough) = (Vec::new(), Vec::new(), Vec::new());
        for (i, (&leaf, &sky)) in leaves.mean.iter().zip(sky).enumerate() {
            let apart = sky - leaf;
            let along = inverse * apart;
            let squared = apart.dot(along).max(1e-6);
            direction.push(along / squared);
            offset.push(along.dot(leaf) / squared);
            let chance = chances[i / width.max(1)];
            let noise = UNLIKE_LEAVES / squared.sqrt();
            enough.push(if chance < 0.05 {
                f32::INFINITY
            } else {
                noise.clamp(GAP_SHARE, SURE_SHARE) + 0.4 * (1.0 - chance).powi(2)
            });
        }
        Self { direction, offset, enough }
    }

    fn share(&self, cell: usize, p: [u8; 3]) -> f32 {
        self.direction[cell].dot(vec3(p)) - self.offset[cell]
    }
}
