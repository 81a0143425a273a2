//! How the outline of a tree's crowns grows when drawn (She §3.3): the part that belongs to the tree. §4 leaves open that "reshaping the
//! crown outline may differ for different tree species"; here a tree has one of two profiles, and lengths in metres.

use serde::{Deserialize, Serialize};

crate::choices! {
    /// What grows out of an outline.
    pub enum GrowthProfile {
        /// Narrow twigs of unlike length that point outward and up: conifers.
        Needle = "needle",
        /// Rounded tufts of leaves that overlap, in all directions outward: broadleaved trees.
        Broadleaf = "broadleaf",
    }
}

/// How the outline of one tree grows. Lengths are metres on the crown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Growth {
    /// What grows.
    pub profile: GrowthProfile,
    /// She's Qmin: every root grows at least so far.
    pub min_m: f64,
    /// She's Qmax: no root grows farther.
    pub max_m: f64,
    /// Distance from one twig or tuft to the next along the outline.
    pub spacing_m: f64,
}

impl Growth {
    /// What is likely for a tree of which nothing more is known, `height_m` tall.
    pub fn likely(profile: GrowthProfile, height_m: f64) -> Self {
        let (min, max, spacing) = match profile {
            GrowthProfile::Needle => (0.002, 0.035, 0.022),
            GrowthProfile::Broadleaf => (0.003, 0.030, 0.035),
        };
        Self { profile, min_m: min * height_m, max_m: max * height_m, spacing_m: spacing * height_m }
    }
}
