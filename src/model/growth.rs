//! How the outline of a tree's crowns grows when drawn (She §3.3): the part that belongs to the tree. §4 leaves open that "reshaping the
//! crown outline may differ for different tree species"; here a tree has one of two profiles, and lengths in metres.

use serde::{Deserialize, Serialize};

use crate::photo::Roughness;

crate::choices! {
    /// What grows out of an outline.
    pub enum GrowthProfile {
        /// Narrow twigs of unlike length that point outward and up: conifers.
        Needle = "needle",
        /// Rounded tufts of leaves that overlap, in all directions outward: broadleaved trees.
        Broadleaf = "broadleaf",
    }
}

crate::choices! {
    /// Which profile a model gets.
    pub enum ProfileChoice {
        /// By the outline: slender crowns are conifers.
        Auto = "auto",
        /// Narrow twigs of unlike length: conifers.
        Needle = "needle",
        /// Rounded tufts: broadleaved trees.
        Broadleaf = "broadleaf",
    }
}

crate::params! {
    /// How the outline of the model will grow when it is drawn.
    pub struct ProfileParams {
        /// What grows out of the outline when the model is drawn; how far is measured on the photograph.
        growth: ProfileChoice = ProfileChoice::Auto, unit "", source "ours: species differ (She §4)";
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

/// Crowns so many times as high as wide are taken for conifers. On 40 photographs of known species this is right for 34; the roughness
/// of the outline by itself, at any scale, tells conifers from broadleaved trees no better than a coin does.
const SLENDER: f64 = 1.35;
/// What is measured stays within these of the crown's height, whatever the mask looks like.
const DEPTH: (f64, f64) = (0.015, 0.05);
/// Qmax over the measured depth: twigs grow half as far on average as the longest.
const LONGEST: f64 = 1.5;
const SPACING: (f64, f64) = (0.01, 0.04);
/// No tree is so tall that its twigs are this long or this far apart.
const MOST_M: f64 = 100.0;

impl Growth {
    /// Of a tree of which a photograph shows the outline.
    pub fn measured(outline: &Roughness, metres_per_px: f64, height_m: f64, choice: ProfileChoice) -> Self {
        let profile = match choice {
            ProfileChoice::Needle => GrowthProfile::Needle,
            ProfileChoice::Broadleaf => GrowthProfile::Broadleaf,
            ProfileChoice::Auto if outline.slenderness >= SLENDER => GrowthProfile::Needle,
            ProfileChoice::Auto => GrowthProfile::Broadleaf,
        };
        let within = |px: f64, (least, most): (f64, f64)| (px * metres_per_px).clamp(least * height_m, most * height_m);
        let max_m = within(LONGEST * outline.depth_px, DEPTH);
        // Needle twigs stand closer than the mask's pixels tell.
        let apart = if profile == GrowthProfile::Needle { 0.6 } else { 1.0 };
        Self { profile, min_m: 0.08 * max_m, max_m, spacing_m: apart * within(outline.spacing_px, SPACING) }
    }

    /// Whether a renderer can work with it.
    pub(super) fn is_sound(&self) -> bool {
        let lengths = [self.min_m, self.max_m, self.spacing_m];
        lengths.iter().all(|length| (0.0..=MOST_M).contains(length)) && self.min_m <= self.max_m && self.spacing_m > 0.0
    }

    /// What is likely for a tree of which nothing more is known, `height_m` tall.
    pub fn likely(profile: GrowthProfile, height_m: f64) -> Self {
        let (min, max, spacing) = match profile {
            GrowthProfile::Needle => (0.002, 0.022, 0.012),
            GrowthProfile::Broadleaf => (0.003, 0.022, 0.025),
        };
        Self { profile, min_m: min * height_m, max_m: max * height_m, spacing_m: spacing * height_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_no_tree_has_are_not_sound() {
        let sound = Growth::likely(GrowthProfile::Needle, 20.0);
        assert!(sound.is_sound());
        for wrong in [f64::NAN, f64::INFINITY, -0.1, 1e8, 1e30] {
            assert!(!Growth { max_m: wrong, ..sound }.is_sound(), "{wrong}");
            assert!(!Growth { spacing_m: wrong, ..sound }.is_sound(), "{wrong}");
        }
        assert!(!Growth { min_m: 2.0, max_m: 1.0, ..sound }.is_sound() && !Growth { spacing_m: 0.0, ..sound }.is_sound());
    }
}
