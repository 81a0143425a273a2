//! A model at a glance: from the front as in its photograph, from its right, and from 45° above.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;
use image::RgbImage;

use crate::Result;
use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::model::TreeModel;
use crate::render::{Camera, Renderer, Shot, Stand};

use super::draw;

/// Side of each of the three pictures, pixels.
const SIDE_PX: u32 = 512;

/// Azimuth and elevation of each.
const VIEWS: [(f32, f32); 3] = [(0.0, 0.05), (FRAC_PI_2, 0.05), (FRAC_PI_4, FRAC_PI_4)];

/// The three pictures side by side.
///
/// # Errors
/// Those of the renderer.
pub fn preview(renderer: &mut Renderer, model: &TreeModel) -> Result<RgbImage> {
    let parts = model.parts();
    let points: Vec<Vec3> = parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied()).collect();
    let target = Bounds::of(points.iter().copied()).map_or(Vec3::ZERO, |b| b.center());
    let tree = renderer.upload(&parts)?.growing(model.about.growth);
    let panels = VIEWS.iter().map(|&(azimuth_rad, elevation_rad)| {
        let distance_m = Camera::fitting_distance_m(&points, target, azimuth_rad, elevation_rad, 1.0);
        let shot = Shot::new(Camera::orbit(target, azimuth_rad, elevation_rad, distance_m), [SIDE_PX; 2]);
        let picture = renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }])?.color;
        Ok(draw::opaque(&picture))
    });
    Ok(draw::side_by_side(&panels.collect::<Result<Vec<_>>>()?, 4))
}
