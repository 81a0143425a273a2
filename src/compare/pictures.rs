//! Where the pictures of a comparison lie: of each method those from the first azimuth of each elevation, and strips of its motion.

use std::path::Path;

use image::RgbaImage;

use crate::raster::{PngEffort, png_with};
use crate::{Result, files};

use super::plan::{Plan, Sun, View};

/// Folder of the truth's pictures.
pub const TRUTH_FOLDER: &str = "truth";

/// One picture to be taken.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Its number among all of a plan.
    pub number: usize,
    /// Which of [`Plan::views`].
    pub view_number: usize,
    /// That view.
    pub view: View,
    /// Whether it is that of the photograph which is the truth.
    pub photographed: bool,
    /// How many pixels high the tree is.
    pub height_px: f32,
    /// Which of [`Plan::suns`].
    pub sun_number: usize,
    /// That sun.
    pub sun: Sun,
}

/// Every picture of a plan, in order: distance by distance, light by light, view by view.
pub fn looks(plan: &Plan) -> Vec<Look> {
    let lights = plan.heights_px.iter().flat_map(|&height_px| (0..plan.suns.len()).map(move |sun| (height_px, sun)));
    let each = lights.flat_map(|(height_px, sun)| (0..plan.views.len()).map(move |view| (height_px, sun, view)));
    let look = |(number, (height_px, sun_number, view_number)): (usize, (f32, usize, usize))| Look {
        number,
        view_number,
        view: plan.views[view_number],
        photographed: plan.photographed == Some(view_number),
        height_px,
        sun_number,
        sun: plan.suns[sun_number],
    };
    each.enumerate().map(look).collect()
}

/// Where the picture of a look lies within the folder of a comparison.
pub fn path_of(method: &str, view: View, height_px: f32, sun: usize) -> String {
    format!("pictures/{method}/{}", file_of(view, height_px, sun))
}

/// Its name within the method's folder.
pub fn file_of(view: View, height_px: f32, sun: usize) -> String {
    format!("e{:.0}_h{height_px:.0}_s{sun}.png", view.elevation_deg)
}

/// Keeps the picture of a look, where it goes into the report.
///
/// # Errors
/// Those of [`files`].
pub fn keep(folder: &Path, plan: &Plan, method: &str, look: &Look, picture: &RgbaImage) -> Result<()> {
    if !plan.is_first(look.view_number) {
        return Ok(());
    }
    write(&folder.join(path_of(method, look.view, look.height_px, look.sun_number)), picture)
}

/// Writes a picture, with the folder that it goes to.
///
/// # Errors
/// Those of [`files`].
pub fn write(path: &Path, picture: &RgbaImage) -> Result<()> {
    let _folder = files::ready_folder(path.parent().unwrap_or(path))?;
    files::write_whole(path, &png_with(picture, PngEffort::Small)?)
}
