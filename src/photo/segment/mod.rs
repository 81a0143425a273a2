//! Segmentation: which pixels are the crown (She §3.1, fig. 7).

use crate::raster::{Mask, Rect};
use crate::{Error, Result, Warning};

use super::Photo;
use bits::Bits;
use features::Scene;
use small::Small;

mod auto;
mod bits;
mod ellipse;
pub mod features;
mod foliage;
mod gaps;
mod hsv;
pub mod model;
mod palette;
mod profile;
mod refine;
pub mod shape;
mod sky;
pub mod small;
mod trunk;
mod weights;

pub use hsv::{hue_deg, hue_name};

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
        /// Method hsv: radius of the opening that removes specks of foliage colour.
        opening_px: u32 = 2, in 0..=200, unit "px", source "ours: She §3.1 opens, but names no radius";
        /// Method hsv: radius of the closing that bridges gaps between leaves.
        closing_px: u32 = 4, in 0..=200, unit "px", source "ours: She §3.1 closes, but names no radius";
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
    /// Hue range in degrees, low ≤ high, overriding the method's own; reds lie on both sides of 0, so that low may be negative.
    pub hue_deg: Option<(f64, f64)>,
}

/// Checks a hue range in degrees.
///
/// # Errors
/// [`Error::Hint`] unless -180 ≤ low ≤ high ≤ 360 and the range is no more than the whole circle.
pub fn check_hue((low, high): (f64, f64)) -> Result<()> {
    if -180.0 <= low && low <= high && high <= 360.0 && high - low <= 360.0 {
        return Ok(());
    }
    let expected = "LO..HI with -180 ≤ LO ≤ HI ≤ 360 degrees, at most 360 apart (reds across 0 are -20..20)";
    Err(Error::Hint { flag: "--hue", expected: expected.into(), found: format!("{low}..{high}") })
}

impl Hints {
    /// Checks every hint against a picture of the given size.
    fn validate(&self, width: u32, height: u32) -> Result<()> {
        let refuse = |flag, expected: String, found: String| Err(Error::Hint { flag, expected, found });
        self.hue_deg.map_or(Ok(()), check_hue)?;
        if let Some(r) = self.rect {
            let fits = |start: u32, length: u32, size: u32| length > 0 && u64::from(start) + u64::from(length) <= u64::from(size);
            if !fits(r.x, r.width, width) || !fits(r.y, r.height, height) {
                let found = format!("{},{},{},{}", r.x, r.y, r.width, r.height);
                return refuse("--rect", format!("X,Y,W,H, not empty and inside the picture of {width}×{height} pixels"), found);
            }
        }
        for (flag, points) in [("--include", &self.include), ("--exclude", &self.exclude)] {
            if let Some((x, y)) = points.iter().find(|(x, y)| *x >= width || *y >= height) {
                return refuse(flag, format!("inside the picture of {width}×{height} pixels"), format!("{x},{y}"));
            }
        }
        match &self.mask {
            Some(m) if (m.width(), m.height()) != (width, height) => {
                Err(Error::MaskSize { what: "mask", expected: (width, height), found: (m.width(), m.height()) })
            }
            Some(m) if m.count() == 0 => refuse("--mask", "a picture of the crown, white on black".into(), "empty".into()),
            _ => Ok(()),
        }
    }
}

/// The pixels of one tree.
#[derive(Debug, Clone)]
pub struct Segmentation {
    /// The crown, holes filled: one component; with method hsv those that included points chose, with a given mask its own.
    pub crown: Mask,
    /// The crown and the trunk below it.
    pub tree: Mask,
    /// Sky seen through the crown: a subset of `crown`.
    pub gaps: Mask,
    /// The steps of fig. 7 in order, for people to look at: name and mask, reduced to at most 1024 pixels a side.
    pub steps: Vec<(&'static str, Mask)>,
    /// Method hsv: the hue range that was used; auto: that of the crown's own foliage, 5th to 95th percentile (reds may begin below 0).
    /// Degrees.
    pub hue_deg: (f64, f64),
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Fewest rows and columns that can hold a crown.
const SMALLEST_PX: u32 = 16;

/// Finds the crown.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Hint`] and [`Error::MaskSize`] for what the user got wrong; [`Error::PictureTooSmall`],
/// [`Error::NothingToSee`], [`Error::NoFoliage`] and [`Error::Leafless`] for photographs without a crown.
pub fn segment(photo: &Photo, params: &SegmentParams, hints: &Hints) -> Result<Segmentation> {
    crate::params::ParamSet::validate(params)?;
    let (width, height) = photo.image.dimensions();
    if width < SMALLEST_PX || height < SMALLEST_PX {
        return Err(Error::PictureTooSmall { width, height });
    }
    hints.validate(width, height)?;
    let opaque = photo.opaque.as_ref().filter(|m| (m.width(), m.height()) == (width, height));
    // A cut-out with nothing cut out, or with nothing left, says nothing.
    let opaque = opaque.filter(|m| (0.02..=0.98).contains(&(m.count() as f64 / (f64::from(width) * f64::from(height)))));
    let range = hints.hue_deg.unwrap_or(hsv::HUE_OF_SHE_DEG);
    let by_hue_alone = hints.mask.is_none() && params.method == Method::Hsv;
    // The hue steps need nothing of the scene and leave cores idle: both at once.
    let (scene, steps) = rayon::join(
        || Scene::new(Small::new(&photo.image)),
        || {
            by_hue_alone.then(|| {
                hsv::segment(&photo.image, range, params.opening_px, params.closing_px, allowed(photo, hints, opaque).as_ref())
            })
        },
    );
    refuse_blank(&scene.small)?;
    let found = match (&hints.mask, steps) {
        (Some(mask), _) => from_mask(mask, &scene),
        (None, Some(steps)) => by_hue(photo, &scene, steps, range, hints)?,
        (None, None) => by_looks(photo, &scene, hints, opaque)?,
    };
    let mut segmentation = complete(photo, &scene, found);
    for &(x, y) in hints.include.iter().filter(|&&(x, y)| !segmentation.crown.get(x.into(), y.into())) {
        let message = format!(
            "the crown that was found does not reach --include {x},{y}; point between it and the crown too, or give --mask"
        );
        segmentation.warnings.push(Warning::new("hint-not-met", message));
    }
    Ok(segmentation)
}

/// Longest side of the steps that are kept for drawing.
const STEP_PX: usize = 1024;

/// Refuses a picture that is nothing but one colour.
fn refuse_blank(small: &Small) -> Result<()> {
    let colours = |c: usize| small.lab.iter().map(move |p| p[c]);
    let spread = (0..3).map(|c| colours(c).fold(f32::MIN, f32::max) - colours(c).fold(f32::MAX, f32::min)).fold(0.0, f32::max);
    if spread < 4.0 { Err(Error::NothingToSee { what: "one colour" }) } else { Ok(()) }
}

/// What a method found.
struct Found {
    crown: Bits,
    /// Whether a bare stalk at its lower end is trunk: what the paper's method finds is left as it is.
    has_stalk: bool,
    steps: Vec<(&'static str, Mask)>,
    hue_deg: (f64, f64),
}

/// Pieces of a crown that are smaller, as a part of the largest, are specks.
const CRUMB: f64 = 0.01;

/// The crown as a person drew it: one piece or several.
fn from_mask(mask: &Mask, scene: &Scene) -> Found {
    let crown = Bits::from_mask(mask).without_crumbs(CRUMB).fill_holes();
    let hue_deg = foliage::hue_range(scene, &Small::new_mask(&crown.to_mask(), &scene.small));
    Found { steps: vec![("given mask", crown.to_small_mask(STEP_PX))], crown, has_stalk: true, hue_deg }
}

/// The paper's method. A rectangle restricts what passes the threshold; points choose among the components.
fn by_hue(photo: &Photo, scene: &Scene, found: hsv::Steps, range: (f64, f64), hints: &Hints) -> Result<Found> {
    let between = format!("between {} and {} degrees of hue", range.0, range.1);
    if found.crown.count() == 0 {
        return Err(foliage::none(scene, format!(" {between}")));
    }
    let crown = match hints.include.is_empty() && hints.exclude.is_empty() {
        true => found.crown,
        false => {
            let finger_px = photo.image.width().max(photo.image.height()) / 50;
            hsv::chosen(&found.closed, &hints.include, &hints.exclude, finger_px).map_err(|(x, y)| Error::Hint {
                flag: "--include",
                expected: format!("on a patch of colour {between}, which --hue LO..HI can change"),
                found: format!("{x},{y}, where there is none"),
            })?
        }
    };
    if crown.count() == 0 {
        return Err(foliage::none(scene, format!(" {between} that no --exclude point removes")));
    }
    let steps = [("threshold", found.threshold), ("opening", found.opened), ("closing", found.closed)];
    let steps = steps.into_iter().map(|(name, bits)| (name, bits.to_small_mask(STEP_PX))).collect();
    Ok(Found { crown, has_stalk: false, steps, hue_deg: range })
}

/// Our own.
fn by_looks(photo: &Photo, scene: &Scene, hints: &Hints, opaque: Option<&Mask>) -> Result<Found> {
    let size = photo.image.dimensions();
    let found = auto::find(scene, hints, opaque, size);
    // Whoever points at the crown or names its colour has seen it.
    if hints.include.is_empty() && hints.hue_deg.is_none() {
        foliage::check(&photo.image, scene, &found.crown)?;
    }
    let crown = refine::refine(&photo.image, &scene.small, &found.crown, allowed(photo, hints, opaque).as_ref());
    let crown = obey(crown, hints, size.0.max(size.1) / 50);
    if crown.count() == 0 {
        return Err(foliage::none(scene, String::new()));
    }
    let steps = vec![("evidence", scene.small.to_mask(&found.evidence)), ("shape", scene.small.to_mask(&found.crown))];
    Ok(Found { crown, has_stalk: true, steps, hue_deg: foliage::hue_range(scene, &found.crown) })
}

/// Lets points overrule the picture also where the filling of holes or the refined outline went over them.
fn obey(crown: Bits, hints: &Hints, finger_px: u32) -> Bits {
    if hints.include.is_empty() && hints.exclude.is_empty() {
        return crown;
    }
    let with = hints.include.iter().fold(crown, |crown, &(x, y)| crown.or(&crown.disc(x, y, finger_px)));
    let without = hints.exclude.iter().fold(with, |crown, &(x, y)| crown.and(&crown.disc(x, y, finger_px).not()));
    without.largest_component()
}

/// Where the crown may lie at all; `None` is everywhere.
fn allowed(photo: &Photo, hints: &Hints, opaque: Option<&Mask>) -> Option<Bits> {
    if hints.rect.is_none() && opaque.is_none() {
        return None;
    }
    let (width, height) = photo.image.dimensions();
    let r = hints.rect.unwrap_or(Rect { x: 0, y: 0, width, height });
    let inside = |x: u32, y: u32| x >= r.x && y >= r.y && x - r.x < r.width && y - r.y < r.height;
    Some(Bits::from_mask(&Mask::from_fn(width, height, |x, y| inside(x, y) && opaque.is_none_or(|m| m.get(x.into(), y.into())))))
}

/// Adds trunk, gaps, the last steps of fig. 7 and warnings.
fn complete(photo: &Photo, scene: &Scene, found: Found) -> Segmentation {
    let size = photo.image.dimensions();
    let Found { crown: bits, has_stalk, mut steps, hue_deg } = found;
    let drawn = bits.to_mask();
    let (bits, tree) = match trunk::find(&photo.image, &drawn).map(|strip| strip.take_stalk(&bits)) {
        Some((strip, crown)) => {
            let crown = if has_stalk { crown } else { bits };
            let tree = crown.or(&strip.draw(size));
            (crown, tree)
        }
        None => (bits.clone(), bits),
    };
    let gaps = gaps::find(&photo.image, scene, &bits, &drawn).to_mask();
    let crown = bits.to_mask();
    steps.push(("crown", bits.to_small_mask(STEP_PX)));
    steps.push(("outline", bits.outline().to_small_mask(STEP_PX)));
    let warnings = warnings(&bits, size);
    Segmentation { tree: tree.to_mask(), gaps, crown, steps, hue_deg, warnings }
}

/// What the crown's place and size should tell the user.
fn warnings(crown: &Bits, (width, height): (u32, u32)) -> Vec<Warning> {
    let mut out = Vec::new();
    let sides = crown.frame_contact();
    // A few pixels at the frame are a twig; a fiftieth of a side is a crown that goes on.
    let cut = |(touching, length): (usize, u32)| touching as f64 > 0.02 * f64::from(length);
    let names: Vec<&str> = ["top", "bottom", "left", "right"]
        .into_iter()
        .zip([(sides[0], width), (sides[1], width), (sides[2], height), (sides[3], height)])
        .filter(|(_, s)| cut(*s))
        .map(|(n, _)| n)
        .collect();
    if !names.is_empty() {
        let message = format!("the crown is cut by the {} of the frame; what lies outside is not modelled", names.join(" and "));
        out.push(Warning::new("crown-cut-by-frame", message));
    }
    let share = crown.count() as f64 / (f64::from(width) * f64::from(height));
    if share < 0.02 {
        let message = format!("the crown fills only {:.2} % of the picture; crop it for a better texture", 100.0 * share);
        out.push(Warning::new("small-crown", message));
    }
    out
}

#[cfg(test)]
mod tests;
