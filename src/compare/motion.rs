//! What moves: flicker on an orbit, popping on a dolly, each against what the truth itself does.

use image::RgbImage;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::metrics::{flip, over};
use crate::render::{Renderer, Tree};

use super::plan::{Sun, View};
use super::staging::{BACKGROUNDS, Stage};

/// How a method behaves in motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// FLIP from frame to frame on an orbit, over that of the truth: 1 flickers as the tree does, more flickers more.
    pub flicker: f64,
    /// Largest step of a dolly over the median of those around it: up to 2 nothing jumps.
    pub popping: f64,
}

/// Frames of the orbit, degrees of a step, and how high the tree is in it.
const ORBIT: (usize, f32, f32) = (12, 2.0, 96.0);
/// Frames of the dolly and the heights of the tree at its ends, pixels.
const DOLLY: (usize, f32, f32) = (60, 400.0, 10.0);

/// The orbit of a tree: frame by frame how much changes.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn orbit(renderer: &mut Renderer, stage: &Stage, tree: &Tree, sun: Sun) -> Result<f64> {
    let (frames, step_deg, height_px) = ORBIT;
    let view = |i: usize| View { azimuth_deg: 10.0 + step_deg * i as f32, elevation_deg: 12.0 };
    let (camera, side_px) = stage.camera(view(0), height_px);
    let pictures: Vec<RgbImage> = (0..frames)
        .map(|i| {
            // One window and angle for all frames.
            let mut shot = stage.shot(view(i), height_px, sun, None);
            (shot.size_px, shot.camera.projection) = ([side_px; 2], camera.projection);
            Ok(over(&stage.see(renderer, tree, &shot)?.color, BACKGROUNDS[0]))
        })
        .collect::<Result<_>>()?;
    let steps: Vec<f64> = pictures.par_windows(2).map(|pair| Ok(flip(&pair[0], &pair[1])?.mean)).collect::<Result<_>>()?;
    Ok(steps.iter().sum::<f64>() / steps.len() as f64)
}

/// A dolly away from a tree: its largest step over the median of those around it.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn dolly(renderer: &mut Renderer, stage: &Stage, tree: &Tree, sun: Sun) -> Result<f64> {
    let (frames, nearest_px, farthest_px) = DOLLY;
    let height_px = |i: usize| nearest_px * (farthest_px / nearest_px).powf(i as f32 / frames as f32);
    let view = View { azimuth_deg: 20.0, elevation_deg: 10.0 };
    let pictures: Vec<RgbImage> = (0..=frames)
        .map(|i| {
            let mut shot = stage.shot(view, height_px(i), sun, None);
            let side_px = 192;
            let fov_y_rad = 2.0 * (0.5 * side_px as f32 / crate::repr::REFERENCE_FOCAL_PX).atan();
            if let crate::render::Projection::Perspective { near_m, .. } = shot.camera.projection {
                shot.camera.projection = crate::render::Projection::Perspective { fov_y_rad, near_m };
            }
            shot.size_px = [side_px; 2];
            Ok(over(&stage.see(renderer, tree, &shot)?.color, BACKGROUNDS[0]))
        })
        .collect::<Result<_>>()?;
    let steps: Vec<f64> = pictures
        .par_windows(2)
        .enumerate()
        .map(|(i, pair)| Ok(flip(&pair[0], &pair[1])?.mean * 192.0 * 192.0 / f64::from(height_px(i).min(192.0)).powi(2)))
        .collect::<Result<_>>()?;
    Ok(largest_step(&steps))
}

/// The largest of `steps` over the median of the eleven around it, 0 of none: how much a walk through pictures jumps where it jumps most.
/// Steps are mean FLIP from picture to picture, per pixel of the tree; those under 0.01 count as that, since nobody sees them.
pub fn largest_step(steps: &[f64]) -> f64 {
    let ratio = |i: usize| {
        let mut around: Vec<f64> = steps[i.saturating_sub(5)..(i + 6).min(steps.len())].to_vec();
        around.sort_by(f64::total_cmp);
        steps[i] / around[around.len() / 2].max(0.01)
    };
    (0..steps.len()).map(ratio).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_jump_stands_out_and_a_slope_does_not() {
        let slope: Vec<f64> = (0..40).map(|i| 0.05 + 0.002 * f64::from(i)).collect();
        assert!(super::largest_step(&slope) < 1.3);
        let mut jump = slope.clone();
        jump[20] *= 3.0;
        assert!((super::largest_step(&jump) - 3.0).abs() < 0.2);
        assert_eq!(super::largest_step(&[]), 0.0);
    }
}
