//! The contact sheet of representations: one row per method beside the tree itself, 3, 10 and 30 tree heights away, from the side, from
//! 45° above and from straight above.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};

use crate::Result;
use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::render::{Background, Camera, Projection, Renderer, Shot, Stand, Tree};
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

/// What a picture from any side has to show to both sides of the middle, metres.
fn half_extent(bounds: Bounds) -> f32 {
    0.62 * bounds.size().max_element()
}

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
    let height_m = bounds.height_m();
    let distance_m = distance * height_m;
    let side_px = (2.0 * half_extent(bounds) * REFERENCE_FOCAL_PX / distance_m).ceil().clamp(8.0, 2048.0);
    let orbit = Camera::orbit(bounds.center(), azimuth_deg.to_radians(), elevation_deg.to_radians(), distance_m);
    let near_m = (0.02 * distance_m).min(0.1 * height_m);
    let fov_y_rad = 2.0 * (0.5 * side_px / REFERENCE_FOCAL_PX).atan();
    let camera = Camera { projection: Projection::Perspective { fov_y_rad, near_m }, ..orbit };
    let shot = Shot { background: Background::Alpha, ..Shot::new(camera, [side_px as u32; 2]) };
    Ok(renderer.picture(&shot, &[Stand { tree, instances: &[Instance::IDENTITY] }])?.color)
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
