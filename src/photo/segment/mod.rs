//! Segmentation: which pixels are the crown (She §3.1, fig. 7).

use crate::raster::{Mask, Rect};
use crate::{Error, Result, Warning};

use super::Photo;
use bits::Bits;
use features::Scene;
use small::Small;

mod auto;
mod bits;
pub mod features;
mod ellipse;
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
    /// Hue range in degrees, low ≤ high, overriding the method's own.
    pub hue_deg: Option<(f64, f64)>,
}

impl Hints {
    /// Checks every hint against a picture of the given size.
    fn validate(&self, width: u32, height: u32) -> Result<()> {
        let refuse = |flag, expected: String, found: String| Err(Error::Hint { flag, expected, found });
        if let Some((low, high)) = self.hue_deg
            && !(0.0 <= low && low <= high && high <= 360.0)
        {
            return refuse("--hue", "LO..HI with 0 ≤ LO ≤ HI ≤ 360 degrees".into(), format!("{low}..{high}"));
        }
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
    let small = Small::new(&photo.image);
    refuse_blank(&small)?;
    let scene = Scene::new(small);
    let mut result = match (&hints.mask, params.method) {
        (Some(mask), _) => from_mask(mask),
        (None, Method::Hsv) => by_hue(photo, params, hints)?,
        (None, Method::Auto) => by_looks(photo, &scene, hints)?,
    };
    complete(photo, &scene, hints, &mut result);
    Ok(result)
}

/// Refuses a picture that is nothing but one colour.
fn refuse_blank(small: &Small) -> Result<()> {
    let colours = |c: usize| small.lab.iter().map(move |p| p[c]);
    let spread = (0..3).map(|c| colours(c).fold(f32::MIN, f32::max) - colours(c).fold(f32::MAX, f32::min)).fold(0.0, f32::max);
    if spread < 4.0 { Err(Error::NothingToSee { what: "one colour" }) } else { Ok(()) }
}

/// A crown so far, without trunk, gaps and warnings.
fn bare(crown: &Bits, steps: Vec<(&'static str, Mask)>, hue_deg: (f64, f64)) -> Segmentation {
    let crown = crown.to_mask();
    let empty = Mask::new(crown.width(), crown.height());
    Segmentation { tree: empty.clone(), gaps: empty, crown, steps, hue_deg, warnings: Vec::new() }
}

/// The crown as a person drew it.
fn from_mask(mask: &Mask) -> Segmentation {
    let crown = Bits::from_mask(mask).largest_component().fill_holes();
    bare(&crown, vec![("given mask", mask.clone())], (0.0, 360.0))
}

/// The paper's method.
fn by_hue(photo: &Photo, params: &SegmentParams, hints: &Hints) -> Result<Segmentation> {
    let range = hints.hue_deg.unwrap_or(hsv::HUE_OF_SHE_DEG);
    let found = hsv::segment(&photo.image, range, params.opening_px, params.closing_px);
    let steps = vec![("threshold", found.threshold.to_mask()), ("opening", found.opened.to_mask()), ("closing", found.closed.to_mask())];
    Ok(bare(&found.crown, steps, range))
}

/// Our own.
fn by_looks(photo: &Photo, scene: &Scene, hints: &Hints) -> Result<Segmentation> {
    let size = photo.image.dimensions();
    let found = auto::find(scene, hints, photo.opaque.as_ref(), size);
    let crown = refine::refine(&photo.image, &scene.small, &found.crown);
    let steps = vec![("evidence", enlarge(&found.evidence, &scene.small, size)), ("shape", enlarge(&found.crown, &scene.small, size))];
    Ok(bare(&crown, steps, (0.0, 360.0)))
}

/// A set of reduced pixels at the photograph's size.
fn enlarge(set: &[bool], small: &Small, (width, height): (u32, u32)) -> Mask {
    let columns: Vec<usize> = (0..width as usize).map(|x| x * small.width / width as usize).collect();
    let mut mask = Mask::new(width, height);
    for (y, row) in mask.as_raw_mut().chunks_mut(width as usize).enumerate() {
        let from = &set[y * small.height / height as usize * small.width..][..small.width];
        row.iter_mut().zip(&columns).for_each(|(v, &x)| *v = 255 * u8::from(from[x]));
    }
    mask
}

/// Adds trunk, gaps, outline and warnings.
fn complete(photo: &Photo, scene: &Scene, _hints: &Hints, result: &mut Segmentation) {
    let size = photo.image.dimensions();
    let crown: Vec<bool> = Small::new_mask(&result.crown, &scene.small);
    let trunk: Vec<bool> = trunk::with_trunk(&scene.small, &crown).iter().zip(&crown).map(|(t, c)| *t && !c).collect();
    result.tree = enlarge(&trunk, &scene.small, size).zip(&result.crown, |a, b| a || b);
}
