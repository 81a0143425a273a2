//! Contact sheets: one row per photograph — photograph | mask | mesh from the front | textured from the front, side and 45° above.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3};
use image::RgbImage;

use crate::Result;
use crate::geom::Surface;
use crate::model::pipeline::ModelRun;
use crate::model::{Part, TreeModel};
use crate::raster::{Light, Material, View, render, to_linear};

use super::draw;

/// Light of every preview: from the upper left behind the viewer, as in most photographs.
const LIGHT: Light = Light { toward_sun: Vec3::new(-0.5, 0.8, 0.6), ambient: 0.55 };

/// Sky of every preview.
const BACKGROUND: [u8; 3] = [225, 233, 240];

/// A row for one photograph and its model, `height_px` high.
///
/// # Errors
/// Those of the rasteriser.
pub fn row(photo: &RgbImage, run: &ModelRun, height_px: u32) -> Result<RgbImage> {
    let masked = draw::over_photo(photo, &run.views[0].segmentation.crown);
    let mut panels =
        vec![draw::to_height(photo, height_px), draw::to_height(&masked, height_px), untextured(&run.model, height_px)?];
    for (azimuth_rad, elevation_rad) in [(0.0, 0.0), (FRAC_PI_2, 0.0), (FRAC_PI_4, FRAC_PI_4)] {
        panels.push(picture(&run.model, azimuth_rad, elevation_rad, height_px)?);
    }
    Ok(draw::side_by_side(&panels, 6))
}

/// A square picture of the model from one side.
///
/// # Errors
/// Those of the rasteriser.
pub fn picture(model: &TreeModel, azimuth_rad: f32, elevation_rad: f32, size_px: u32) -> Result<RgbImage> {
    let crowns = model.crowns.iter().map(|c| (&c.surface, Material { texture: Some(&c.texture), ..Material::default() }));
    let trunk = model.trunk.iter().map(|t| (&t.surface, Material { factor: bark(t.bark), ..Material::default() }));
    let surfaces: Vec<(&Surface, Material)> = crowns.chain(trunk).collect();
    let view = View::around(points(model), azimuth_rad, elevation_rad, size_px, size_px);
    Ok(draw::opaque(&render(&surfaces, &view, Some(&LIGHT))?.over(BACKGROUND)))
}

/// A row for a grown tree: front, side, 45° above, bare wood; one scale in all of them.
///
/// # Errors
/// Those of the rasteriser.
pub fn grown_row(parts: &[Part], size_px: u32) -> Result<RgbImage> {
    let bare: Vec<Part> = parts.iter().filter(|part| part.material.alpha_cutoff.is_none()).cloned().collect();
    let sides = [(parts, 0.0, 0.0), (parts, FRAC_PI_2, 0.0), (parts, FRAC_PI_4, FRAC_PI_4), (&bare, 0.0, 0.0)];
    // What the tree needs from the side where it is widest.
    let half_m =
        sides.iter().map(|(_, azimuth, elevation)| around(parts, *azimuth, *elevation, size_px).half_size_m.y).fold(0.0, f32::max);
    let panels = sides.iter().map(|(shown, azimuth, elevation)| {
        let view = View { half_size_m: Vec2::splat(half_m), ..around(parts, *azimuth, *elevation, size_px) };
        let surfaces: Vec<(&Surface, Material)> = shown.iter().map(|part| (&part.surface, part.material.raster())).collect();
        Ok(draw::opaque(&render(&surfaces, &view, Some(&LIGHT))?.over(BACKGROUND)))
    });
    Ok(draw::side_by_side(&panels.collect::<Result<Vec<_>>>()?, 6))
}

fn around(parts: &[Part], azimuth_rad: f32, elevation_rad: f32, size_px: u32) -> View {
    let points = parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied());
    View::around(points, azimuth_rad, elevation_rad, size_px, size_px)
}

/// The surfaces from the front without their textures: shape alone.
fn untextured(model: &TreeModel, size_px: u32) -> Result<RgbImage> {
    let clay = Material { factor: [0.55, 0.55, 0.5, 1.0], ..Material::default() };
    let surfaces: Vec<(&Surface, Material)> =
        model.crowns.iter().map(|c| &c.surface).chain(model.trunk.iter().map(|t| &t.surface)).map(|s| (s, clay)).collect();
    // Faceted shading would need split vertices; a low sun shows the shape as well.
    let light = Light { toward_sun: Vec3::new(-1.0, 0.5, 0.5), ambient: 0.2 };
    let view = View::around(points(model), 0.0, 0.0, size_px, size_px);
    Ok(draw::opaque(&render(&surfaces, &view, Some(&light))?.over(BACKGROUND)))
}

/// A bark colour in linear light.
fn bark(srgb: [u8; 3]) -> [f32; 4] {
    let [r, g, b] = srgb.map(to_linear);
    [r, g, b, 1.0]
}

fn points(model: &TreeModel) -> impl Iterator<Item = Vec3> {
    let surfaces = model.crowns.iter().map(|c| &c.surface).chain(model.trunk.iter().map(|t| &t.surface));
    surfaces.flat_map(|s| s.mesh.positions.iter().copied())
}
