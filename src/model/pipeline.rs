//! Photograph to tree model: every stage of She §2.3 in order, with its time, its warnings and its intermediate products.

use std::time::Instant;

use glam::{DVec2, Vec3};
use serde::Serialize;

use crate::crown::{self, Crown, CrownParams, Outline};
use crate::photo::segment::segment;
use crate::photo::{Exemplar, ExemplarParams, Hints, Photo, SegmentParams, Segmentation, Silhouette, SilhouetteParams, TrunkCues};
use crate::photo::{exemplar, roughness::Roughness, silhouette, trunk};
use crate::raster;
use crate::texture::{self, Atlas, BakeParams, Front, SynthParams, texels_per_m};
use crate::{Error, Result, Seed, Warning};

use super::{About, Growth, ModelCrown, Profile, ProfileParams, TreeModel, TrunkShape};

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
    /// Texture synthesis.
    pub texture: SynthParams,
    /// Atlas.
    pub bake: BakeParams,
    /// Real-world size.
    pub size: SizeParams,
    /// Growth of the outline.
    pub outline: ProfileParams,
}

/// One photograph of the tree.
#[derive(Debug, Clone)]
pub struct View {
    /// Its pixels.
    pub photo: Photo,
    /// What a person said about it.
    pub hints: Hints,
    /// Where it was taken from, radians, counter-clockwise seen from above. Only differences count: the first photograph's is the front
    /// (+Z) of the model.
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
    pub foot_px: DVec2,
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
    /// The square of foliage, per crown at the density of its atlas.
    pub exemplars: Vec<Exemplar>,
    /// One baked texture per crown, with the figures of its seams.
    pub atlases: Vec<Atlas>,
    /// How each crown's polygons came by their texture.
    pub texture_counts: Vec<texture::Counts>,
    /// Milliseconds per stage that [`run`] announces, in order.
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
    /// File names of the photographs, kept in the model.
    pub sources: Vec<String>,
}

impl Request<'_> {
    /// Where a photograph was taken from, seen from the first.
    fn azimuth_rad(&self, view: &View) -> f64 {
        view.azimuth_rad - self.views.first().map_or(0.0, |first| first.azimuth_rad)
    }
}

/// All stages from the files to the files, as progress and reports name them. [`run`] announces those from "segment" to "model":
/// decoding comes before it, the preview and writing (encoding the model, drawing, storing) after it.
pub const STAGES: [&str; 9] = [DECODE, "segment", "silhouette", "crown", "exemplar", "texture", "model", PREVIEW, WRITE];
/// The stage before [`run`].
pub const DECODE: &str = "decode";
/// The stage after [`run`].
pub const PREVIEW: &str = "preview";
/// The last stage.
pub const WRITE: &str = "write";

/// Runs every stage. `step` is called with each stage's name when it is done.
///
/// # Errors
/// Those of the stages, in [`Error::InView`] where they are a single photograph's; nothing is written here.
pub fn run(request: &Request, step: &dyn Fn(&str)) -> Result<ModelRun> {
    let Request { views, params, seed, .. } = *request;
    let mut clock = Clock { stage_began: Instant::now(), stages_ms: Vec::new(), step };

    let segmentations: Vec<Segmentation> = of_each(views, |view| segment(&view.photo, &params.segment, &view.hints))?;
    clock.done("segment");

    let products: Vec<ViewProducts> =
        of_each(views.iter().zip(segmentations), |(view, masks)| ViewProducts::of(&view.photo, masks, params))?;
    let outlines: Vec<Outline> =
        products.iter().zip(views).map(|(product, view)| product.outline(request.azimuth_rad(view))).collect();
    clock.done("silhouette");

    let crowns = crown::build(&outlines, &params.crown, seed)?;
    clock.done("crown");

    let Some((first, photo)) = products.first().zip(views.first().map(|view| &view.photo)) else {
        return Err(Error::Internal { stage: "pipeline", what: "a request without photographs".to_owned() });
    };
    let bakes = texture::shares(crowns.iter().map(|crown| &crown.mesh), &params.bake);
    let masks = &first.segmentation;
    let exemplar = |(crown, bake): (&Crown, &BakeParams)| {
        let texels_per_px = texels_per_m(&crown.mesh, bake)? * first.metres_per_px;
        exemplar::choose(photo, &masks.crown, &masks.gaps, texels_per_px, &params.exemplar)
    };
    let exemplars: Vec<Exemplar> = crowns.iter().zip(&bakes).map(exemplar).collect::<Result<_>>()?;
    clock.done("exemplar");

    let mean = exemplar::encoded_mean(&photo.image, &masks.crown, &masks.gaps);
    let seen = products.iter().zip(views);
    let fronts: Vec<Front> =
        seen.map(|(product, view)| Front { mean, ..product.front(&view.photo, request.azimuth_rad(view), params) }).collect();
    let mut atlases = Vec::new();
    let mut counts = Vec::new();
    for ((crown, exemplar), bake) in crowns.iter().zip(&exemplars).zip(&bakes) {
        let (atlas, count) = dressed(crown, exemplar, &fronts, &params.texture, bake, seed)?;
        atlases.push(atlas);
        counts.push(count);
    }
    clock.done("texture");

    let model = TreeModel {
        crowns: crowns.iter().zip(&atlases).map(|(crown, atlas)| ModelCrown::new(crown, atlas)).collect(),
        trunk: Some(first.trunk_shape(&crowns, params.size.height_m).build()),
        about: about(request, &products, &exemplars),
    };
    let warnings = warnings(request, &products);
    clock.done("model");
    Ok(ModelRun {
        model,
        views: products,
        crowns,
        exemplars,
        atlases,
        texture_counts: counts,
        stages_ms: clock.stages_ms,
        warnings,
    })
}

/// Grows a crown's texture from the exemplar and the pictures of it, of which the first is the exemplar's, and bakes it.
///
/// # Errors
/// Those of [`texture::synthesize`] and [`texture::bake`].
pub fn dressed(
    crown: &Crown,
    exemplar: &Exemplar,
    fronts: &[Front],
    synth: &SynthParams,
    bake: &BakeParams,
    seed: Seed,
) -> Result<(Atlas, texture::Counts)> {
    let metres_per_px = fronts.first().map_or(1.0, |front| front.metres_per_px);
    let blocks = texture::synthesize(&crown.mesh, exemplar, exemplar.scale / metres_per_px, fronts, synth, seed)?;
    Ok((texture::bake(&crown.mesh, crown.center, &blocks, exemplar, bake)?, blocks.counts))
}

/// What `work` makes of each view, or what is wrong with the first that fails.
fn of_each<V, T>(views: impl IntoIterator<Item = V>, work: impl Fn(V) -> Result<T>) -> Result<Vec<T>> {
    let in_view = |(view, it)| work(it).map_err(|cause| Error::InView { view, cause: Box::new(cause) });
    views.into_iter().enumerate().map(in_view).collect()
}

/// Times the stages and announces them.
struct Clock<'a> {
    stage_began: Instant,
    stages_ms: Vec<(&'static str, f64)>,
    step: &'a dyn Fn(&str),
}

impl Clock<'_> {
    fn done(&mut self, stage: &'static str) {
        self.stages_ms.push((stage, self.stage_began.elapsed().as_secs_f64() * 1e3));
        self.stage_began = Instant::now();
        (self.step)(stage);
    }
}

impl ViewProducts {
    fn of(photo: &Photo, segmentation: Segmentation, params: &ModelParams) -> Result<Self> {
        let silhouette = silhouette::trace(&segmentation.crown, &segmentation.tree, &params.silhouette)?;
        let trunk = trunk::find(&photo.image, &segmentation.crown, &segmentation.tree);
        let (top, bottom) = silhouette.pieces().flatten().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p.y), b.max(p.y)));
        // Where no trunk shows, the crown reaches the ground; where leaves hang lower than the trunk's foot, they touch it.
        let foot_px = trunk
            .map_or(DVec2::new(silhouette.axis.base.x, bottom), |trunk| DVec2::new(trunk.foot_px.x, trunk.foot_px.y.max(bottom)));
        let metres_per_px = params.size.height_m / (foot_px.y - top).max(1.0);
        Ok(Self { segmentation, silhouette, trunk, foot_px, metres_per_px })
    }

    fn outline(&self, azimuth_rad: f64) -> Outline {
        Outline::from_silhouette(&self.silhouette, self.foot_px, self.metres_per_px, azimuth_rad)
    }

    /// Where a point of object space lies in the photograph, seen along −Z.
    pub fn to_photo(&self, point: Vec3) -> DVec2 {
        self.foot_px + DVec2::new(f64::from(point.x), -f64::from(point.y)) / self.metres_per_px
    }

    fn front<'a>(&'a self, photo: &'a Photo, azimuth_rad: f64, params: &ModelParams) -> Front<'a> {
        Front {
            image: &photo.image,
            crown: &self.segmentation.crown,
            gaps: &self.segmentation.gaps,
            metres_per_px: self.metres_per_px,
            foot_px: self.foot_px,
            axes: raster::View::axes_from(azimuth_rad as f32, 0.0),
            mean: None,
            delight: params.exemplar.delight,
        }
    }

    /// The trunk as seen, or a likely one below the largest crown.
    fn trunk_shape(&self, crowns: &[Crown], height_m: f64) -> TrunkShape {
        let center = crowns.first().map_or(Vec3::ZERO, |crown| crown.center);
        match &self.trunk {
            Some(cues) => TrunkShape::seen(cues, self.metres_per_px, center),
            None => {
                let base = (self.silhouette.axis.base - self.foot_px) * self.metres_per_px;
                TrunkShape::guessed(Vec3::new(base.x as f32, -base.y as f32, 0.0), center, height_m)
            }
        }
    }

    /// The part of the crown that shows the sky.
    fn gap_fraction(&self) -> f64 {
        self.segmentation.gaps.count() as f64 / self.segmentation.crown.count().max(1) as f64
    }
}

fn warnings(request: &Request, products: &[ViewProducts]) -> Vec<Warning> {
    let mut warnings: Vec<Warning> = products.iter().flat_map(|p| p.segmentation.warnings.clone()).collect();
    if !request.height_is_given {
        let message = format!("the tree's height is a guess of {} m; give it with --height-m", request.params.size.height_m);
        warnings.push(Warning::new("height-guessed", message));
    }
    if products.first().is_some_and(|p| p.trunk.is_none()) {
        warnings.push(Warning::new(
            "no-trunk-seen",
            "no trunk shows below the crown; the model gets a likely one and stands on its lowest leaves",
        ));
    }
    warnings
}

fn about(request: &Request, products: &[ViewProducts], exemplars: &[Exemplar]) -> About {
    let parameters = serde_json::to_value(request.params).ok().and_then(|value| value.as_object().cloned());
    let profile = |(product, view): (&ViewProducts, &View)| Profile {
        azimuth_deg: request.azimuth_rad(view).to_degrees(),
        left_px: product.silhouette.left.clone(),
        right_px: product.silhouette.right.clone(),
    };
    About {
        format: About::FORMAT,
        program: About::this_program(),
        seed: request.seed.0,
        sources: request.sources.clone(),
        height_m: request.params.size.height_m,
        height_guessed: !request.height_is_given,
        parameters: parameters.unwrap_or_default(),
        feature_points: products.iter().zip(request.views).map(profile).collect(),
        exemplar_window_px: exemplars.first().map(|e| e.window_px),
        gap_fraction: products.first().map_or(0.0, ViewProducts::gap_fraction),
        growth: growth(request, products),
    }
}

fn growth(request: &Request, products: &[ViewProducts]) -> Growth {
    let (height_m, choice) = (request.params.size.height_m, request.params.outline.growth);
    let measured = |product: &ViewProducts| (Roughness::of(&product.silhouette.contour), product.metres_per_px);
    let (outline, metres_per_px) = products.first().map_or((Roughness::of(&[]), 0.0), measured);
    Growth::measured(&outline, metres_per_px, height_m, choice)
}

impl ModelCrown {
    fn new(crown: &Crown, atlas: &Atlas) -> Self {
        Self { surface: atlas.surface.clone(), texture: atlas.image.clone(), center: crown.center }
    }
}

impl ModelRun {
    /// What the model consists of, for the report.
    pub fn counts(&self) -> serde_json::Value {
        let crown = |(crown, texture): (&ModelCrown, &texture::Counts)| {
            let mesh = &crown.surface.mesh;
            serde_json::json!({
                "triangles": mesh.triangles.len(), "quads": mesh.quads.len(), "vertices": mesh.positions.len(),
                "texture_px": [crown.texture.width(), crown.texture.height()], "polygons_by_constraint_value": texture,
            })
        };
        let trunk = self
            .model
            .trunk
            .as_ref()
            .map(|t| serde_json::json!({"triangles": t.surface.mesh.triangles.len(), "quads": t.surface.mesh.quads.len()}));
        serde_json::json!({
            "crowns": self.model.crowns.iter().zip(&self.texture_counts).map(crown).collect::<Vec<_>>(),
            "trunk": trunk,
            "contour_points": self.views.iter().map(|v| v.silhouette.contour.len()).collect::<Vec<_>>(),
            "feature_points": self.views.iter().map(|v| v.silhouette.left.len() + v.silhouette.right.len()).collect::<Vec<_>>(),
        })
    }

    /// What was measured on the way, for the report.
    pub fn measures(&self) -> serde_json::Value {
        serde_json::json!({
            "hue_deg": self.views.iter().map(|v| v.segmentation.hue_deg).collect::<Vec<_>>(),
            "crown_px": self.views.iter().map(|v| v.segmentation.crown.count()).collect::<Vec<_>>(),
            "gap_fraction": self.views.iter().map(ViewProducts::gap_fraction).collect::<Vec<_>>(),
            "metres_per_px": self.views.iter().map(|v| v.metres_per_px).collect::<Vec<_>>(),
            "exemplar_window_px": self.exemplars.first().map(|e| e.window_px),
            "exemplar_delta_e": self.exemplars.iter().map(|e| e.delta_e).collect::<Vec<_>>(),
            "seam_contrast_before": self.atlases.iter().map(|a| a.seam_before).collect::<Vec<_>>(),
            "seam_contrast": self.atlases.iter().map(|a| a.seam_after).collect::<Vec<_>>(),
            "texel_contrast_before": self.atlases.iter().map(|a| a.contrast_before).collect::<Vec<_>>(),
            "texel_contrast": self.atlases.iter().map(|a| a.contrast).collect::<Vec<_>>(),
        })
    }
}
