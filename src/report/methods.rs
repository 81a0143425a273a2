//! The contact sheet of representations: one row per method beside the tree itself, 3, 10 and 30 tree heights away, from the side, from
//! 45° above and from straight above.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

use crate::Result;
use crate::compare::{Stage, View};
use crate::geom::Bounds;
use crate::render::{Background, Renderer, Shot, Tree};
use crate::repr::REFERENCE_FOCAL_PX;

use super::draw;

/// Distances, tree heights.
pub const DISTANCES: [f32; 3] = [3.0, 10.0, 30.0];
/// Elevations, degrees.
pub const ELEVATIONS_DEG: [f32; 3] = [0.0, 45.0, 90.0];
/// Sides of the panels of each distance on the sheet, pixels. What is far off is shown larger than it would be, pixel by pixel.
const PANELS_PX: [u32; 3] = [240, 150, 100];
/// What stands behind the trees, sRGB.
const PAPER: [u8; 3] = [214, 224, 232];

/// The tree as a viewer sees it who is `distance` tree heights away from its middle, at [`REFERENCE_FOCAL_PX`]: a square picture, transparent
/// where nothing is.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn seen_from(
    renderer: &mut Renderer,
    tree: &Tree,
    bounds: Bounds,
    distance: f32,
    azimuth_deg: f32,
    elevation_deg: f32,
) -> Result<image::RgbaImage> {
    let stage = Stage { bounds };
    let (camera, side_px) = stage.camera(View { azimuth_deg, elevation_deg }, REFERENCE_FOCAL_PX / distance);
    let shot = Shot { background: Background::Alpha, ..Shot::new(camera, [side_px; 2]) };
    Ok(stage.see(renderer, tree, &shot)?.color)
}

/// A row of the sheet.
///
/// # Errors
/// Those of [`seen_from`].
pub fn row(renderer: &mut Renderer, tree: &Tree, bounds: Bounds) -> Result<RgbImage> {
    let mut panels = vec![];
    for (distance, side_px) in DISTANCES.into_iter().zip(PANELS_PX) {
        for elevation_deg in ELEVATIONS_DEG {
            let picture = seen_from(renderer, tree, bounds, distance, 20.0, elevation_deg)?;
            let filter = if picture.width() > side_px { FilterType::Triangle } else { FilterType::Nearest };
            panels.push(imageops::resize(&crate::metrics::over(&picture, PAPER), side_px, side_px, filter));
        }
    }
    Ok(draw::side_by_side(&panels, 4))
}

/// A row in place of one that could not be made: a grey bar of its height.
pub fn missing() -> RgbImage {
    let width = 3 * PANELS_PX.iter().sum::<u32>() + 4 * 8;
    RgbImage::from_pixel(width, 24, Rgb([180; 3]))
}
