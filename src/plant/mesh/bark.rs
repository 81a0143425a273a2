//! Bark: pictures that tile, made from noise. Ours: none is photographed, so that every one may be passed on.

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use rayon::prelude::*;

use super::paint::{Noise, smoothstep};
use crate::{Seed, choices};

choices! {
    /// What the bark of a grown tree looks like.
    pub enum BarkKind {
        /// Grey-brown with long furrows: oak, lime, willow.
        Furrowed = "furrowed",
        /// White with dark scars across: birch.
        White = "white",
        /// Orange-brown plates: pine.
        Plated = "plated",
        /// Grey and almost even: spruce, beech.
        Smooth = "smooth",
        /// Red-brown in long strips: juniper, yew.
        Stringy = "stringy",
    }
}

/// Side of the picture.
const SIDE_PX: u32 = 512;

/// The picture of a bark: opaque, and it tiles.
pub fn picture(kind: BarkKind, seed: Seed) -> RgbaImage {
    let noises = Noises::new(seed);
    let color: fn(&Noises, Vec2) -> Vec3 = match kind {
        BarkKind::Furrowed => furrowed,
        BarkKind::White => white,
        BarkKind::Plated => plated,
        BarkKind::Smooth => smooth,
        BarkKind::Stringy => stringy,
    };
    let texels: Vec<Vec3> = (0..SIDE_PX * SIDE_PX)
        .into_par_iter()
        .map(|i| color(&noises, (Vec2::new((i % SIDE_PX) as f32, (i / SIDE_PX) as f32) + 0.5) / SIDE_PX as f32))
        .collect();
    RgbaImage::from_fn(SIDE_PX, SIDE_PX, |x, y| {
        let [r, g, b] = texels[(y * SIDE_PX + x) as usize].to_array().map(|c| c.round().clamp(0.0, 255.0) as u8);
        Rgba([r, g, b, 255])
    })
}

/// The noises that every bark is mixed from.
struct Noises {
    warp: [Noise; 2],
    long: Noise,
    furrows: Noise,
    across: Noise,
    round: Noise,
    grain: Noise,
    blots: Noise,
}

impl Noises {
    fn new(seed: Seed) -> Self {
        let noise = |item, columns, rows, octaves| Noise::new(seed, item, columns, rows, octaves);
        Self {
            warp: [noise(0, 4, 4, 3), noise(1, 4, 4, 3)],
            long: noise(2, 12, 3, 4),
            furrows: noise(7, 20, 4, 2),
            across: noise(3, 3, 40, 2),
            round: noise(4, 6, 5, 4),
            grain: noise(5, 64, 64, 2),
            blots: noise(6, 5, 7, 2),
        }
    }

    /// The place shifted by up to half of `amount`.
    fn warped(&self, at: Vec2, amount: Vec2) -> Vec2 {
        at + amount * (Vec2::new(self.warp[0].at(at), self.warp[1].at(at)) - 0.5)
    }
}

/// 0 in the cracks that run where the noise crosses its middle, 1 on the ridges between.
fn ridge(noise: f32, width: f32) -> f32 {
    smoothstep(0.0, width, (noise - 0.5).abs())
}

fn furrowed(n: &Noises, at: Vec2) -> Vec3 {
    let p = n.warped(at, Vec2::new(0.1, 0.08));
    let ridges = ridge(n.furrows.at(p), 0.09).min(0.35 + 0.65 * ridge(n.furrows.at(p * Vec2::new(2.0, 1.0) + 0.31), 0.08));
    let tone = 0.65 * ridges + 0.2 * n.grain.at(at) + 0.25 * n.round.at(at);
    Vec3::new(50.0, 43.0, 36.0).lerp(Vec3::new(148.0, 134.0, 116.0), tone)
}

fn plated(n: &Noises, at: Vec2) -> Vec3 {
    let p = n.warped(at, Vec2::splat(0.1));
    let plates = ridge(n.round.at(p), 0.09).min(ridge(n.long.at(p + 0.37), 0.07));
    let tone = 0.75 * plates + 0.3 * n.grain.at(at) * n.warp[0].at(at);
    Vec3::new(62.0, 40.0, 28.0).lerp(Vec3::new(186.0, 128.0, 88.0), tone)
}

fn smooth(n: &Noises, at: Vec2) -> Vec3 {
    let tone = 0.45 * n.round.at(n.warped(at, Vec2::splat(0.2))) + 0.3 * n.across.at(at) + 0.3 * n.grain.at(at);
    Vec3::new(82.0, 76.0, 68.0).lerp(Vec3::new(150.0, 142.0, 130.0), tone)
}

fn stringy(n: &Noises, at: Vec2) -> Vec3 {
    let p = n.warped(at, Vec2::new(0.06, 0.0)) * Vec2::new(2.0, 1.0);
    let tone = 0.6 * ridge(n.long.at(p), 0.14) + 0.25 * n.long.at(2.0 * p) + 0.2 * n.grain.at(at);
    Vec3::new(54.0, 39.0, 32.0).lerp(Vec3::new(134.0, 104.0, 86.0), tone)
}

fn white(n: &Noises, at: Vec2) -> Vec3 {
    let paper = Vec3::new(206.0, 201.0, 192.0).lerp(Vec3::new(240.0, 238.0, 232.0), n.round.at(at));
    // Lenticels: thin, across; and the dark diamonds where branches were.
    let scars = smoothstep(0.70, 0.80, n.across.at(n.warped(at, Vec2::new(0.3, 0.02))));
    let diamonds = smoothstep(0.70, 0.78, n.blots.at(n.warped(at, Vec2::new(0.15, 0.1))) + 0.08 * n.grain.at(at));
    paper.lerp(Vec3::new(58.0, 52.0, 48.0), (0.75 * scars).max(0.9 * diamonds)) * (0.94 + 0.08 * n.grain.at(at))
}
