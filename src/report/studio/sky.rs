//! Fair-weather clouds: fractal noise on a level sheet, thick where it is high, bright towards the sun.

use glam::{Vec2, Vec3};

use crate::Seed;

/// Clouds of one sky.
#[derive(Debug, Clone)]
pub struct Clouds {
    /// Noise above this is cloud.
    threshold: f32,
    /// Along the sheet towards the sun, unit length or less.
    toward_sun: Vec2,
    /// Linear colours of what the sun lights and of the shaded base.
    lit: Vec3,
    base: Vec3,
    /// Where in the endless noise this sky lies.
    corner: Vec2,
    /// Share of the sky covered; none is computed where none is.
    cover: f32,
}

/// Octaves of the noise.
const OCTAVES: u32 = 6;
/// Size of the largest clouds as seen overhead: at slope 1, pictures show about two of them.
const SCALE: f32 = 1.5;
/// How low clouds are seen: below, haze has swallowed them.
const LOWEST: f32 = 0.015;
const CLEAR: f32 = 0.10;

impl Clouds {
    /// Clouds over that share of the sky, roughly, lit from `toward_sun`.
    pub fn new(cover: f32, toward_sun: Vec3, seed: Seed) -> Self {
        let sun = toward_sun.normalize_or(Vec3::Y);
        let low = (-7.0 * sun.y.max(0.0)).exp();
        let day = ((sun.y + 0.2) / 0.35).clamp(0.05, 1.0);
        let mut draws = seed.keyed("clouds", 0);
        Self {
            // The noise has mean 0.5 and lies within 0.2 to 0.8, mostly.
            threshold: 0.72 - 0.5 * cover,
            toward_sun: Vec2::new(sun.x, sun.z),
            lit: day * Vec3::new(0.93, 0.93, 0.93).lerp(Vec3::new(0.95, 0.72, 0.52), low),
            base: day * Vec3::new(0.52, 0.57, 0.64).lerp(Vec3::new(0.46, 0.42, 0.47), low),
            corner: 512.0 * Vec2::new(draws.unit() as f32, draws.unit() as f32),
            cover,
        }
    }

    /// Linear colour and opacity, 0..=1, along a unit ray.
    pub fn along(&self, ray: Vec3) -> (Vec3, f32) {
        if self.cover <= 0.0 || ray.y <= LOWEST {
            return (Vec3::ZERO, 0.0);
        }
        // A sheet that bends down with the earth, so that it does not shrink to nothing at the horizon.
        let at = self.corner + SCALE * Vec2::new(ray.x, ray.z) / (ray.y + 0.16);
        let thickness = |at: Vec2| self.noise(at) - self.threshold;
        let here = thickness(at);
        let opacity = smooth(here / 0.11) * (0.55 + 0.4 * smooth(here / 0.25));
        if opacity <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        // The side where the cloud thins out towards the sun is the lit one; thick middles show their base.
        let slope = here - thickness(at + 0.09 * self.toward_sun);
        let light = (0.75 + 3.2 * slope - 1.1 * (here - 0.06).max(0.0)).clamp(0.0, 1.0);
        (self.base.lerp(self.lit, light), opacity * smooth((ray.y - LOWEST) / (CLEAR - LOWEST)))
    }

    /// Fractal noise, 0..=1 with mean 0.5.
    fn noise(&self, at: Vec2) -> f32 {
        let (mut sum, mut share, mut all, mut p) = (0.0, 1.0, 0.0, at);
        for octave in 0..OCTAVES {
            sum += share * value_noise(p, octave);
            all += share;
            share *= 0.52;
            // Turned and stretched, so that the lattices never line up.
            p = 2.03 * Vec2::new(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y) + Vec2::splat(17.3);
        }
        sum / all
    }
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn value_noise(p: Vec2, octave: u32) -> f32 {
    let cell = p.floor();
    let t = (p - cell) * (p - cell) * (Vec2::splat(3.0) - 2.0 * (p - cell));
    let corner = |dx: i32, dy: i32| lattice(cell.x as i32 + dx, cell.y as i32 + dy, octave);
    let (low, high) = (lerp(corner(0, 0), corner(1, 0), t.x), lerp(corner(0, 1), corner(1, 1), t.x));
    lerp(low, high, t.y)
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}

/// A number in 0..1 for a point of the lattice.
fn lattice(x: i32, y: i32, octave: u32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77) ^ octave.wrapping_mul(0xC2B2_AE3D);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered(cover: f32) -> f32 {
        let clouds = Clouds::new(cover, Vec3::new(0.3, 0.7, 0.4), Seed(3));
        let rays = (0..60).flat_map(|x| (1..40).map(move |y| Vec3::new(x as f32 / 20.0 - 1.5, y as f32 / 30.0, -1.0).normalize()));
        let (sum, count) = rays.fold((0.0, 0), |(sum, count), ray| (sum + clouds.along(ray).1, count + 1));
        sum / count as f32
    }

    #[test]
    fn more_clouds_cover_more_and_none_cover_nothing() {
        let shares = [0.0, 0.2, 0.5, 0.9].map(covered);
        assert!(shares[0] == 0.0 && shares.is_sorted() && shares[1] < 0.3 && shares[3] > 0.5, "{shares:?}");
    }

    #[test]
    fn below_the_horizon_and_before_ridges_there_are_none() {
        let clouds = Clouds::new(1.0, Vec3::Y, Seed(1));
        assert!([-1.0, -0.1, 0.0, 0.01].iter().all(|&y| clouds.along(Vec3::new(0.0, y, -1.0).normalize()).1 == 0.0));
    }
}
