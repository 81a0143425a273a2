//! LodStrips for trunk and branches (Ramos & Chover 2004; Rebollo §III, which draws its trunks so). Metres.
//!
//! `collapse` orders the vertices by quadric-error collapses, `strips` keeps the strips and what each collapse changes in them. Whoever
//! draws strips moves through all levels by [`Extraction::go_to`]; as a method of the table it gives a few of them as parts that relieve
//! each other. Every branch stays on what it stands on, at every level, and goes only when it is a sliver.

mod collapse;
pub mod measure;
mod nearest;
mod strips;
#[cfg(test)]
mod tests;
mod wood;

use rayon::prelude::*;

pub use strips::{Extraction, LevelOf, Lodstrips, NONE, packed, triangles_of};

use super::levels::{Rung, relieving};
use super::pick::picked;
use super::{BuiltTree, Job, Representation, Scope, SourceKind};
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec};
use crate::{Result, Warning};

crate::params! {
    /// How wood is simplified.
    pub struct LodstripsParams {
        /// How many pixels the surface may be off when a level takes over.
        error_px: f64 = 1.0, in 0.1..=64.0, unit "px", source "ours: what is smaller than a pixel does not show";
    }
}

/// Shares of the triangles, finest first.
pub const SHARES: [f32; 4] = [1.0, 0.5, 0.25, 0.1];

/// Wood as LodStrips.
pub struct LodstripsWood;

impl Representation for LodstripsWood {
    fn id(&self) -> &'static str {
        "lodstrips"
    }

    fn name(&self) -> &'static str {
        "LodStrips"
    }

    fn citation(&self) -> &'static str {
        "Ramos & Chover 2004; Rebollo et al. 2007, §III"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Wood]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        LodstripsParams::specs()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: LodstripsParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let wood = job.source.parts(Scope::Wood);
        if wood.is_empty() {
            let warning = Warning::new("no-wood", format!("{} has no wood to simplify", job.source.name()));
            return Ok(BuiltTree { warnings: vec![warning], ..BuiltTree::new(bounds, vec![]) });
        }
        let models: Vec<Lodstrips> = wood.par_iter().map(|part| Lodstrips::of(&part.surface)).collect();
        let rung = |share: &f32| {
            let levels = models.iter().map(|model| model.level_with((share * model.levels[0].triangles as f32) as usize));
            let (parts, errors_m): (Vec<Part>, Vec<f32>) = wood
                .iter()
                .zip(&models)
                .zip(levels)
                .map(|((part, model), level)| (at(part, model, level), model.levels[level].error_m))
                .unzip();
            let parts = parts.into_iter().filter(|part| part.surface.mesh.polygon_count() > 0).collect();
            Rung { name: format!("{:.0} % of the wood", 100.0 * share), error_m: errors_m.into_iter().fold(0.0, f32::max), parts }
        };
        let rungs = SHARES.par_iter().map(rung).collect();
        let (parts, levels) = relieving(rungs, bounds.center(), params.error_px as f32, bounds.height_m());
        Ok(BuiltTree { levels, ..BuiltTree::new(bounds, parts) })
    }
}

/// The part at a level.
fn at(part: &Part, model: &Lodstrips, level: usize) -> Part {
    let mut extraction = model.extraction();
    extraction.go_to(level);
    Part { surface: picked(&model.surface, &extraction.triangles(), &[]), ..part.clone() }
}
