//! Does the model look like its photograph? Drawn from where the photographer stood and laid beside it.
//!
//! The crown's outline was traced in parallel projection, so the comparison is made in it, too.

use glam::Vec3;
use image::{RgbImage, RgbaImage, imageops};

use crate::Result;
use crate::gpu::layout::Instance;
use crate::model::Part;
use crate::model::pipeline::ModelRun;
use crate::photo::{Photo, exemplar};
use crate::raster::{Mask, color_difference};
use crate::render::{Background, Camera, Projection, Renderer, Shot, Stage, Stand};

use super::draw;

/// How a model and its photograph agree.
#[derive(Debug)]
pub struct Resemblance {
    /// Intersection over union of the drawn crown's silhouette, outline grown, with that of the mask that was used: both without holes.
    pub iou: f64,
    /// The same, gaps left open in both.
    pub iou_with_gaps: f64,
    /// The same without holes, outline not grown.
    pub iou_unshaped: f64,
    /// CIEDE2000 between the means of the drawn crown, unlit, and of the photographed one.
    pub delta_e: f64,
    /// Photograph | the model, lit, from the photograph's viewpoint | the same over the photograph's own surroundings.
    pub picture: RgbImage,
}

/// Height at which the comparison is made, pixels.
const HEIGHT_PX: u32 = 480;

/// Compares the first view of a run with its photograph.
///
/// # Errors
/// Those of the renderer.
pub fn measure(renderer: &mut Renderer, photo: &Photo, run: &ModelRun) -> Result<Resemblance> {
    let parts = run.model.parts();
    let (crowns, _): (Vec<Part>, Vec<Part>) = parts.iter().cloned().partition(|part| part.crown_center.is_some());
    let size_px = [(photo.image.width() * HEIGHT_PX).div_ceil(photo.image.height()), HEIGHT_PX];
    let masks = &run.views[0].segmentation;
    let seen = masks.crown.zip(&masks.gaps, |crown, gap| crown && !gap);

    let crown = renderer.upload(&crowns)?.growing(run.model.about.growth);
    let place = [Instance::IDENTITY];
    let mut unlit = |stage| {
        let shot = Shot { stage, background: Background::Alpha, ..shot(photo, run, size_px) };
        Ok::<_, crate::Error>(renderer.picture(&shot, &[Stand { tree: &crown, instances: &place }])?.color)
    };
    let (drawn, unshaped) = (unlit(Stage::Antialiased)?, unlit(Stage::Unshaped)?);
    let covered = |image: &RgbaImage| Mask::from_fn(size_px[0], size_px[1], |x, y| image.get_pixel(x, y)[3] >= 128);
    let silhouette = at_size(&masks.crown, size_px).without_holes();
    let delta_e = exemplar::opaque_mean(&drawn)
        .zip(exemplar::encoded_mean(&photo.image, &masks.crown, &masks.gaps))
        .map_or(f64::INFINITY, |(a, b)| color_difference(a, b));

    let tree = renderer.upload(&parts)?.growing(run.model.about.growth);
    let stands = [Stand { tree: &tree, instances: &place }];
    let scene = renderer.picture(&shot(photo, run, size_px), &stands)?.color;
    let cut = renderer.picture(&Shot { background: Background::Alpha, ..shot(photo, run, size_px) }, &stands)?.color;
    let small = draw::to_height(&photo.image, HEIGHT_PX);
    let mut inside =
        image::DynamicImage::from(imageops::resize(&small, size_px[0], size_px[1], imageops::FilterType::Triangle)).into_rgba8();
    imageops::overlay(&mut inside, &cut, 0, 0);
    let picture = draw::side_by_side(&[small, draw::opaque(&scene), draw::opaque(&inside)], 6);
    Ok(Resemblance {
        iou: covered(&drawn).without_holes().iou(&silhouette),
        iou_with_gaps: covered(&drawn).iou(&at_size(&seen, size_px)),
        iou_unshaped: covered(&unshaped).without_holes().iou(&silhouette),
        delta_e,
        picture,
    })
}

/// The photograph's own view of the model.
fn shot(photo: &Photo, run: &ModelRun, size_px: [u32; 2]) -> Shot {
    let view = &run.views[0];
    let (width, height) = (f64::from(photo.image.width()), f64::from(photo.image.height()));
    let middle = Vec3::new(
        ((0.5 * width - view.foot_px.x) * view.metres_per_px) as f32,
        ((view.foot_px.y - 0.5 * height) * view.metres_per_px) as f32,
        0.0,
    );
    let half_height_m = (0.5 * height * view.metres_per_px) as f32;
    let distance_m = 4.0 * half_height_m;
    let projection = Projection::Orthographic { half_height_m, near_m: 0.01 * distance_m, far_m: 2.0 * distance_m };
    Shot::new(Camera { projection, ..Camera::orbit(middle, 0.0, 0.0, distance_m) }, size_px)
}

/// A mask reduced: inside where more than half of the area is.
fn at_size(mask: &Mask, [width, height]: [u32; 2]) -> Mask {
    let reduced = imageops::resize(&mask.to_gray(), width, height, imageops::FilterType::Triangle);
    Mask::from_fn(width, height, |x, y| reduced.get_pixel(x, y)[0] >= 128)
}
