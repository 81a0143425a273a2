//! What is looked at: views, distances, suns, and how many of them fit the time (issue "compare").

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

crate::choices! {
    /// How much is looked at.
    pub enum Profile {
        /// A few views at three distances: an answer within a minute or two.
        Quick = "quick",
        /// Eight azimuths, five elevations, six distances, two suns.
        Full = "full",
        /// The figures and tables of the five papers, redrawn.
        Papers = "papers",
    }
}

crate::choices! {
    /// Which set of views.
    pub enum Views {
        /// Those of the profile.
        Default = "default",
        /// Azimuths every 15° instead of 45°.
        Dense = "dense",
    }
}

/// From where a tree is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Round the tree, degrees; 0 is +Z.
    pub azimuth_deg: f32,
    /// Above the horizon, degrees.
    pub elevation_deg: f32,
}

/// Where the sun stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sun {
    /// As a view's.
    pub azimuth_deg: f32,
    /// As a view's.
    pub elevation_deg: f32,
}

/// Everything that is looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// From where.
    pub views: Vec<View>,
    /// Which of the views is that of the photograph, where one is the truth.
    pub photographed: Option<usize>,
    /// How many pixels high the tree is, largest first: how far away it stands.
    pub heights_px: Vec<f32>,
    /// Lights.
    pub suns: Vec<Sun>,
    /// Whether each level of a method is looked at by itself too, wherever it would be drawn: from the first azimuth of each elevation, in
    /// the first light.
    pub levels: bool,
    /// What is looked at in motion.
    pub motion: MotionPlan,
    /// Milliseconds for which each method is timed at each distance.
    pub timing_ms: u64,
}

/// A walk round the tree, and one away from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionPlan {
    /// Frames of the walk round it, [`MotionPlan::ORBIT_STEP_DEG`] apart.
    pub orbit_frames: usize,
    /// Frames of the walk away.
    pub dolly_frames: usize,
    /// How many pixels high the tree is in its first frame and its last.
    pub dolly_px: [f32; 2],
}

impl MotionPlan {
    /// Degrees of a step of the walk round the tree.
    pub const ORBIT_STEP_DEG: f32 = 2.0;
}

/// From the viewer's right behind him, and low on the left against him: trees must look right in both.
const SUNS: [Sun; 2] = [Sun { azimuth_deg: 40.0, elevation_deg: 45.0 }, Sun { azimuth_deg: 250.0, elevation_deg: 20.0 }];

impl Plan {
    /// The plan of a profile for a tree that is at most `size_px` pixels high.
    pub fn new(profile: Profile, views: Views, size_px: u32) -> Self {
        let largest = size_px as f32;
        let quick = profile == Profile::Quick;
        let (step_deg, elevations, heights, suns): (u32, &[f32], &[f32], usize) = if quick {
            (90, &[0.0, 45.0, 90.0], &[0.5, 0.125, 1.0 / 32.0], 1)
        } else {
            (45, &[0.0, 15.0, 30.0, 60.0, 90.0], &[1.0, 0.5, 0.25, 0.125, 1.0 / 16.0, 1.0 / 32.0], 2)
        };
        // Steps of 8 and 6 %: a change of level that fades over 15 % takes about two of them.
        let motion = if quick {
            MotionPlan { orbit_frames: 6, dolly_frames: 27, dolly_px: [200.0, 24.0] }
        } else {
            MotionPlan { orbit_frames: 12, dolly_frames: 60, dolly_px: [400.0, 12.0] }
        };
        let step_deg = if views == Views::Dense { 15 } else { step_deg };
        let azimuths = || (0..360 / step_deg).map(|i| (i * step_deg) as f32);
        // A grown tree's front is nothing special; looking along the axes of crossed planes would be.
        let turned = |azimuth: f32| azimuth + 10.0;
        // From straight above the others turn the same picture.
        let of_elevation = |&elevation_deg: &f32| {
            let azimuths = azimuths().take(if quick && elevation_deg == 90.0 { 1 } else { usize::MAX });
            azimuths.map(move |azimuth| View { azimuth_deg: turned(azimuth), elevation_deg }).collect::<Vec<_>>()
        };
        let mut heights_px: Vec<f32> = heights.iter().map(|part| (part * largest).max(8.0)).collect();
        // Of a small tree several would be the least.
        heights_px.dedup();
        Self {
            views: elevations.iter().flat_map(of_elevation).collect(),
            photographed: None,
            heights_px,
            suns: SUNS[..suns].to_vec(),
            levels: !quick,
            motion,
            timing_ms: if quick { 60 } else { 200 },
        }
    }

    /// Views from a file: a line `AZIMUTH ELEVATION` in degrees each; empty lines and lines that begin with `#` are left out.
    ///
    /// # Errors
    /// [`Error::ViewLine`] names the first line that is neither.
    pub fn views_of(text: &str) -> Result<Vec<View>> {
        let view = |(number, line): (usize, &str)| {
            let wrong = || Error::ViewLine { line: number + 1, found: line.trim().chars().take(60).collect() };
            let numbers: Vec<f32> =
                line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty()).map_while(|word| word.parse().ok()).collect();
            match numbers[..] {
                [azimuth_deg, elevation_deg] if azimuth_deg.abs() <= 360.0 && elevation_deg.abs() <= 90.0 => {
                    let words = line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty()).count();
                    if words == 2 { Ok(View { azimuth_deg, elevation_deg }) } else { Err(wrong()) }
                }
                _ => Err(wrong()),
            }
        };
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
        let views: Vec<View> = lines.map(view).collect::<Result<_>>()?;
        if views.is_empty() { Err(Error::ViewLine { line: 1, found: "no view at all".to_owned() }) } else { Ok(views) }
    }

    /// The same with the photograph's own view as its first.
    pub fn with_photograph(mut self) -> Self {
        self.views.insert(0, View { azimuth_deg: 0.0, elevation_deg: 0.0 });
        self.photographed = Some(0);
        self
    }

    /// Pictures of one method that are held against the truth, without those of its levels.
    pub fn pictures(&self) -> usize {
        self.views.len() * self.heights_px.len() * self.suns.len()
    }

    /// Whether a view is the first azimuth of its elevation: its pictures go into the report, and levels are looked at from there.
    pub fn is_first(&self, view: usize) -> bool {
        let elevation_deg = self.views[view].elevation_deg;
        self.views[..view].iter().all(|before| before.elevation_deg != elevation_deg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_plan_is_the_issues() {
        let plan = Plan::new(Profile::Full, Views::Default, 512);
        assert_eq!(plan.heights_px, [512.0, 256.0, 128.0, 64.0, 32.0, 16.0]);
        assert_eq!((plan.views.len(), plan.suns.len(), plan.pictures()), (40, 2, 480));
        assert_eq!(Plan::new(Profile::Full, Views::Dense, 512).views.len(), 120);
        assert_eq!(Plan::new(Profile::Quick, Views::Default, 64).heights_px, [32.0, 8.0]);
    }

    #[test]
    fn a_file_of_views_is_read_or_its_bad_line_named() {
        let views = Plan::views_of("# front\n0 15\n\n90, 60\n").unwrap();
        assert_eq!(views[1], View { azimuth_deg: 90.0, elevation_deg: 60.0 });
        for (text, line) in [("0 0\n12 x\n", 2), ("0 91", 1), ("0 0 0", 1), ("", 1), ("nan 3", 1)] {
            let error = Plan::views_of(text).unwrap_err().to_string();
            assert!(error.contains(&format!("line {line}")), "{text:?}: {error}");
        }
    }
}
