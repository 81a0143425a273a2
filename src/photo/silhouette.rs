//! The crown's outline, its axis and its significant turning points (She §3.1, fig. 8a).

use glam::DVec2;

crate::params! {
    /// How the outline is simplified.
    pub struct SilhouetteParams {
        /// Largest distance between the outline and its simplification, as a fraction of the crown's height.
        turning: f64 = 0.01, in 0.001..=0.1, unit "crown heights", source "ours: She names no scale";
    }
}

/// The crown's axis in the picture, pixels; a leaning tree has a leaning axis.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axis {
    /// Where the axis leaves the crown below.
    pub base: DVec2,
    /// Where it leaves the crown above.
    pub top: DVec2,
}

/// The outline of the crown, pixels.
#[derive(Debug, Clone)]
pub struct Silhouette {
    /// The outer contour, closed, without repeating its first point.
    pub contour: Vec<DVec2>,
    /// The axis the profile is revolved about.
    pub axis: Axis,
    /// Significant turning points left of the axis, from the base to the top.
    pub left: Vec<DVec2>,
    /// Significant turning points right of the axis, from the base to the top.
    pub right: Vec<DVec2>,
}
