//! From samples to a photograph: clouds where the sky is, the mean of each pixel's light, a lens darker at its corners, film that holds
//! highlights, and grain.

use glam::{Vec2, Vec3};
use image::RgbImage;
use rayon::prelude::*;

use super::sky::Clouds;
use crate::Seed;
use crate::raster::{encoded, to_linear};
use crate::render::{Camera, Picture, Projection};

/// Share of the light that the corners lose.
const VIGNETTE: f32 = 0.16;

/// The picture, `samples` times smaller each way.
pub fn develop(scene: &Picture, camera: &Camera, samples: u32, clouds: &Clouds, grain: f32, seed: Seed) -> RgbImage {
    let (wide, high) = scene.color.dimensions();
    let (width, height) = (wide / samples, high / samples);
    let lens = Lens::new(camera, [width, height]);
    let mut image = RgbImage::new(width, height);
    image.par_chunks_exact_mut(3 * width.max(1) as usize).enumerate().for_each(|(y, row)| {
        let mut draws = seed.keyed("grain", y as u64);
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let (cloud, opacity) = clouds.along(lens.ray(at));
            let mut sum = Vec3::ZERO;
            for i in 0..samples * samples {
                let (x, y) = (x as u32 * samples + i % samples, y as u32 * samples + i / samples);
                let [r, g, b, _] = scene.color.get_pixel(x, y).0.map(to_linear);
                let light = Vec3::new(r, g, b);
                let is_sky = scene.depth_m[y as usize * wide as usize + x as usize].is_infinite();
                sum += if is_sky { light.lerp(cloud, opacity) } else { light };
            }
            let light = sum / (samples * samples) as f32 * lens.falloff(at);
            // Grey grain with a little colour in it, of about normal distribution.
            let mut normal = || (draws.signed() + draws.signed() + draws.signed()) as f32;
            let grey = normal();
            let noisy = toned(light)
                .to_array()
                .map(|level| level + grain * (0.85 * grey + 0.45 * normal()) * (0.6 + 0.4 * (level / 160.0).min(1.0)));
            pixel.copy_from_slice(&noisy.map(|level| level.round().clamp(0.0, 255.0) as u8));
        }
    });
    image
}

/// Linear light to levels of 0..=255: sRGB with a little more contrast in the middle, as cameras develop.
fn toned(light: Vec3) -> Vec3 {
    let level = |v: f32| {
        let s = encoded(v);
        255.0 * (s + 0.35 * s * (1.0 - s) * (s - 0.42))
    };
    Vec3::new(level(light.x), level(light.y), level(light.z))
}

/// Rays and darkening of a picture.
struct Lens {
    axes: [Vec3; 3],
    /// Slope of the picture's upper edge; 0 for a parallel projection.
    slope: f32,
    size_px: Vec2,
}

impl Lens {
    fn new(camera: &Camera, size_px: [u32; 2]) -> Self {
        let slope = match camera.projection {
            Projection::Perspective { fov_y_rad, .. } => (0.5 * fov_y_rad).tan(),
            Projection::Orthographic { .. } => 0.0,
        };
        Self { axes: camera.axes, slope, size_px: Vec2::new(size_px[0] as f32, size_px[1] as f32) }
    }

    /// The unit ray through a point of the picture.
    fn ray(&self, at: Vec2) -> Vec3 {
        let [right, up, backward] = self.axes;
        let p = (2.0 * at - self.size_px) / self.size_px.y * self.slope;
        (p.x * right - p.y * up - backward).normalize()
    }

    /// What is left of the light at a point of the picture.
    fn falloff(&self, at: Vec2) -> f32 {
        let from_middle = (2.0 * at - self.size_px).length() / self.size_px.length();
        1.0 - VIGNETTE * from_middle.powi(4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    fn plain(level: u8, samples: u32, grain: f32) -> RgbImage {
        let color = RgbaImage::from_pixel(40 * samples, 50 * samples, Rgba([level, level, level, 255]));
        let depth_m = vec![5.0; (2000 * samples * samples) as usize];
        let camera = Camera::orbit(Vec3::ZERO, 0.0, 0.0, 5.0);
        develop(&Picture { color, depth_m }, &camera, samples, &Clouds::new(0.5, Vec3::Y, Seed(1)), grain, Seed(1))
    }

    #[test]
    fn grain_is_as_strong_as_asked_and_the_tone_stays() {
        let (still, noisy) = (plain(120, 2, 0.0), plain(120, 2, 2.0));
        let apart: Vec<f64> = still.iter().zip(noisy.iter()).map(|(a, b)| f64::from(*a) - f64::from(*b)).collect();
        let deviation = (apart.iter().map(|d| d * d).sum::<f64>() / apart.len() as f64).sqrt();
        assert!((1.3..2.3).contains(&deviation), "{deviation}");
        assert!(still.get_pixel(20, 25)[0].abs_diff(120) <= 4, "{:?}", still.get_pixel(20, 25));
        assert_eq!(noisy, plain(120, 2, 2.0), "the same every time");
    }

    #[test]
    fn black_and_white_stay_and_brightness_never_turns_round() {
        let levels: Vec<f32> = (0..=100).map(|i| toned(Vec3::splat(i as f32 / 100.0)).x).collect();
        assert!(levels[0] == 0.0 && levels[100] > 254.0 && levels.is_sorted(), "{levels:?}");
    }
}
