//! The trees that a grove is planted with: each species' variants as a method builds them, and their sizes.

use rayon::prelude::*;

use super::chains::{self, Chains};
use super::placement::SpeciesSize;
use super::scene::{AUTO, SpeciesEntry};
use crate::compare::answer::Chain;
use crate::geom::Bounds;
use crate::model::reference::Asked;
use crate::plant::presets::{Preset, preset};
use crate::repr::{self, BuiltTree, Capture, Order, Scope, Settings, SourceKind, TreeSource, file};
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

/// What stands for each tree.
#[derive(Debug, Clone, Copy)]
pub struct StandIn<'a> {
    /// A method, or [`AUTO`].
    pub method: &'a str,
    /// Its parameters.
    pub settings: &'a Settings,
}

impl<'a> From<&'a str> for StandIn<'a> {
    fn from(method: &'a str) -> Self {
        Self { method, settings: Settings::none() }
    }
}

/// The method that stands in where `auto` finds no recommended chain: its own levels carry it from near to far.
pub const WITHOUT_CHAIN: &str = "sphere-board";

/// Below that height the trunk's radius is looked for, as a share of the tree's.
const TRUNK: f32 = 0.03;

/// Every variant of a scene's species, in order, and what stands for each.
///
/// # Errors
/// Those of [`TreeSource::open`] and [`repr::build`], with the species that they befell.
pub fn stock<'a>(
    species: &[SpeciesEntry],
    by: impl Into<StandIn<'a>>,
    capture: &dyn Capture,
    told: &(dyn Fn(&str) + Sync),
) -> Result<Vec<Stock>> {
    let by = by.into();
    let variants = |entry: &SpeciesEntry| {
        let count = if preset(&entry.source).is_some() { entry.variants } else { 1 };
        (0..u64::from(count)).map(|variant| (entry.clone(), variant, count)).collect::<Vec<_>>()
    };
    let all: Vec<_> = species.iter().flat_map(variants).collect();
    all.par_iter()
        .map(|(entry, variant, count)| {
            told(&entry.source);
            let stock = one(entry, *variant, *count, by, capture);
            stock.map_err(|cause| match cause {
                Error::InFile { .. } => cause,
                cause => Error::InFile { path: entry.source.clone().into(), cause: Box::new(cause) },
            })
        })
        .collect()
}

fn one(entry: &SpeciesEntry, variant: u64, count: u32, by: StandIn, capture: &dyn Capture) -> Result<Stock> {
    let seed = Seed(entry.seed + variant);
    let share = entry.share / f64::from(count);
    if by.method == AUTO && entry.compared.is_none() && preset(&entry.source).is_none() {
        // A file that was baked holds its levels.
        let bytes = files::read_whole(entry.source.as_ref(), u64::MAX)?;
        if let Some((built, _)) = file::read(&bytes).transpose()? {
            let size = size_of(entry, share, built.bounds, built.parts.iter().flat_map(|part| &part.part.surface.mesh.positions));
            return Ok(Stock { built, size, warnings: vec![] });
        }
    }
    let (source, warnings) = TreeSource::open(&entry.source, &Asked::default(), seed)?;
    let chain = match &entry.compared {
        Some(comparison) if by.method == AUTO => Some(chains::of_comparison(comparison)?),
        _ => None,
    };
    let stock = of_source(&source, entry, share, (by, chain), seed, capture)?;
    Ok(Stock { warnings: warnings.into_iter().chain(stock.warnings).collect(), ..stock })
}

/// A tree that is planted for `entry`, by a method, or where that is [`AUTO`] by `chain`, the one that comes with the program, or
/// [`WITHOUT_CHAIN`].
pub(super) fn of_source(
    source: &TreeSource,
    entry: &SpeciesEntry,
    share: f64,
    (StandIn { method, settings }, chain): (StandIn, Option<Chain>),
    seed: Seed,
    capture: &dyn Capture,
) -> Result<Stock> {
    let points: Vec<_> = source.points(Scope::Tree).collect();
    let size = size_of(entry, share, source.box_of_all()?, points.iter());
    if method == AUTO {
        let name = if source.kind() == SourceKind::Model { chains::PHOTOGRAPH } else { &entry.source };
        if let Some(chain) = chain.or_else(|| Chains::own().of(name)) {
            let built = chains::build(&chain, source, seed, capture)?;
            return Ok(Stock { warnings: built.warnings.clone(), built, size });
        }
    }
    let id = if method == AUTO { WITHOUT_CHAIN } else { method };
    let order = Order { method: id, trunk: None, settings, seed };
    let built = repr::build(&order, source, capture)?;
    let note = format!("{}: no recommended chain; {id} with its own levels stands in", entry.source);
    let warnings = if method == AUTO { vec![Warning::new("no-chain", note)] } else { vec![] };
    Ok(Stock { built, size, warnings })
}

/// What gardeners and botanists call a preset: "English oak", "Quercus robur".
fn names_of(preset: &Preset) -> Vec<String> {
    let called = preset.common.split(':').next().unwrap_or_default();
    called.split(['(', ')']).map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect()
}

fn size_of<'a>(entry: &SpeciesEntry, share: f64, bounds: Bounds, points: impl Iterator<Item = &'a glam::Vec3>) -> SpeciesSize {
    let top = bounds.foot_y() + TRUNK * bounds.height_m();
    let radius = points.filter(|p| p.y <= top).map(|p| p.x.hypot(p.z)).fold(0.0, f32::max);
    let size = bounds.size();
    let path = std::path::Path::new(&entry.source);
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let preset = preset(&entry.source).map(names_of).unwrap_or_default();
    SpeciesSize {
        name: entry.source.clone(),
        also: stem.into_iter().chain(preset).collect(),
        share,
        height_m: bounds.height_m(),
        crown_width_m: 0.5 * (size.x + size.z),
        // A stool of shoots, or a skirt down to the ground, is no trunk.
        trunk_radius_m: radius.min(0.06 * bounds.height_m()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::presets::PRESETS;
    use crate::repr::SoftwareCapture;

    #[test]
    fn presets_are_found_by_their_latin_and_common_names() {
        for (name, expected) in [("oak", ["English oak", "Quercus robur"]), ("birch", ["silver birch", "Betula pendula"])] {
            assert_eq!(names_of(preset(name).unwrap()), expected);
        }
        for preset in &PRESETS {
            let names = names_of(preset);
            assert!(names.len() == 2 && names[1].starts_with(char::is_uppercase) && names[1].contains(' '), "{names:?}");
        }
    }

    #[test]
    fn a_comparison_that_a_species_names_says_what_is_drawn_and_a_missing_one_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let link = |method: &str, from: f32| {
            format!(r#"{{"method":"{method}","level":null,"from_height_px":null,"from_distance":{from}}}"#)
        };
        let report = format!(r#"{{"chain":{{"links":[{},{}]}}}}"#, link("crossed-planes", 0.0), link("billboard", 30.0));
        files::write_whole(&folder.path().join("report.json"), report.as_bytes()).unwrap();
        let entry = SpeciesEntry { compared: Some(folder.path().to_owned()), ..SpeciesEntry::new("spruce") };
        let stock = stock(std::slice::from_ref(&entry), AUTO, &SoftwareCapture::new(), &|_| ()).unwrap();
        let built = &stock[0].built;
        assert_eq!(built.levels.iter().map(|level| level.name.as_str()).collect::<Vec<_>>(), ["crossed-planes", "billboard"]);
        assert!(built.parts_at(5.0).count() > 0 && built.parts_at(90.0).count() > 0 && stock[0].warnings.is_empty());
        let lost = SpeciesEntry { compared: Some(folder.path().join("none")), ..entry };
        let told = super::stock(&[lost], AUTO, &SoftwareCapture::new(), &|_| ()).unwrap_err().to_string();
        assert!(told.contains("spruce") && told.contains("none"), "{told}");
    }
}
