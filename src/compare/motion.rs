//! What moves: a walk round the tree, on which stand-ins flicker, and one away from it, on which they pop; each held against what the truth
//! itself does: frame by frame, and as a person sees the whole film (ColorVideoVDP).

use image::{RgbImage, RgbaImage, imageops};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::metrics::{film_quality_jod, flip};
use crate::render::{Renderer, Tree};
use crate::repr::{BuiltTree, Drawn};

use super::film::{self, DOLLY_SIDE_PX, Frame, height_px};
use super::plan::{MotionPlan, Plan};
use super::staging::Stage;

/// How a method behaves in motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// FLIP from frame to frame on an orbit, over that of the truth: 1 flickers as the tree does, more flickers more.
    pub flicker: f64,
    /// Quality of that film beside the truth's, just-objectionable differences: 10 is as good.
    pub orbit_jod: f64,
    /// Largest step of a dolly over the median of those around it: up to 2 nothing jumps. `None` where nothing changes with distance, so that
    /// nothing can.
    pub popping: Option<f64>,
    /// Quality of that film beside the truth's.
    pub dolly_jod: Option<f64>,
    /// How many pixels high the tree is at the largest step.
    pub largest_at_px: Option<f32>,
}

/// The truth in motion.
#[derive(Debug, Default)]
pub struct TrueMotion {
    /// The walk round it.
    pub orbit: Vec<RgbImage>,
    /// The walk away from it.
    pub dolly: Vec<RgbImage>,
    /// Mean FLIP from frame to frame on the first.
    pub flicker: f64,
}

impl TrueMotion {
    /// Of the frames of both walks.
    ///
    /// # Errors
    /// [`UnlikeSizes`](crate::Error::UnlikeSizes).
    pub fn of(orbit: Vec<RgbImage>, dolly: Vec<RgbImage>) -> Result<Self> {
        let flicker = mean_step(&orbit)?;
        Ok(Self { orbit, dolly, flicker })
    }

    /// Frames of both walks from begin to end, by name.
    pub fn strips(&self) -> [(&'static str, RgbaImage); 2] {
        [(STRIPS[0], spread(&self.orbit)), (STRIPS[1], spread(&self.dolly))]
    }
}

/// Names of the strips among a method's pictures.
pub const STRIPS: [&str; 2] = ["orbit.png", "dolly.png"];

/// Pictures of a strip, and how high they are, pixels.
const OF_STRIP: usize = 6;
const STRIP_PX: u32 = 128;

/// Walks round a stand-in and away from it; gives what was measured, and strips of frames by name: of the orbit from its begin to its end,
/// of the dolly around its largest step.
///
/// # Errors
/// Those of [`Renderer::picture`], and of [`film_quality_jod`].
pub fn measure(
    renderer: &mut Renderer,
    stage: &Stage,
    (built, tree): (&BuiltTree, &Tree),
    plan: &Plan,
    truth: &TrueMotion,
) -> Result<(Motion, Vec<(&'static str, RgbaImage)>)> {
    let mut film = |frames: Vec<Frame>| frames.iter().map(|frame| frame.take(renderer, stage, tree)).collect::<Result<Vec<_>>>();
    let round = film(film::orbit(stage, plan))?;
    let still = on_orbit(truth, &round)?;
    let orbit_strip = (STRIPS[0], spread(&round));
    if !changes_with_distance(built) {
        return Ok((still, vec![orbit_strip]));
    }
    let away = film(film::dolly(stage, plan))?;
    let steps = dolly_steps(&away, plan.motion)?;
    let (largest, popping) = largest(&steps);
    // The step from frame `largest` to the next lies in the middle.
    let first = (largest + 1).saturating_sub(OF_STRIP / 2).min(away.len().saturating_sub(OF_STRIP));
    // Only what the tree takes of the pictures, or far trees would be dots in them.
    let side_px = ((1.4 * height_px(plan.motion, first)) as u32).clamp(8, DOLLY_SIDE_PX);
    let corner = (DOLLY_SIDE_PX - side_px) / 2;
    let part = |frame: &RgbImage| imageops::crop_imm(frame, corner, corner, side_px, side_px).to_image();
    let around: Vec<RgbImage> = away.iter().skip(first).take(OF_STRIP).map(part).collect();
    let motion = Motion {
        popping: Some(popping),
        dolly_jod: Some(film_quality_jod(&truth.dolly, &away)?),
        largest_at_px: Some(height_px(plan.motion, largest)),
        ..still
    };
    Ok((motion, vec![orbit_strip, (STRIPS[1], strip(&around.iter().collect::<Vec<_>>()))]))
}

/// What there is to say of the frames of a walk round a stand-in.
fn on_orbit(truth: &TrueMotion, round: &[RgbImage]) -> Result<Motion> {
    let flicker = if truth.flicker > 0.0 { mean_step(round)? / truth.flicker } else { 1.0 };
    Ok(Motion { flicker, orbit_jod: film_quality_jod(&truth.orbit, round)?, ..Motion::default() })
}

/// Whether anything appears, vanishes or thins out between one distance and another.
fn changes_with_distance(built: &BuiltTree) -> bool {
    built.parts.iter().any(|part| {
        let always = part.seen.appears[1] <= 0.0 && part.seen.vanishes[0] >= f32::MAX;
        !always || matches!(part.drawn, Drawn::Forest(_))
    })
}

/// The mean FLIP from frame to frame.
///
/// # Errors
/// [`UnlikeSizes`](crate::Error::UnlikeSizes).
fn mean_step(frames: &[RgbImage]) -> Result<f64> {
    let steps: Vec<f64> = frames.par_windows(2).map(|pair| Ok(flip(&pair[0], &pair[1])?.mean)).collect::<Result<_>>()?;
    Ok(steps.iter().sum::<f64>() / steps.len().max(1) as f64)
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

/// Some frames from the first to the last, side by side.
fn spread(frames: &[RgbImage]) -> RgbaImage {
    let last = frames.len().saturating_sub(1);
    strip(&(0..OF_STRIP).filter_map(|i| frames.get(i * last / (OF_STRIP - 1))).collect::<Vec<_>>())
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

    /// A tree that turns by a pixel a frame before a bright sky.
    fn film(frames: u32, shade: impl Fn(u32) -> f32) -> Vec<RgbImage> {
        let frame = |n: u32| {
            RgbImage::from_fn(64, 64, |x, y| {
                let there = (x as i32 - 32).pow(2) + (y as i32 - 32).pow(2) < 600;
                let leaf = if ((x + n) / 3 + y / 4).is_multiple_of(2) { 60.0 } else { 110.0 };
                image::Rgb(if there { [0.7, 1.0, 0.4].map(|part| (part * leaf * shade(n)) as u8) } else { [226, 234, 242] })
            })
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn flicker_and_a_pop_are_seen_and_the_truth_itself_has_neither() {
        let truth = TrueMotion::of(film(12, |_| 1.0), film(12, |_| 1.0)).unwrap();
        let itself = on_orbit(&truth, &truth.orbit).unwrap();
        assert_eq!((itself.flicker, itself.orbit_jod), (1.0, 10.0));
        let flickers = on_orbit(&truth, &film(12, |n| if n.is_multiple_of(2) { 1.0 } else { 1.2 })).unwrap();
        assert!(flickers.flicker > 1.1 && flickers.orbit_jod < 9.5, "{flickers:?}");
        // As much off, but all the time: less than flicker is.
        let darker = on_orbit(&truth, &film(12, |_| 1.2)).unwrap();
        assert!(darker.orbit_jod < 9.99 && darker.flicker < flickers.flicker, "{darker:?}");
        let pops = film_quality_jod(&truth.dolly, &film(12, |n| if n < 6 { 1.0 } else { 1.4 })).unwrap();
        assert!(pops < 9.7, "{pops}");
    }

    #[test]
    fn a_strip_holds_its_frames() {
        let frame = RgbImage::from_pixel(50, 50, image::Rgb([7, 8, 9]));
        let made = strip(&[&frame, &frame, &frame]);
        assert_eq!((made.dimensions(), made.get_pixel(130, 5).0, made.get_pixel(140, 5).0), ((392, 128), [0; 4], [7, 8, 9, 255]));
    }
}
