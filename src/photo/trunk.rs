//! What the photograph shows of the trunk: width, foot and bark colour.

use glam::DVec2;

/// The visible trunk, pixels.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrunkCues {
    /// Where the trunk meets the ground, middle of its width.
    pub foot_px: DVec2,
    /// Where the trunk enters the crown, middle of its width.
    pub neck_px: DVec2,
    /// Median width.
    pub width_px: f64,
    /// Median bark colour, 8-bit sRGB.
    pub bark: [u8; 3],
}
