//! What moves: flicker on a walk round the tree, popping on a walk away from it, each against what the truth itself does.

use image::{RgbImage, RgbaImage, imageops};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::metrics::{flip, over};
use crate::render::{Projection, Renderer, Shot, Tree};
use crate::repr::{BuiltTree, Drawn, REFERENCE_FOCAL_PX};

use super::plan::{MotionPlan, Plan, View};
use super::staging::{BACKGROUNDS, Stage};

/// How a method behaves in motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// FLIP from frame to frame on an orbit, over that of the truth: 1 flickers as the tree does, more flickers more.
    pub flicker: f64,
    /// Largest step of a dolly over the median of those around it: up to 2 nothing jumps. `None` where nothing changes with distance, so that
    /// nothing can.
    pub popping: Option<f64>,
    /// How many pixels high the tree is at that step.
    pub largest_at_px: Option<f32>,
}

/// Names of the strips among a method's pictures.
pub const STRIPS: [&str; 2] = ["orbit.png", "dolly.png"];

/// How high the tree is on the orbit, and the side of the dolly's pictures, pixels.
const ORBIT_PX: f32 = 96.0;
const DOLLY_SIDE_PX: u32 = 192;
/// Pictures of a strip, and how high they are, pixels.
const OF_STRIP: usize = 6;
const STRIP_PX: u32 = 128;

/// Walks round a stand-in and away from it; gives what was measured, and strips of frames by name: of the orbit from its begin to its end,
/// of the dolly around its largest step.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn measure(
    renderer: &mut Renderer,
    stage: &Stage,
    (built, tree): (&BuiltTree, &Tree),
    plan: &Plan,
    truth_flicker: f64,
) -> Result<(Motion, Vec<(&'static str, RgbaImage)>)> {
    let round = orbit(renderer, stage, tree, plan)?;
    let flicker = mean_step(&round)?;
    let still = Motion { flicker: if truth_flicker > 0.0 { flicker / truth_flicker } else { 1.0 }, ..Motion::default() };
    let spread = |i: usize| i * (round.len() - 1) / (OF_STRIP - 1).max(1);
    let orbit_strip = (STRIPS[0], strip(&(0..OF_STRIP).map(|i| &round[spread(i)]).collect::<Vec<_>>()));
    if !changes_with_distance(built) {
        return Ok((still, vec![orbit_strip]));
    }
    let away = dolly(renderer, stage, tree, plan)?;
    let steps = dolly_steps(&away, plan.motion)?;
    let (largest, popping) = largest(&steps);
    // The step from frame `largest` to the next lies in the middle.
    let first = (largest + 1).saturating_sub(OF_STRIP / 2).min(away.len().saturating_sub(OF_STRIP));
    // Only what the tree takes of the pictures, or far trees would be dots in them.
    let side_px = ((1.4 * height_px(plan.motion, first)) as u32).clamp(8, DOLLY_SIDE_PX);
    let corner = (DOLLY_SIDE_PX - side_px) / 2;
    let part = |frame: &RgbImage| imageops::crop_imm(frame, corner, corner, side_px, side_px).to_image();
    let around: Vec<RgbImage> = away.iter().skip(first).take(OF_STRIP).map(part).collect();
    let motion = Motion { popping: Some(popping), largest_at_px: Some(height_px(plan.motion, largest)), ..still };
    Ok((motion, vec![orbit_strip, (STRIPS[1], strip(&around.iter().collect::<Vec<_>>()))]))
}

/// Whether anything appears, vanishes or thins out between one distance and another.
fn changes_with_distance(built: &BuiltTree) -> bool {
    built.parts.iter().any(|part| {
        let always = part.seen.appears[1] <= 0.0 && part.seen.vanishes[0] >= f32::MAX;
        !always || matches!(part.drawn, Drawn::Forest(_))
    })
}

/// The frames of a walk round the tree.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn orbit(renderer: &mut Renderer, stage: &Stage, tree: &Tree, plan: &Plan) -> Result<Vec<RgbImage>> {
    let view = |i: usize| View { azimuth_deg: 10.0 + MotionPlan::ORBIT_STEP_DEG * i as f32, elevation_deg: 12.0 };
    let (camera, side_px) = stage.camera(view(0), ORBIT_PX);
    let frame = |i: usize| {
        // One window and angle for all frames.
        let mut shot = stage.shot(view(i), ORBIT_PX, plan.suns[0], None);
        (shot.size_px, shot.camera.projection) = ([side_px; 2], camera.projection);
        Ok(over(&stage.see(renderer, tree, &shot)?.color, BACKGROUNDS[0]))
    };
    (0..plan.motion.orbit_frames.max(2)).map(frame).collect()
}

/// The mean FLIP from frame to frame.
///
/// # Errors
/// [`UnlikeSizes`](crate::Error::UnlikeSizes).
pub fn mean_step(frames: &[RgbImage]) -> Result<f64> {
    let steps: Vec<f64> = frames.par_windows(2).map(|pair| Ok(flip(&pair[0], &pair[1])?.mean)).collect::<Result<_>>()?;
    Ok(steps.iter().sum::<f64>() / steps.len().max(1) as f64)
}

/// How many pixels high the tree is in a frame of the dolly.
fn height_px(motion: MotionPlan, frame: usize) -> f32 {
    let [first, last] = motion.dolly_px;
    first * (last / first).powf(frame as f32 / motion.dolly_frames.max(1) as f32)
}

/// The frames of a walk away from the tree. The nearest show a part of it.
fn dolly(renderer: &mut Renderer, stage: &Stage, tree: &Tree, plan: &Plan) -> Result<Vec<RgbImage>> {
    let view = View { azimuth_deg: 20.0, elevation_deg: 10.0 };
    let frame = |i: usize| {
        let shot = stage.shot(view, height_px(plan.motion, i), plan.suns[0], None);
        let fov_y_rad = 2.0 * (0.5 * DOLLY_SIDE_PX as f32 / REFERENCE_FOCAL_PX).atan();
        let camera = match shot.camera.projection {
            Projection::Perspective { near_m, .. } => {
                crate::render::Camera { projection: Projection::Perspective { fov_y_rad, near_m }, ..shot.camera }
            }
            Projection::Orthographic { .. } => shot.camera,
        };
        let shot = Shot { camera, size_px: [DOLLY_SIDE_PX; 2], ..shot };
        Ok(over(&stage.see(renderer, tree, &shot)?.color, BACKGROUNDS[0]))
    };
    (0..=plan.motion.dolly_frames.max(1)).map(frame).collect()
}

/// FLIP from frame to frame, over what the tree takes of the picture.
fn dolly_steps(frames: &[RgbImage], motion: MotionPlan) -> Result<Vec<f64>> {
    let side = f64::from(DOLLY_SIDE_PX);
    let step = |(i, pair): (usize, &[RgbImage])| {
        Ok(flip(&pair[0], &pair[1])?.mean * (side / f64::from(height_px(motion, i)).min(side)).powi(2))
    };
    frames.par_windows(2).enumerate().map(step).collect()
}

/// The largest of `steps` over the median of the eleven around it, 0 of none: how much a walk through pictures jumps where it jumps most.
/// Steps are mean FLIP from picture to picture, per pixel of the tree; those under 0.01 count as that, since nobody sees them.
pub fn largest_step(steps: &[f64]) -> f64 {
    largest(steps).1
}

/// Which step that is, and how large.
fn largest(steps: &[f64]) -> (usize, f64) {
    let ratio = |i: usize| {
        let mut around: Vec<f64> = steps[i.saturating_sub(5)..(i + 6).min(steps.len())].to_vec();
        around.sort_by(f64::total_cmp);
        steps[i] / around[around.len() / 2].max(0.01)
    };
    (0..steps.len()).map(|i| (i, ratio(i))).fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most })
}

/// Frames side by side, as high as a strip is.
fn strip(frames: &[&RgbImage]) -> RgbaImage {
    let mut all = RgbaImage::new((STRIP_PX + 4) * frames.len().max(1) as u32 - 4, STRIP_PX);
    for (i, frame) in frames.iter().enumerate() {
        let filter = if frame.width() < STRIP_PX { imageops::FilterType::Nearest } else { imageops::FilterType::Triangle };
        let scaled = imageops::resize(*frame, STRIP_PX, STRIP_PX, filter);
        let opaque = image::DynamicImage::from(scaled).into_rgba8();
        imageops::replace(&mut all, &opaque, i64::from(STRIP_PX + 4) * i as i64, 0);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_stands_out_and_a_slope_does_not() {
        let slope: Vec<f64> = (0..40).map(|i| 0.05 + 0.002 * f64::from(i)).collect();
        assert!(largest_step(&slope) < 1.3);
        let mut jump = slope.clone();
        jump[20] *= 3.0;
        let (at, ratio) = largest(&jump);
        assert!(at == 20 && (ratio - 3.0).abs() < 0.2);
        assert_eq!(largest_step(&[]), 0.0);
    }

    #[test]
    fn the_walk_away_goes_from_end_to_end() {
        let motion = MotionPlan { orbit_frames: 2, dolly_frames: 10, dolly_px: [200.0, 20.0] };
        assert!((height_px(motion, 0) - 200.0).abs() < 1e-3 && (height_px(motion, 10) - 20.0).abs() < 1e-3);
    }

    #[test]
    fn a_strip_holds_its_frames() {
        let frame = RgbImage::from_pixel(50, 50, image::Rgb([7, 8, 9]));
        let made = strip(&[&frame, &frame, &frame]);
        assert_eq!((made.dimensions(), made.get_pixel(130, 5).0, made.get_pixel(140, 5).0), ((392, 128), [0; 4], [7, 8, 9, 255]));
    }
}
