//! Segmentation: which pixels are the crown (She §3.1, fig. 7).

use crate::Warning;
use crate::raster::{Mask, Rect};

crate::choices! {
    /// How the crown is told from the rest.
    pub enum Method {
        /// Estimates the foliage's colours from the picture and adds texture, sky, ground and shape.
        Auto = "auto",
        /// The paper's: a fixed hue range, opening, closing, largest component, holes filled.
        Hsv = "hsv",
    }
}

crate::params! {
    /// Segmentation.
    pub struct SegmentParams {
        /// How the crown is told from the rest.
        method: Method = Method::Auto, unit "", source "ours: She's fixed hue range fails on most real foliage";
    }
}

/// What a person says about the picture (She §3.1 asks for "manual interventions"). All in pixels of the upright photograph.
#[derive(Debug, Clone, Default)]
pub struct Hints {
    /// The crown lies inside.
    pub rect: Option<Rect>,
    /// Pixels of the crown.
    pub include: Vec<(u32, u32)>,
    /// Pixels that are not the crown.
    pub exclude: Vec<(u32, u32)>,
    /// The crown, drawn by hand: segmentation only finds trunk and gaps.
    pub mask: Option<Mask>,
    /// Hue range in degrees, low ≤ high, overriding the method's own.
    pub hue_deg: Option<(f64, f64)>,
}

/// The pixels of one tree.
#[derive(Debug, Clone)]
pub struct Segmentation {
    /// The crown, holes filled: one component.
    pub crown: Mask,
    /// The crown and the trunk below it.
    pub tree: Mask,
    /// Sky seen through the crown: a subset of `crown`.
    pub gaps: Mask,
    /// The steps of fig. 7 in order, for people to look at: name and mask.
    pub steps: Vec<(&'static str, Mask)>,
    /// The hue range that was used, degrees.
    pub hue_deg: (f64, f64),
    /// What the user should know.
    pub warnings: Vec<Warning>,
}
