//! The films of a comparison: a walk round the tree and one away from it, frame by frame, before the first of [`BACKGROUNDS`].

use image::{Rgb, RgbImage, imageops};

use crate::Result;
use crate::metrics::over;
use crate::render::{Camera, Projection, Renderer, Shot, Tree};
use crate::repr::REFERENCE_FOCAL_PX;

use super::plan::{MotionPlan, Plan, View};
use super::staging::{BACKGROUNDS, Stage};
use super::truth;

/// How high the tree is on the walk round it, pixels.
pub const ORBIT_PX: f32 = 96.0;
/// Side of the frames of the walk away, pixels.
pub const DOLLY_SIDE_PX: u32 = 192;

/// A frame to be taken.
pub struct Frame {
    shot: Shot,
    height_px: f32,
    /// Side of the frame; what is drawn lies in its middle.
    side_px: u32,
}

/// The frames of a walk round the tree: one window and angle for all.
pub fn orbit(stage: &Stage, plan: &Plan) -> Vec<Frame> {
    let view = |i: usize| View { azimuth_deg: 10.0 + MotionPlan::ORBIT_STEP_DEG * i as f32, elevation_deg: 12.0 };
    let (camera, side_px) = stage.camera(view(0), ORBIT_PX);
    let frame = |i: usize| {
        let mut shot = stage.shot(view(i), ORBIT_PX, plan.suns[0], None);
        (shot.size_px, shot.camera.projection) = ([side_px; 2], camera.projection);
        Frame { shot, height_px: ORBIT_PX, side_px }
    };
    (0..plan.motion.orbit_frames.max(2)).map(frame).collect()
}

/// The frames of a walk away from the tree. The nearest show a part of it.
pub fn dolly(stage: &Stage, plan: &Plan) -> Vec<Frame> {
    let view = View { azimuth_deg: 20.0, elevation_deg: 10.0 };
    let frame = |i: usize| {
        let height_px = height_px(plan.motion, i);
        let shot = stage.shot(view, height_px, plan.suns[0], None);
        // Nothing is drawn where nothing is; an even side has the tree in the middle of the frame.
        let side_px = shot.size_px[0].next_multiple_of(2).min(DOLLY_SIDE_PX);
        let camera = match shot.camera.projection {
            Projection::Perspective { near_m, .. } => {
                let fov_y_rad = 2.0 * (0.5 * side_px as f32 / REFERENCE_FOCAL_PX).atan();
                Camera { projection: Projection::Perspective { fov_y_rad, near_m }, ..shot.camera }
            }
            Projection::Orthographic { .. } => shot.camera,
        };
        Frame { shot: Shot { camera, size_px: [side_px; 2], ..shot }, height_px, side_px: DOLLY_SIDE_PX }
    };
    (0..=plan.motion.dolly_frames.max(1)).map(frame).collect()
}

/// How many pixels high the tree is in a frame of the walk away.
pub fn height_px(motion: MotionPlan, frame: usize) -> f32 {
    let [first, last] = motion.dolly_px;
    first * (last / first).powf(frame as f32 / motion.dolly_frames.max(1) as f32)
}

impl Frame {
    /// The frame as a stand-in is drawn.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn take(&self, renderer: &mut Renderer, stage: &Stage, tree: &Tree) -> Result<RgbImage> {
        Ok(self.framed(&over(&stage.see(renderer, tree, &self.shot)?.color, BACKGROUNDS[0])))
    }

    /// The frame as it would be if pixels were points: each the mean of several.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn take_true(&self, renderer: &mut Renderer, stage: &Stage, tree: &Tree) -> Result<RgbImage> {
        let seen = truth::see(renderer, stage, tree, &self.shot, self.height_px)?;
        Ok(self.framed(&over(&seen.color, BACKGROUNDS[0])))
    }

    fn framed(&self, drawn: &RgbImage) -> RgbImage {
        let mut frame = RgbImage::from_pixel(self.side_px, self.side_px, Rgb(BACKGROUNDS[0]));
        let corner = i64::from(self.side_px - drawn.width()) / 2;
        imageops::replace(&mut frame, drawn, corner, corner);
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Profile, Views};
    use crate::geom::Bounds;
    use glam::Vec3;

    #[test]
    fn the_walk_away_goes_from_end_to_end() {
        let motion = MotionPlan { orbit_frames: 2, dolly_frames: 10, dolly_px: [200.0, 20.0] };
        assert!((height_px(motion, 0) - 200.0).abs() < 1e-3 && (height_px(motion, 10) - 20.0).abs() < 1e-3);
    }

    #[test]
    fn far_frames_draw_only_where_the_tree_is_and_keep_it_in_the_middle() {
        let stage = Stage { bounds: Bounds { min: Vec3::new(-3.0, 0.0, -2.0), max: Vec3::new(4.0, 9.0, 2.5) } };
        let frames = dolly(&stage, &Plan::new(Profile::Quick, Views::Default, 512));
        let sides: Vec<u32> = frames.iter().map(|frame| frame.shot.size_px[0]).collect();
        assert!(
            sides[0] == DOLLY_SIDE_PX && *sides.last().unwrap() < 48 && sides.iter().all(|side| side.is_multiple_of(2)),
            "{sides:?}"
        );
        let last = frames.last().unwrap();
        let dot = RgbImage::from_pixel(last.shot.size_px[0], last.shot.size_px[0], Rgb([1, 2, 3]));
        let framed = last.framed(&dot);
        let half = DOLLY_SIDE_PX / 2;
        assert_eq!((framed.get_pixel(half - 1, half).0, framed.get_pixel(0, 0).0), ([1, 2, 3], BACKGROUNDS[0]));
        assert_eq!(framed.pixels().filter(|p| p.0 == [1, 2, 3]).count() as u32, dot.width() * dot.width());
    }
}
