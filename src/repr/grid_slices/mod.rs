//! Slices of a tree on two crossed rows of cards: "dynamically generated slice-based volume rendered impostor" (Truelsen & Bønding 2008).
//!
//! Each slice is a parallel projection of what lies between two planes (`plan`); the two through the trunk are the base pair, deeper than
//! the others and alone in showing wood. Levels of detail are the first so many slices of the list: finer ones fade at their distances
//! (`params`), by noise in their alpha (`dissolve`). A growing tree is taken anew a few slices at a time ([`GridSlices::update`]).

mod dissolve;
mod foliage;
mod params;
mod plan;
pub mod tables;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::card;
use super::source::opened;
use super::{BuiltPart, BuiltTree, Dirty, Drawn, Fade, Job, Level, Representation, Scope, Seen, SourceKind};
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec};
use crate::{Result, Warning};

pub use params::{Arrangement, Beyond, Dissolve, GridParams, HEIGHTS_PER_UNIT, Placement};
use plan::{Plan, Slice};

/// Slices in a grid or a star.
pub struct GridSlices;

impl Representation for GridSlices {
    fn id(&self) -> &'static str {
        "grid-slices"
    }

    fn name(&self) -> &'static str {
        "Grid of slices"
    }

    fn citation(&self) -> &'static str {
        "Truelsen & Bønding 2008, §4, fig. 11 to 17; §9.2"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree, Scope::Foliage]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        GridParams::specs()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let studio = Studio::of(job)?;
        let parts = studio.taken(0..studio.plan.slices.len())?.into_iter().flatten().collect();
        Ok(studio.dated(BuiltTree::new(studio.plan.bounds, parts)))
    }

    /// Takes `slices_per_update` slices anew, those whose turn it is, coarse levels first; after as many calls as it takes to come round,
    /// the tree is what [`GridSlices::build`] makes of a source that stays. Bounds and levels are the source's at once.
    fn update(&self, built: &mut BuiltTree, job: &Job, turn: usize) -> Result<Dirty> {
        let studio = Studio::of(job)?;
        let slices = &studio.plan.slices;
        let few = studio.params.slices_per_update as usize;
        let first = turn % slices.len().div_ceil(few) * few;
        let range = first..(first + few).min(slices.len());
        let mut dirty: Option<Dirty> = None;
        for (number, taken) in range.clone().zip(studio.taken(range)?) {
            // Slices in which nothing is seen have no part.
            let order = |part: &BuiltPart| slices.iter().position(|slice| slice.card.name == part.part.name);
            let at =
                built.parts.iter().position(|part| order(part).is_none_or(|order| order >= number)).unwrap_or(built.parts.len());
            let is_there = built.parts.get(at).is_some_and(|part| order(part) == Some(number));
            dirty = match (is_there, taken) {
                (true, Some(part)) => {
                    built.parts[at] = part;
                    match dirty {
                        Some(Dirty::Parts(from, _)) => Some(Dirty::Parts(from, at + 1)),
                        None => Some(Dirty::Parts(at, at + 1)),
                        all => all,
                    }
                }
                (false, Some(part)) => {
                    built.parts.insert(at, part);
                    Some(Dirty::All)
                }
                (true, None) => {
                    built.parts.remove(at);
                    Some(Dirty::All)
                }
                (false, None) => dirty,
            };
        }
        built.bounds = studio.plan.bounds;
        built.levels = studio.levels();
        built.warnings = studio.warnings();
        Ok(dirty.unwrap_or(Dirty::Parts(0, 0)))
    }
}

/// What slices are taken of, and how.
struct Studio<'a> {
    job: &'a Job<'a>,
    params: GridParams,
    plan: Plan,
}

impl<'a> Studio<'a> {
    fn of(job: &'a Job) -> Result<Self> {
        let params: GridParams = job.settings.read()?;
        params.check()?;
        let plan = Plan::of(job, &params)?;
        Ok(Self { job, params, plan })
    }

    /// These slices of the plan; `None` for one in which nothing is seen.
    fn taken(&self, range: std::ops::Range<usize>) -> Result<Vec<Option<BuiltPart>>> {
        let slices = &self.plan.slices[range.clone()];
        let opened = opened(self.job.source.parts(Scope::Foliage));
        let foliage: Vec<&Part> = opened.iter().map(|part| &**part).collect();
        let wood = if self.job.scope == Scope::Foliage { vec![] } else { self.job.source.parts(Scope::Wood) };
        let all: Vec<&Part> = wood.into_iter().chain(foliage.iter().copied()).collect();
        let take = |parts: &[&Part], has_wood: bool| {
            let cards: Vec<_> = slices.iter().filter(|slice| slice.has_wood == has_wood).map(|slice| slice.card.clone()).collect();
            card::captured(self.job.capture, parts, &cards)
        };
        let (mut with, mut without) = (take(&all, true)?.into_iter(), take(&foliage, false)?.into_iter());
        let next = |slice: &Slice| if slice.has_wood { with.next() } else { without.next() };
        let parts: Vec<Option<Part>> = slices.iter().map(next).map(Option::flatten).collect();
        Ok(range.zip(slices).zip(parts).map(|((number, slice), part)| part.map(|part| self.part(number, slice, part))).collect())
    }

    fn part(&self, number: usize, slice: &Slice, mut part: Part) -> BuiltPart {
        if let (Dissolve::Noise, Some(texture)) = (self.params.dissolve, &mut part.material.texture)
            && self.params.vanishes(slice.level)[1] < f32::MAX
        {
            dissolve::bake(Arc::make_mut(texture), self.job.seed, number as u64);
        }
        let vanishes = self.params.vanishes(slice.level);
        let fade = if vanishes[1] < f32::MAX { self.params.fade() } else { Fade::Hashed };
        let seen = Seen { anchor: self.plan.bounds.center(), vanishes, facing: slice.facing, fade, ..Seen::default() };
        BuiltPart { part, drawn: Drawn::Still, seen }
    }

    /// The tree with what it says of itself.
    fn dated(&self, built: BuiltTree) -> BuiltTree {
        BuiltTree { levels: self.levels(), warnings: self.warnings(), ..built }
    }

    /// Finest first.
    fn levels(&self) -> Vec<Level> {
        let level = |level: usize| Level { name: format!("level {level}"), distance: self.params.distance_of(level) };
        (1..=self.params.levels()).rev().map(level).collect()
    }

    fn warnings(&self) -> Vec<Warning> {
        let has_leaves = !self.job.source.parts(Scope::Foliage).is_empty();
        let say =
            || Warning::new("no-leaves", "the tree has no leaves, so that only its base pair of slices shows anything".to_owned());
        if has_leaves { vec![] } else { vec![say()] }
    }
}
