//! The trees that a grove is planted with: each species' variants as a method builds them, and their sizes.

use rayon::prelude::*;

use super::placement::SpeciesSize;
use super::scene::{AUTO, SpeciesEntry};
use crate::geom::Bounds;
use crate::model::reference::Asked;
use crate::plant::presets::preset;
use crate::repr::{self, BuiltTree, Capture, Order, Scope, Settings, TreeSource, file};
use crate::{Error, Result, Seed, Warning, files};

/// One kind of tree, ready to be planted.
#[derive(Debug, Clone)]
pub struct Stock {
    /// What is planted.
    pub built: BuiltTree,
    /// How large it is.
    pub size: SpeciesSize,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// The method that stands in where `auto` finds no recommended chain: its own levels carry it from near to far.
pub const WITHOUT_CHAIN: &str = "sphere-board";

/// Below that height the trunk's radius is looked for, as a share of the tree's.
const TRUNK: f32 = 0.03;

/// Every variant of a scene's species, in order, drawn as `method` or [`AUTO`] says.
///
/// # Errors
/// Those of [`TreeSource::open`] and [`repr::build`], with the species that they befell.
pub fn stock(species: &[SpeciesEntry], method: &str, capture: &dyn Capture, told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Stock>> {
    let variants = |entry: &SpeciesEntry| {
        let count = if preset(&entry.source).is_some() { entry.variants } else { 1 };
        (0..u64::from(count)).map(|variant| (entry.clone(), variant, count)).collect::<Vec<_>>()
    };
    let all: Vec<_> = species.iter().flat_map(variants).collect();
    all.par_iter()
        .map(|(entry, variant, count)| {
            told(&entry.source);
            let stock = one(entry, *variant, *count, method, capture);
            stock.map_err(|cause| Error::InFile { path: entry.source.clone().into(), cause: Box::new(cause) })
        })
        .collect()
}

fn one(entry: &SpeciesEntry, variant: u64, count: u32, method: &str, capture: &dyn Capture) -> Result<Stock> {
    let seed = Seed(entry.seed + variant);
    let share = entry.share / f64::from(count);
    if method == AUTO && preset(&entry.source).is_none() {
        // A file that was baked holds its levels.
        let bytes = files::read_whole(entry.source.as_ref(), u64::MAX)?;
        if let Some((built, _)) = file::read(&bytes).transpose()? {
            let size = size_of(entry, share, built.bounds, built.parts.iter().flat_map(|part| &part.part.surface.mesh.positions));
            return Ok(Stock { built, size, warnings: vec![] });
        }
    }
    let (source, mut warnings) = TreeSource::open(&entry.source, &Asked::default(), seed)?;
    let points: Vec<_> = source.points(Scope::Tree).collect();
    let size = size_of(entry, share, source.box_of_all()?, points.iter());
    let id = if method == AUTO { WITHOUT_CHAIN } else { method };
    if method == AUTO {
        let note = format!("{}: no recommended chain; {id} with its own levels stands in", entry.source);
        warnings.push(Warning::new("no-chain", note));
    }
    let order = Order { method: id, trunk: None, settings: &Settings::default(), seed };
    let built = repr::build(&order, &source, capture)?;
    Ok(Stock { built, size, warnings })
}

fn size_of<'a>(entry: &SpeciesEntry, share: f64, bounds: Bounds, points: impl Iterator<Item = &'a glam::Vec3>) -> SpeciesSize {
    let top = bounds.foot_y() + TRUNK * bounds.height_m();
    let radius = points.filter(|p| p.y <= top).map(|p| p.x.hypot(p.z)).fold(0.0, f32::max);
    let size = bounds.size();
    let stem = std::path::Path::new(&entry.source).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    SpeciesSize {
        name: entry.source.clone(),
        also: stem.into_iter().collect(),
        share,
        height_m: bounds.height_m(),
        crown_width_m: 0.5 * (size.x + size.z),
        // A stool of shoots, or a skirt down to the ground, is no trunk.
        trunk_radius_m: radius.min(0.06 * bounds.height_m()),
    }
}
