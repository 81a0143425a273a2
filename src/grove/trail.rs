//! From where levels of detail are told: a point that trails the camera, so that what stands to and fro does not flicker, and farther off the
//! faster the camera is (Truelsen §9.2). Metres, seconds.

use glam::Vec3;

use crate::render::LevelViewer;

crate::params! {
    /// How levels of detail follow the camera.
    pub struct FollowParams {
        /// The point from which distances are told follows the camera once it is farther away: to and fro within changes no level.
        slack_m: f64 = 1.0, in 0.0..=100.0, unit "m", source "ours: hysteresis";
        /// Everything counts as so many times as far away: 2 draws each tree as if it were half as high in the picture.
        coarser: f64 = 1.6, in 0.1..=10.0, unit "", source "ours: among many trees an error of a pixel and a half does not show";
        /// At that speed of the camera everything counts as twice as far away; 0 for never.
        haste_m_s: f64 = 60.0, in 0.0..=10_000.0, unit "m/s", source "Truelsen §9.2: high speed requires lower details; the speed is ours";
    }
}

/// The point from which distances are told: it trails the camera.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trail {
    eye: Option<Vec3>,
    camera: Option<(f32, Vec3)>,
}

impl Trail {
    /// Who stands for the camera now; `time_s` rises from call to call.
    pub fn follow(&mut self, camera: Vec3, time_s: f32, params: &FollowParams) -> LevelViewer {
        let slack = params.slack_m as f32;
        let eye = match self.eye {
            Some(eye) if eye.distance(camera) > slack => camera + slack * (eye - camera).normalize_or_zero(),
            Some(eye) => eye,
            None => camera,
        };
        let speed =
            self.camera.filter(|(before, _)| time_s > *before).map_or(0.0, |(before, at)| at.distance(camera) / (time_s - before));
        (self.eye, self.camera) = (Some(eye), Some((time_s, camera)));
        let haste = params.haste_m_s as f32;
        let hurried = if haste > 0.0 { 1.0 + speed / haste } else { 1.0 };
        LevelViewer { eye, farther: params.coarser as f32 * hurried }
    }
}
