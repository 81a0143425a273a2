//! The canvas: strokes with soft edges, a record of which pixels are leaf, and the noise that textures are made of.

use glam::{DVec2, DVec3};
use image::{Rgb, RgbImage};
use sphereboard::Seed;
use sphereboard::raster::Mask;

/// Height of the design, units.
const DESIGN_HEIGHT: f64 = 800.0;
/// Middle of the design, units.
const DESIGN_MIDDLE: f64 = 300.0;

/// sRGB, 0 to 255.
pub type Colour = DVec3;

/// A stroke in the shape of a leaf, in units of the design.
#[derive(Debug, Clone)]
pub struct Leaf {
    pub at: DVec2,
    /// Larger is nearer.
    pub depth: f64,
    /// Direction of its length, radians from +x towards +y.
    pub angle: f64,
    pub length: f64,
    pub width: f64,
    pub colour: Colour,
}

pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<Colour>,
    leaf: Vec<f64>,
    wood: Vec<f64>,
    /// Pixels per unit.
    scale: f64,
}

impl Canvas {
    pub fn new(width: u32, height: u32) -> Self {
        let count = width as usize * height as usize;
        let (pixels, leaf, wood) = (vec![Colour::ZERO; count], vec![0.0; count], vec![0.0; count]);
        Self { width, height, pixels, leaf, wood, scale: f64::from(height) / DESIGN_HEIGHT }
    }

    /// The middle of a pixel, in units.
    fn unit(&self, x: u32, y: u32) -> DVec2 {
        let x = (f64::from(x) + 0.5 - 0.5 * f64::from(self.width)) / self.scale + DESIGN_MIDDLE;
        DVec2::new(x, (f64::from(y) + 0.5) / self.scale)
    }

    /// Left and right edge, in units.
    pub fn edges(&self) -> (f64, f64) {
        let half = 0.5 * f64::from(self.width) / self.scale;
        (DESIGN_MIDDLE - half, DESIGN_MIDDLE + half)
    }

    /// Paints `colour(place)` with the opacity that it gives beside it.
    pub fn wash(&mut self, rows: std::ops::Range<f64>, colour: impl Fn(DVec2) -> (Colour, f64)) {
        for y in 0..self.height {
            for x in 0..self.width {
                let at = self.unit(x, y);
                if rows.contains(&at.y) {
                    let (colour, opacity) = colour(at);
                    self.blend(x, y, colour, opacity);
                }
            }
        }
    }

    /// Paints inside the box of half-size `reach` round `at`.
    fn dab(&mut self, at: DVec2, reach: DVec2, mut paint: impl FnMut(&mut Self, u32, u32, DVec2)) {
        let middle = DVec2::new((at.x - DESIGN_MIDDLE) * self.scale + 0.5 * f64::from(self.width), at.y * self.scale);
        let reach = reach * self.scale + 1.0;
        let span = |from: f64, to: f64, end: u32| from.floor().max(0.0) as u32..to.ceil().clamp(0.0, f64::from(end)) as u32;
        for y in span(middle.y - reach.y, middle.y + reach.y, self.height) {
            for x in span(middle.x - reach.x, middle.x + reach.x, self.width) {
                let from_middle = self.unit(x, y) - at;
                paint(self, x, y, from_middle);
            }
        }
    }

    /// An ellipse with soft edges.
    pub fn stroke(&mut self, at: DVec2, angle: f64, length: f64, width: f64, colour: Colour, opacity: f64) {
        self.ellipse(at, angle, length, width, |canvas, x, y, cover| canvas.blend(x, y, colour, cover * opacity));
    }

    /// A leaf: a stroke that the mask knows of.
    pub fn leaf(&mut self, leaf: &Leaf) {
        self.ellipse(leaf.at, leaf.angle, leaf.length, leaf.width, |canvas, x, y, cover| {
            canvas.blend(x, y, leaf.colour, 0.94 * cover);
            let seen = &mut canvas.leaf[y as usize * canvas.width as usize + x as usize];
            *seen = 1.0 - (1.0 - *seen) * (1.0 - cover);
        });
    }

    fn ellipse(&mut self, at: DVec2, angle: f64, length: f64, width: f64, mut paint: impl FnMut(&mut Self, u32, u32, f64)) {
        let along = DVec2::from_angle(angle);
        let half = 0.5 * DVec2::new(length, width);
        let softness = self.scale * half.min_element();
        self.dab(at, DVec2::splat(half.max_element()), |canvas, x, y, d| {
            let within = DVec2::new(d.dot(along), d.dot(along.perp())) / half;
            let cover = ((1.0 - within.length()) * softness + 0.5).clamp(0.0, 1.0);
            if cover > 0.0 {
                paint(canvas, x, y, cover);
            }
        });
    }

    /// A round limb from `a` to `b` with a radius at each end, ending at the `ground`; `colour(across, along)` with `across` from
    /// −1 (left edge, seen along the limb) to 1 and `along` in units from `a`.
    pub fn limb(&mut self, a: (DVec2, f64), b: (DVec2, f64), ground: f64, colour: impl Fn(f64, f64) -> Colour) {
        let axis = b.0 - a.0;
        let length = axis.length().max(1e-9);
        let along = axis / length;
        let reach = 0.5 * axis.abs() + a.1.max(b.1) + 1.0;
        self.dab(0.5 * (a.0 + b.0), reach, |canvas, x, y, d| {
            let from_a = d + 0.5 * axis;
            let t = from_a.dot(along).clamp(0.0, length);
            let radius = a.1 + (b.1 - a.1) * t / length;
            let beside = from_a - t * along;
            let cover = ((radius - beside.length()) * canvas.scale + 0.5).clamp(0.0, 1.0);
            if cover > 0.0 && canvas.unit(x, y).y < ground {
                let across = (beside.dot(along.perp()) / radius.max(1e-9)).clamp(-1.0, 1.0);
                canvas.blend(x, y, colour(-across, t), cover);
                // Wood hides the leaves behind it.
                let index = y as usize * canvas.width as usize + x as usize;
                canvas.leaf[index] *= 1.0 - cover;
                canvas.wood[index] = 1.0 - (1.0 - canvas.wood[index]) * (1.0 - cover);
            }
        });
    }

    fn blend(&mut self, x: u32, y: u32, colour: Colour, opacity: f64) {
        let pixel = &mut self.pixels[y as usize * self.width as usize + x as usize];
        *pixel = pixel.lerp(colour, opacity);
    }

    /// The pixels that are mostly leaf.
    pub fn leaf_mask(&self) -> Mask {
        Mask::from_fn(self.width, self.height, |x, y| self.leaf[y as usize * self.width as usize + x as usize] >= 0.5)
    }

    /// The pixels that are mostly leaf or wood, or a bit of both: everything through which one does not see the sky.
    pub fn solid_mask(&self) -> Mask {
        Mask::from_fn(self.width, self.height, |x, y| {
            let index = y as usize * self.width as usize + x as usize;
            (1.0 - self.leaf[index]) * (1.0 - self.wood[index]) < 0.5
        })
    }

    /// The picture as a camera would give it: a little darker in the corners, with a little noise.
    pub fn develop(&self, seed: Seed) -> RgbImage {
        let centre = 0.5 * DVec2::new(f64::from(self.width), f64::from(self.height));
        RgbImage::from_fn(self.width, self.height, |x, y| {
            let index = y as usize * self.width as usize + x as usize;
            let corner = (DVec2::new(f64::from(x), f64::from(y)) - centre).length_squared() / centre.length_squared();
            let mut draws = seed.keyed("sensor", index as u64);
            let lit = self.pixels[index] * (1.0 - 0.1 * corner) + 1.5 * draws.signed();
            Rgb(lit.to_array().map(|v| v.round().clamp(0.0, 255.0) as u8))
        })
    }
}

/// A colour by its bytes.
pub fn rgb(r: u8, g: u8, b: u8) -> Colour {
    Colour::new(f64::from(r), f64::from(g), f64::from(b))
}

/// 0 at `from`, 1 at `to`, smooth between and level outside.
pub fn smoothstep(from: f64, to: f64, value: f64) -> f64 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Value noise, 0 to 1, with features of about one unit of `at`.
pub fn noise(seed: Seed, stage: &str, at: DVec2) -> f64 {
    let cell = at.floor();
    let within = at - cell;
    let blend = within * within * (3.0 - 2.0 * within);
    let corner = |dx: f64, dy: f64| {
        let (x, y) = ((cell.x + dx) as i64 as u32, (cell.y + dy) as i64 as u32);
        seed.keyed(stage, u64::from(x) << 32 | u64::from(y)).unit()
    };
    let top = corner(0.0, 0.0) + (corner(1.0, 0.0) - corner(0.0, 0.0)) * blend.x;
    let bottom = corner(0.0, 1.0) + (corner(1.0, 1.0) - corner(0.0, 1.0)) * blend.x;
    top + (bottom - top) * blend.y
}

/// Noise of `octaves` sizes, each half of the one before, 0 to 1.
pub fn clouds(seed: Seed, stage: &str, at: DVec2, octaves: i32) -> f64 {
    let sum: f64 = (0..octaves).map(|o| noise(seed, stage, at * 2f64.powi(o) + 17.3 * f64::from(o)) * 0.5f64.powi(o)).sum();
    sum / (2.0 - 0.5f64.powi(octaves - 1))
}
