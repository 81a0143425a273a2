//! Which stand-ins `auto` draws a tree with, from near to far: the chain of a comparison of the user's, or one that comes with the program.
//!
//! Those that come with it were chosen for groves by a rule of their own ([`Rule`]): at a few pixels no stand-in comes under an error at which
//! one tree could be told from the truth, yet a forest has to be drawn there. `make chains` compares every preset and writes
//! `chains.json` beside this file.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::compare::answer::{self, Band, Chain, CostKind};
use crate::compare::{Contender, Cost, Row, TRUTH, Workshop, chain};
use crate::repr::limits::BudgetParams;
use crate::repr::{BuiltTree, Capture, TreeSource};
use crate::{Error, Result, Seed, files};

/// In [`Chains::bands`], the model of a photograph.
pub const PHOTOGRAPH: &str = "photograph";

/// How the stand-in of a band is chosen: among those that are light enough the lightest whose error is under the limit, or the one of least
/// error where none is; where none is light enough the lightest.
///
/// What counts is work in a crowd on a software driver, reckoned from triangles and overdraw and told in shaded pixels, so that chains do not
/// depend on what else a machine does while it compares. Twice as far away there are four times as many trees to each octave of distance,
/// each of a quarter of the pixels: a bound that goes with the square of the height gives every octave the same work.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// Mean FLIP that is good enough.
    pub max_flip: f64,
    /// Shaded pixels for each pixel of the square over the tree's height.
    pub work_per_px2: f64,
    /// The same of trees that fill the picture, of which there are never many: they are seen leaf by leaf.
    pub near_per_px2: f64,
}

impl Default for Rule {
    fn default() -> Self {
        Self { max_flip: 0.08, work_per_px2: 6.5, near_per_px2: 16.0 }
    }
}

/// A triangle is as much work as so many shaded pixels: on four cores of llvmpipe 43 to 82 ns in the one thread that takes vertices, beside
/// 5.5 ns of each pixel of a card (measured on 200 oaks as box hierarchies).
const PX_PER_TRIANGLE: f64 = 12.0;
/// From that height on, pixels, a tree fills the picture.
const FILLS_PX: f32 = 720.0;
/// A tree covers about that share of the square over its height.
const COVERED: f64 = 0.35;

impl Rule {
    /// Work that a tree of that height on the screen may be, in shaded pixels.
    pub fn most_work(&self, height_px: f32) -> f64 {
        let per_px2 = if height_px < FILLS_PX { self.work_per_px2 } else { self.near_per_px2 };
        per_px2 * f64::from(height_px).powi(2)
    }

    /// Work of one among many, in shaded pixels.
    pub fn work(row: &Row) -> f64 {
        let shaded = row.cost.overdraw * COVERED * f64::from(row.height_px).powi(2);
        shaded + PX_PER_TRIANGLE * row.cost.triangles as f64
    }

    /// The bands of a comparison's rows, nearest first. The tree itself is not chosen.
    pub fn bands(&self, rows: &[Row]) -> Vec<Band> {
        // Triangles are what bands are told in; here work is.
        let weighed = |row: &Row| Row { cost: Cost { triangles: Self::work(row).round() as usize, ..row.cost }, ..row.clone() };
        let able: Vec<Row> = rows.iter().filter(|row| row.method != TRUTH && row.failed.is_none()).map(weighed).collect();
        let work = |row: &Row| CostKind::Triangles.of(&row.cost);
        let least = |height_px: f32| able.iter().filter(|row| row.height_px == height_px).map(work).fold(f64::MAX, f64::min);
        let fits = |row: &&Row| work(row) <= self.most_work(row.height_px).max(least(row.height_px));
        let light: Vec<Row> = able.iter().filter(fits).cloned().collect();
        let mut bands = answer::bands(&light, self.max_flip, CostKind::Triangles);
        for band in bands.iter_mut().filter(|band| !band.good) {
            let here = light.iter().filter(|row| row.height_px == band.height_px);
            let Some(best) = here.min_by(|a, b| a.error.flip.total_cmp(&b.error.flip)) else { continue };
            (band.method, band.level) = (Some(best.method.clone()), best.level.clone());
            (band.flip, band.cost) = (best.error.flip, work(best));
        }
        bands
    }
}

/// Chains, and how they came about: `chains.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Chains {
    /// Name and version of the program that compared.
    pub program: String,
    /// The command that did.
    pub command: String,
    /// Adapter and driver.
    pub adapter: String,
    /// How stand-ins were chosen.
    pub rule: Rule,
    /// By preset, and [`PHOTOGRAPH`]: what is drawn at which height in pixels, nearest first. `cost` is in shaded pixels ([`Rule::work`]).
    pub bands: BTreeMap<String, Vec<Band>>,
}

impl Chains {
    /// Those that come with the program.
    pub fn own() -> &'static Self {
        static OWN: LazyLock<Chains> =
            LazyLock::new(|| serde_json::from_str(include_str!("chains.json")).expect("a test reads the file that is built in"));
        &OWN
    }

    /// The chain of that name.
    pub fn of(&self, name: &str) -> Option<Chain> {
        self.bands.get(name).map(|bands| Chain::of(bands)).filter(|chain| !chain.links.is_empty())
    }
}

/// The chain of a comparison of the user's: its folder, or the `report.json` in it.
///
/// # Errors
/// [`Error::InFile`] around [`Error::BrokenReport`] or [`Error::NoChain`]; those of reading.
pub fn of_comparison(path: &Path) -> Result<Chain> {
    const MOST_BYTES: u64 = 1 << 28;
    let path = if path.is_dir() { path.join("report.json") } else { path.to_owned() };
    let bytes = files::read_whole(&path, MOST_BYTES)?;
    let inside = |cause| Error::InFile { path: path.clone(), cause: Box::new(cause) };
    #[derive(Deserialize)]
    struct Limit {
        #[serde(default)]
        max_flip: f64,
    }
    match Chain::of_report(&bytes).map_err(inside)? {
        chain if chain.links.is_empty() => {
            let max_flip = serde_json::from_slice::<Limit>(&bytes).map_or(0.0, |limit| limit.max_flip);
            Err(inside(Error::NoChain { max_flip }))
        }
        chain => Ok(chain),
    }
}

/// The stand-ins of a chain for `source`, joined into one tree.
///
/// # Errors
/// [`Error::UnknownMethod`] for a link that is none of our methods; those of building.
pub fn build(links: &Chain, source: &TreeSource, seed: Seed, capture: &dyn Capture) -> Result<BuiltTree> {
    let mut methods: Vec<String> = links.links.iter().map(|link| link.method.clone()).collect();
    methods.sort();
    methods.dedup();
    let contenders = Contender::all(&methods, &[])?;
    let shop = Workshop { source, seed, capture, budget: BudgetParams::default() };
    let trees = chain::build(links, &contenders, &shop)?;
    let warnings = trees.iter().flat_map(|tree| tree.warnings.clone()).collect();
    Ok(BuiltTree { warnings, ..chain::join(links, &trees, 0.0)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Figures;
    use crate::plant::presets::{PRESETS, preset};
    use crate::repr::method;

    fn row(method: &str, height_px: f32, flip: f64, triangles: usize, overdraw: f64) -> Row {
        Row {
            method: method.to_owned(),
            level: None,
            height_px,
            error: Figures { flip, ..Figures::default() },
            cost: Cost { triangles, overdraw, ..Cost::default() },
            failed: None,
        }
    }

    #[test]
    fn the_least_error_that_is_light_enough_stands_in_where_none_is_good_enough() {
        let rows = [
            row(TRUTH, 100.0, 0.0, 10, 1.0),
            row("fine", 100.0, 0.01, 50_000, 3.0),
            row("good", 100.0, 0.05, 3000, 2.0),
            row("plain", 100.0, 0.07, 4, 3.0),
            row("glassy", 100.0, 0.02, 2, 90.0),
            row("coarse", 100.0, 0.3, 2, 1.0),
            row("fine", 20.0, 0.01, 500, 3.0),
            row("plain", 20.0, 0.2, 4, 3.0),
            row("coarse", 20.0, 0.25, 2, 1.0),
            row("plain", 1.0, 0.5, 4, 3.0),
            row("coarse", 1.0, 0.6, 2, 1.0),
        ];
        let rule = Rule::default();
        let bands = rule.bands(&rows);
        let told: Vec<_> = bands.iter().map(|band| band.method.as_deref().unwrap()).collect();
        assert_eq!(told, ["plain", "plain", "coarse"], "under the limit the lightest; else the least error; else the lightest");
        assert_eq!((bands[0].cost, bands[0].flip), (48.0 + 3.0 * 3500.0, 0.07));
        assert_eq!(Chain::of(&bands).links.len(), 2);
        let hurried = Rule { work_per_px2: 1e-9, ..rule }.bands(&rows);
        assert!(hurried.iter().all(|band| band.method.as_deref() == Some("coarse")), "where none is light enough the lightest");
    }

    #[test]
    fn the_built_in_chains_of_all_presets_run_from_near_to_far() {
        let own = Chains::own();
        for (name, bands) in &own.bands {
            assert!(preset(name).is_some() || name == PHOTOGRAPH, "{name}");
            let chain = own.of(name).unwrap_or_else(|| panic!("{name} has no chain"));
            assert_eq!(chain.links[0].from_distance, 0.0, "{name}");
            assert!(chain.links.is_sorted_by(|a, b| a.from_distance < b.from_distance), "{name}");
            chain.links.iter().for_each(|link| assert!(method(&link.method).is_ok(), "{name}: {}", link.method));
            assert!(bands.last().is_some_and(|far| far.height_px <= 16.0), "{name}: a million must be drawn");
        }
        for name in PRESETS.iter().map(|preset| preset.name).chain([PHOTOGRAPH]) {
            assert!(own.of(name).is_some(), "{name}");
        }
    }

    #[test]
    fn a_comparison_is_found_by_its_folder_or_file_and_one_without_a_chain_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        let report =
            |links: &str| files::write_whole(&path, format!(r#"{{"max_flip":0.05,"chain":{{"links":[{links}]}}}}"#).as_bytes());
        report(r#"{"method":"billboard","level":null,"from_height_px":null,"from_distance":0}"#).unwrap();
        assert_eq!(of_comparison(folder.path()).unwrap(), of_comparison(&path).unwrap());
        report("").unwrap();
        let told = of_comparison(&path).unwrap_err().to_string();
        assert!(told.contains("report.json") && told.contains("0.05"), "{told}");
        assert!(matches!(of_comparison(&folder.path().join("none")), Err(Error::NoSuchFile { .. })));
    }
}
