//! Closing the circle: a model of a photograph against the true tree that the photograph showed. Silhouettes of the crowns, holes
//! filled, in parallel projection and in metres, both standing on the same foot. Ours.

use glam::Vec3;

use crate::Result;
use crate::gpu::layout::Instance;
use crate::metrics::silhouette;
use crate::model::reference::ReferenceTree;
use crate::model::{Part, TreeModel};
use crate::photo::SilhouetteParams;
use crate::raster::Mask;
use crate::render::{Background, Camera, Projection, Renderer, Shot, Stage, Stand, Tree};

/// Side of the pictures that are compared, pixels.
const SIDE_PX: u32 = 480;
/// Half of what they show, in extents of the tree.
const HALF_EXTENTS: f32 = 0.6;

/// Intersection over union of the crowns' silhouettes from each azimuth, radians. `photographed_rad` is the azimuth of the true tree that
/// the model takes for its front.
///
/// # Errors
/// Those of the renderer.
pub fn agreement(
    renderer: &mut Renderer,
    truth: &ReferenceTree,
    model: &TreeModel,
    photographed_rad: f32,
    azimuths_rad: &[f32],
) -> Result<Vec<f64>> {
    let crowns: Vec<Part> = model.parts().into_iter().filter(|part| part.crown_center.is_some()).collect();
    let made = renderer.upload(&crowns)?.growing(model.about.growth);
    let grown = renderer.upload(&truth.foliage)?;
    let ious = azimuths_rad.iter().map(|azimuth| {
        let found = outline(renderer, &made, truth, azimuth - photographed_rad)?;
        Ok(found.iou(&outline(renderer, &grown, truth, *azimuth)?))
    });
    ious.collect()
}

/// The height that a surveyor finds from that side, metres: the top of the crown's silhouette, without leaves that hang by themselves.
///
/// # Errors
/// Those of the renderer.
pub fn surveyed_height_m(renderer: &mut Renderer, truth: &ReferenceTree, azimuth_rad: f32) -> Result<f64> {
    let grown = renderer.upload(&truth.foliage)?;
    let crown = outline(renderer, &grown, truth, azimuth_rad)?.without_crumbs(SilhouetteParams::default().min_piece);
    let Some(area) = crown.bounds() else { return Ok(f64::from(truth.bounds.height_m())) };
    let top = 1.0 - 2.0 * f64::from(area.y) / f64::from(SIDE_PX);
    Ok(f64::from(truth.bounds.center().y - truth.bounds.foot_y()) + top * f64::from(half_height_m(truth)))
}

fn half_height_m(truth: &ReferenceTree) -> f32 {
    HALF_EXTENTS * truth.bounds.size().max_element().max(1e-3)
}

/// The silhouette from `azimuth_rad`, within a square around the true tree.
fn outline(renderer: &mut Renderer, tree: &Tree, truth: &ReferenceTree, azimuth_rad: f32) -> Result<Mask> {
    let half_height_m = half_height_m(truth);
    let middle = Vec3::new(0.0, truth.bounds.center().y, 0.0);
    let distance_m = 8.0 * half_height_m;
    let projection = Projection::Orthographic { half_height_m, near_m: 1e-3 * distance_m, far_m: 2.0 * distance_m };
    let camera = Camera { projection, ..Camera::orbit(middle, azimuth_rad, 0.0, distance_m) };
    let shot = Shot { stage: Stage::Reshaped, background: Background::Alpha, ..Shot::new(camera, [SIDE_PX; 2]) };
    let picture = renderer.picture(&shot, &[Stand { tree, instances: &[Instance::IDENTITY] }])?;
    Ok(silhouette(&picture.color).without_holes())
}
