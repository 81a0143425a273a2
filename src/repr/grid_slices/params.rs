//! What a user may set of `grid-slices`, and what the thesis's distances are in ours.

use glam::Vec3;

use crate::params::{ParamSet, PowerOfTwo};
use crate::repr::{Fade, REFERENCE_FOCAL_PX};
use crate::{Error, Result};

crate::choices! {
    /// How slices stand.
    pub enum Arrangement {
        /// Two rows of parallel slices, at right angles (fig. 12a).
        Grid = "grid",
        /// All of them through the trunk (fig. 12b), flatter from near.
        Star = "star",
    }
}

crate::choices! {
    /// Where the slices of a row stand.
    pub enum Placement {
        /// At equal distances over the whole width.
        Uniform = "uniform",
        /// Where the foliage is: each at the middle of its share, its picture no larger than that.
        Adaptive = "adaptive",
    }
}

crate::choices! {
    /// How a slice goes.
    pub enum Dissolve {
        /// By noise that was baked into its alpha.
        Noise = "noise",
        /// By a hash of the place on the tree, pixel by pixel.
        Hashed = "hashed",
    }
}

crate::choices! {
    /// What becomes of the base pair far away.
    pub enum Beyond {
        /// It stays.
        Stay = "stay",
        /// It fades at its distance as all others do.
        Vanish = "vanish",
    }
}

crate::params! {
    /// Parameters of `grid-slices`.
    pub struct GridParams {
        /// How slices stand.
        arrangement: Arrangement = Arrangement::Grid, unit "", source "Truelsen §4.1.2: the star looked flat";
        /// Slices on either side of the base slice in each row; 3 make 7 + 7. In a star, as many slices in all.
        side_slices: u32 = 3, in 1..=10, unit "", source "Truelsen §4.1.3: 7 + 7";
        /// Where the slices of a row stand.
        placement: Placement = Placement::Uniform, unit "", source "Truelsen eq. 1; adaptive is what §9.2 wished for: over seven presets silhouettes 1 to 6 points nearer, 16 to 67 % fewer texture bytes";
        /// Texels along the longer side of a picture.
        size_px: PowerOfTwo = PowerOfTwo(512), in 64..=1024, unit "px", source "ours: fills a screen of 1080 rows from 3 tree heights on; Truelsen had 1024, table 4 has 64 to 1024";
        /// How far the base pair's pictures reach before and behind it, as a part of the tree's radius.
        base_depth: f64 = 0.25, in 0.05..=1.0, unit "", source "Truelsen §4.1.2: a quarter of the radius";
        /// Level slices for each width that the crown is high, at most 7: seen only from above and below, where upright ones are seen edge-on.
        top_slices: u32 = 1, in 0..=7, unit "", source "ours: the thesis looks from the ground and has none; of a slender crown one would be a disc at half its height";
        /// Beyond this distance the base pair is gone, if it may.
        level_1_far: f64 = 200.0, in 1.0..=10000.0, unit "units", source "Truelsen §4.2.2, fig. 17";
        /// Beyond this distance the slices of level 2 are gone.
        level_2_far: f64 = 44.0, in 1.0..=10000.0, unit "units", source "Truelsen §4.2.2, fig. 17";
        /// Beyond this distance the slices of level 3 are gone.
        level_3_far: f64 = 32.0, in 1.0..=10000.0, unit "units", source "Truelsen §4.2.2, fig. 17";
        /// Beyond this distance the slices of level 4, all that there are beside, are gone.
        level_4_far: f64 = 26.0, in 1.0..=10000.0, unit "units", source "Truelsen §4.2.2, fig. 17";
        /// How fast slices fade, β of α = β(far − d): 0.1 fades over 10 units.
        gradient: f64 = 0.1, in 0.01..=10.0, unit "1/unit", source "Truelsen eq. 2, fig. 17";
        /// What becomes of the base pair far away.
        beyond: Beyond = Beyond::Stay, unit "", source "ours: a tree is compared at any distance; theirs vanished at 200";
        /// How a slice goes.
        dissolve: Dissolve = Dissolve::Noise, unit "", source "Truelsen §7.4.2 and §9.2: noise in the texture, which they wished for";
        /// Slices that are taken anew in each update of a growing tree.
        slices_per_update: u32 = 2, in 1..=64, unit "", source "ours: Truelsen §9.2 asks for amortised updates and names no number";
    }
}

/// Rows of their viewport (§7.1), pixels.
const THEIR_ROWS_PX: f32 = 768.0;
/// Tangent of half the angle between its lower and its upper edge. The thesis does not tell it; its framework, OpenTissue, opens a window
/// of 1024 × 768 (just theirs) with 30°.
const THEIR_HALF_ANGLE_TAN: f32 = 0.267_949_2;
/// Height of the tree for which they give distances (table 2: 161 bones, which is "Simple tree" of appendix C at age 4): that high is it
/// when its L-system is drawn by our turtle, whose step is their 0.1 units. At 3.9 units, the nearest of table 2, it is then 563 of
/// 768 rows high and at 19.0 units 116, as the text has it: first it fills the viewport, then it does not.
const THEIR_TREE_UNITS: f32 = 1.534_56;

/// Tree heights, as [`Seen`](crate::repr::Seen) has distances, for one of their units: so far away the tree is as many pixels high.
pub const HEIGHTS_PER_UNIT: f32 = REFERENCE_FOCAL_PX / (0.5 * THEIR_ROWS_PX / THEIR_HALF_ANGLE_TAN) / THEIR_TREE_UNITS;

/// Levels that have a distance of their own.
pub const MOST_LEVELS: usize = 4;

/// Most level slices of a tree.
const MOST_TOP_SLICES: u32 = 7;

impl GridParams {
    /// Level slices of a crown of this size.
    pub fn level_slices(&self, size: Vec3) -> u32 {
        let widths = size.y / size.x.max(size.z).max(1e-6);
        (self.top_slices * widths.round().clamp(1.0, MOST_TOP_SLICES as f32) as u32).min(MOST_TOP_SLICES)
    }

    /// Checks what ranges alone do not say: finer levels end nearer, so that what is drawn is always the first of the list.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that does not.
    pub fn check(&self) -> Result<()> {
        self.validate()?;
        let fars = self.fars();
        match (1..fars.len()).find(|&finer| fars[finer] > fars[finer - 1]) {
            Some(finer) => Err(Error::Parameter {
                name: format!("--level-{}-far", finer + 1),
                expected: format!("at most --level-{finer}-far, which is {} units", fars[finer - 1]),
                found: fars[finer].to_string(),
            }),
            None => Ok(()),
        }
    }

    /// Levels that there are: the base pair's, and one for each pair of slices on its sides until there are four.
    pub fn levels(&self) -> usize {
        (1 + self.side_slices as usize).min(MOST_LEVELS)
    }

    /// From where on the slices of a level (1 is the base pair's) fade and where they are gone, in tree heights (eq. 2).
    pub fn vanishes(&self, level: usize) -> [f32; 2] {
        if level <= 1 && self.beyond == Beyond::Stay {
            return [f32::MAX; 2];
        }
        let far = self.fars()[level.clamp(1, MOST_LEVELS) - 1];
        [(far - 1.0 / self.gradient).max(0.0), far].map(|units| units as f32 * HEIGHTS_PER_UNIT)
    }

    /// A distance at which a level is seen and no finer one, in tree heights: where the next finer one is just gone; of the finest, where
    /// it begins to go.
    pub fn distance_of(&self, level: usize) -> f32 {
        if level < self.levels() { self.vanishes(level + 1)[1] } else { self.vanishes(level)[0] }
    }

    /// How slices go, as a renderer knows it.
    pub fn fade(&self) -> Fade {
        match self.dissolve {
            Dissolve::Noise => Fade::Alpha,
            Dissolve::Hashed => Fade::Hashed,
        }
    }

    fn fars(&self) -> [f64; MOST_LEVELS] {
        [self.level_1_far, self.level_2_far, self.level_3_far, self.level_4_far]
    }
}
