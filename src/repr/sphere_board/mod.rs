//! The sphere-board (She et al. 2018): closed crowns, one for each cluster of foliage, that carry the tree's own picture, and a trunk.
//!
//! Of a photograph's model the finest level is the model itself. A true tree is photographed, without light and with every pixel known to
//! be leaf or not, and goes through the stages of [`pipeline`](crate::model::pipeline) from the silhouette on. Coarser levels are built
//! the same way, those of a model from pictures of it. Metres, pixels of the pictures.

mod flat;
mod levels;
pub(super) mod picture;
mod reduced;
mod relief;
mod shade;
pub(super) mod subject;
mod tone;
mod views;

use rayon::prelude::*;

use crate::crown::{self, CrownParams, Hull};
use crate::geom::Bounds;
use crate::model::{Growth, ModelCrown, Part, ProfileChoice};
use crate::params::{ParamSet as _, ParamSpec, PowerOfTwo};
use crate::photo::{Exemplar, ExemplarParams, Roughness, exemplar};
use crate::texture::{self, BakeParams, SynthParams, texels_per_m};
use crate::{Result, model::pipeline};

use super::{BuiltTree, Job, Representation, Scope, SourceKind, TreeSource};
use levels::Far;
use picture::Picture;
use subject::{Cluster, Subject};

crate::choices! {
    /// What may be known of the sides that no photograph shows.
    pub enum Unseen {
        /// They are looked at, too.
        Seen = "seen",
        /// They are made up from the photographs: the paper's way.
        Grown = "grown",
    }
}

crate::params! {
    /// How a sphere-board is made of a tree.
    pub struct SphereBoardParams {
        /// From how many sides, evenly round it, a true tree is photographed.
        azimuths: u32 = 1, in 1..=8, unit "views", source "She: one photograph";
        /// How deep a true tree's clusters are and where they stand in depth: seen from the side, or round as from the front.
        depth: Unseen = Unseen::Seen, unit "", source "ours: one photograph says nothing of depth, the tree does; She revolves the outline";
        /// What a true tree looks like from above: photographed, or grown from the photographs.
        above: Unseen = Unseen::Seen, unit "", source "ours: landscapes are looked down upon; She grows it";
        /// Polygons of all crowns in the finest level.
        polygons: u32 = 2_200, in 100..=20_000, unit "polygons", source "She table 1: 56 triangles + 2,124 quads";
        /// Polygons of all crowns in the middle level.
        polygons_mid: u32 = 600, in 60..=10_000, unit "polygons", source "ours: a half of the outline's detail";
        /// Polygons of all crowns in the coarse level.
        polygons_far: u32 = 150, in 40..=5_000, unit "polygons", source "ours: a half of that";
        /// From how many azimuths, at each of three elevations and once from above, a true tree is pictured for its coarse level, which shows the
        /// picture nearest to the viewer; 0 for one texture, as nearer levels have.
        looks: u32 = 4, in 0..=12, unit "views", source "ours: from afar what is seen through a crown differs from side to side";
        /// Texels of those pictures along the tree's longest side.
        look_px: u32 = 128, in 16..=512, unit "texels", source "ours: as many as it has pixels";
        /// How many pixels high a true tree is where those pictures take over.
        look_from_px: f64 = 170.0, in 16.0..=1000.0, unit "px", source "ours: a texel is a pixel or somewhat more";
        /// Polygons of all crowns that carry those pictures.
        look_polygons: u32 = 200, in 40..=5_000, unit "polygons", source "ours: with fewer, corners of the outline are cut off";
        /// Side of the finest level's atlas; each coarser level has half of it.
        texture_size: PowerOfTwo = PowerOfTwo(512), in 64..=2048, unit "texels", source "ours: as `model` has it";
        /// Most crowns of one tree.
        max_crowns: u32 = 8, in 1..=24, unit "crowns", source "ours: more add little but polygons";
        /// Largest fault of a single crown before it is parted: 1 − IoU of its outline with that of its leaves.
        lobe_split: f64 = 0.05, in 0.0..=1.0, unit "", source "ours: as `model` has it";
        /// How much of the mean growth of outlines is taken off the crowns beforehand.
        inset: f64 = 1.0, in 0.0..=2.0, unit "", source "ours: what is grown and what is not together cover what the leaves do";
        /// Pixels that a photograph of a true tree has along the tree's longest side.
        picture_px: u32 = 512, in 64..=4096, unit "px", source "ours: a texel of the atlas is no smaller";
        /// How far a coarser level's outline may be off where it takes over.
        error_px: f64 = 1.0, in 0.1..=20.0, unit "px", source "ours: hardly seen";
    }
}

/// The method.
pub struct SphereBoard;

impl Representation for SphereBoard {
    fn id(&self) -> &'static str {
        "sphere-board"
    }

    fn name(&self) -> &'static str {
        "Sphere-board"
    }

    fn citation(&self) -> &'static str {
        "She et al. 2018, §3.1–3.2, fig. 4b"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree, Scope::Foliage]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        SphereBoardParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        leafless(source)
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: SphereBoardParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let mut subject = Subject::of(job, &params, bounds)?;
        let outer: Vec<Hull> = subject.clusters.iter().map(|cluster| cluster.hull.clone()).collect();
        let growth = job.source.growth().unwrap_or_else(|| growth(&subject, bounds));
        if subject.finest.is_none() {
            let grown_m = 0.5 * (growth.min_m + growth.max_m);
            subject.clusters.iter_mut().for_each(|cluster| cluster.hull.inset(params.inset * grown_m));
        }
        let wood = if job.scope == Scope::Tree { subject.trunk.clone() } else { None };
        let atlas = |halvings: u32| PowerOfTwo((params.texture_size.0 >> halvings).max(64));
        let built = |polygons: u32, halvings: u32| match &subject.finest {
            Some(parts) if halvings == 0 || subject.clusters.is_empty() => Ok(parts.clone()),
            _ => subject.crowns(polygons as usize, atlas(halvings), job),
        };
        // A model and what is only grown are known from the photographs alone.
        let all_seen = subject.finest.is_none() && params.depth == Unseen::Seen && params.above == Unseen::Seen;
        let far = || match all_seen && params.looks > 0 {
            true => views::parts(job, &outer, wood.as_ref(), bounds, &params).map(Far::Looks),
            false => built(params.polygons_far, 2).map(Far::Crowns),
        };
        let (near, (mid, far)) = rayon::join(|| built(params.polygons, 0), || rayon::join(|| built(params.polygons_mid, 1), far));
        let (near, mid, far) = (near?, mid?, far?);
        let cards = flat::cards(job, bounds)?;
        levels::built(levels::Ladder { meshes: [near, mid], far, wood, cards }, bounds, growth, &params)
    }
}

/// Why a tree has no crown; also for methods that fit something else to it.
pub(super) fn leafless(source: &TreeSource) -> Option<String> {
    let none = source.parts(Scope::Foliage).iter().all(|part| part.surface.mesh.polygon_count() == 0);
    none.then(|| "it has no leaves, and a crown is made of nothing else".to_owned())
}

/// How a true tree's outline grows, measured on its first picture.
fn growth(subject: &Subject, bounds: Bounds) -> Growth {
    let (rough, metres_per_px) = subject.clusters.iter().find_map(Cluster::roughness).unwrap_or((Roughness::of(&[]), 0.0));
    Growth::measured(&rough, metres_per_px, f64::from(bounds.height_m()), ProfileChoice::Auto)
}

impl Subject {
    /// The crowns of a level, as parts whose outlines grow.
    fn crowns(&self, polygons: usize, texture_size: PowerOfTwo, job: &Job) -> Result<Vec<Part>> {
        let hulls: Vec<Hull> = self.clusters.iter().map(|cluster| cluster.hull.clone()).collect();
        let crowns = crown::surfaces(&hulls, polygons, &CrownParams::default(), job.seed)?;
        let bakes = texture::shares(crowns.iter().map(|crown| &crown.mesh), &BakeParams { texture_size, ..BakeParams::default() });
        let part = |(number, ((cluster, crown), bake)): (usize, ((&Cluster, &crown::Crown), &BakeParams))| -> Result<Part> {
            let exemplar = cluster.exemplar(texels_per_m(&crown.mesh, bake)?)?;
            let fronts = cluster.fronts();
            let (atlas, _) = pipeline::dressed(crown, &exemplar, &fronts, &SynthParams::default(), bake, job.seed)?;
            let crown = ModelCrown { surface: atlas.surface, texture: atlas.image, center: crown.center };
            let mut part = crown.part(number);
            part.material.factor = [cluster.tone, cluster.tone, cluster.tone, 1.0];
            Ok(part)
        };
        let parts: Vec<Result<Part>> = self.clusters.par_iter().zip(&crowns).zip(&bakes).enumerate().map(part).collect();
        parts.into_iter().collect()
    }
}

impl Cluster {
    fn exemplar(&self, texels_per_m: f64) -> Result<Exemplar> {
        // The front, unless that is a mere edge of what lies flat.
        let area = |picture: &Picture| picture.crown.count();
        let (front, widest) = (&self.pictures[0], self.pictures.iter().max_by_key(|picture| area(picture)));
        let first = widest.filter(|widest| area(widest) > 2 * area(front)).unwrap_or(front);
        // The pictures have no light in them that would have to be taken out.
        let params = ExemplarParams { delight: 0.0, ..ExemplarParams::default() };
        exemplar::choose(&first.photo, &first.crown, &first.gaps, texels_per_m * first.metres_per_px, &params)
    }
}

#[cfg(test)]
mod tests;
