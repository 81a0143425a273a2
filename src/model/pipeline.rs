//! Photograph to tree model: every stage of She §2.3 in order, with its time, its warnings and its intermediate products.

use std::time::Instant;

use serde::Serialize;

use crate::crown::{self, Crown, CrownParams, Outline};
use crate::photo::segment::segment;
use crate::photo::{Exemplar, ExemplarParams, Hints, Photo, SegmentParams, Segmentation, Silhouette, SilhouetteParams, TrunkCues};
use crate::photo::{exemplar, silhouette, trunk};
use crate::texture::{self, Atlas, Front, SynthParams};
use crate::{Result, Seed, Warning};

use super::{About, ModelCrown, TreeModel, Trunk};

crate::params! {
    /// The tree's size.
    pub struct SizeParams {
        /// Height of the whole tree, from the foot of the trunk to the top of the crown.
        height_m: f64 = 10.0, in 0.05..=200.0, unit "m", source "ours: a guess, and said to be one when it is not given";
    }
}

/// The parameters of every stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ModelParams {
    /// Which pixels are the crown.
    pub segment: SegmentParams,
    /// Outline and turning points.
    pub silhouette: SilhouetteParams,
    /// Outline to closed surface.
    pub crown: CrownParams,
    /// The square of foliage.
    pub exemplar: ExemplarParams,
    /// Texture synthesis and baking.
    pub texture: SynthParams,
    /// Real-world size.
    pub size: SizeParams,
}

/// One photograph of the tree.
#[derive(Debug, Clone)]
pub struct View {
    /// Its pixels.
    pub photo: Photo,
    /// What a person said about it.
    pub hints: Hints,
    /// Where it was taken from: 0 is the front (+Z), counter-clockwise seen from above, radians.
    pub azimuth_rad: f64,
}

/// What one photograph gave.
#[derive(Debug)]
pub struct ViewProducts {
    /// Masks.
    pub segmentation: Segmentation,
    /// Outline.
    pub silhouette: Silhouette,
    /// Trunk, where visible.
    pub trunk: Option<TrunkCues>,
    /// Where the tree stands: the origin of object space, pixels.
    pub foot_px: glam::DVec2,
    /// Scale of the picture.
    pub metres_per_px: f64,
}

/// The tree model and everything that led to it.
#[derive(Debug)]
pub struct ModelRun {
    /// The result.
    pub model: TreeModel,
    /// Per photograph.
    pub views: Vec<ViewProducts>,
    /// Surfaces with their point clouds.
    pub crowns: Vec<Crown>,
    /// The square of foliage.
    pub exemplar: Exemplar,
    /// One baked texture per crown, with the figures of its seams.
    pub atlases: Vec<Atlas>,
    /// Milliseconds per stage, in order.
    pub stages_ms: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// What to model.
#[derive(Debug)]
pub struct Request<'a> {
    /// At least one photograph; the first gives scale and texture.
    pub views: &'a [View],
    /// Of every stage.
    pub params: &'a ModelParams,
    /// Whether `params.size.height_m` is known rather than guessed.
    pub height_is_given: bool,
    /// Of every random choice.
    pub seed: Seed,
    /// Name of the first photograph's file, kept in the model.
    pub source: String,
}

/// The stages that [`run`] announces, and the writing that follows it.
pub const STAGES: [&str; 6] = ["segment", "silhouette", "crown", "exemplar", "texture", "write"];

/// Runs every stage. `step` is called with each stage's name when it is done.
///
/// # Errors
/// Those of the stages; nothing is written here.
pub fn run(request: &Request, step: &dyn Fn(&str)) -> Result<ModelRun> {
    let Request { views, params, seed, .. } = *request;
    let mut clock = Clock { started: Instant::now(), stages_ms: Vec::new(), step };
    let mut warnings = Vec::new();

    let segmentations: Vec<Segmentation> =
        views.iter().map(|view| segment(&view.photo, &params.segment, &view.hints)).collect::<Result<_>>()?;
    clock.done(STAGES[0]);

    let products: Vec<ViewProducts> = views
        .iter()
        .zip(segmentations)
        .map(|(view, segmentation)| ViewProducts::of(&view.photo, segmentation, params))
        .collect::<Result<_>>()?;
    for product in &products {
        warnings.extend(product.segmentation.warnings.iter().cloned());
    }
    if !request.height_is_given {
        warnings.push(Warning::new("height-guessed", format!("the tree's height is a guess of {} m; give it with --height-m", params.size.height_m)));
    }
    let outlines: Vec<Outline> = products
        .iter()
        .zip(views)
        .map(|(p, view)| Outline::from_silhouette(&p.silhouette, p.foot_px, p.metres_per_px, view.azimuth_rad))
        .collect();
    clock.done(STAGES[1]);

    let crowns = crown::build(&outlines, &params.crown, seed)?;
    clock.done(STAGES[2]);

    let (first, photo) = (&products[0], &views[0].photo);
    let masks = &first.segmentation;
    let texels_per_m = texture::texels_per_m(&crowns, &params.texture);
    let exemplar = exemplar::choose(photo, &masks.crown, &masks.gaps, &params.exemplar, texels_per_m * first.metres_per_px)?;
    clock.done(STAGES[3]);

    let front = Front { image: &photo.image, crown: &masks.crown, gaps: &masks.gaps, foot_px: first.foot_px, metres_per_px: first.metres_per_px };
    let atlases: Vec<Atlas> = crowns
        .iter()
        .map(|crown| texture::cover(&crown.mesh, crown.center, &exemplar, texels_per_m, &front, &params.texture, seed))
        .collect::<Result<_>>()?;
    clock.done(STAGES[4]);

    let model = TreeModel {
        crowns: crowns.iter().zip(&atlases).map(|(crown, atlas)| ModelCrown::new(crown, atlas)).collect(),
        trunk: Some(Trunk::build(first.trunk.as_ref(), first.foot_px, first.metres_per_px, &crowns, params.size.height_m)?),
        about: About::of(request, first, &exemplar)?,
    };
    Ok(ModelRun { model, views: products, crowns, exemplar, atlases, stages_ms: clock.stages_ms, warnings })
}
