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
use crate::compare::{Contender, Row, TRUTH, Workshop, chain};
use crate::repr::limits::BudgetParams;
use crate::repr::{BuiltTree, Capture, TreeSource};
use crate::{Error, Result, Seed, files};

/// In [`Chains::bands`], the model of a photograph.
pub const PHOTOGRAPH: &str = "photograph";

/// How the stand-in of a band is chosen: among those that are quick enough the quickest whose error is under the limit, or the one of least
/// error where none is; where none is quick enough the quickest. What counts is the time of one among as many as find room in a picture, as a comparison measures it: pixels that are
/// shaded over and over cost a software driver more than triangles.
///
/// Twice as far away there are four times as many trees to each octave of distance, each of a quarter of the pixels: a bound that goes with
/// the square of the height gives every octave the same time. With trees 4.5 m apart, 12 m high, and a view 75° wide a hundred-thousandth of
/// a millisecond makes a quarter of a second an octave, were all of a forest without end seen on the driver that it was measured on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// Mean FLIP that is good enough.
    pub max_flip: f64,
    /// Milliseconds for each pixel of the square over the tree's height.
    pub ms_per_px2: f64,
}

impl Default for Rule {
    fn default() -> Self {
        Self { max_flip: 0.08, ms_per_px2: 1e-5 }
    }
}

impl Rule {
    /// Milliseconds that a tree of that height on the screen may take.
    pub fn most_ms(&self, height_px: f32) -> f64 {
        self.ms_per_px2 * f64::from(height_px).powi(2)
    }

    /// The bands of a comparison's rows, nearest first. The tree itself is not chosen.
    pub fn bands(&self, rows: &[Row]) -> Vec<Band> {
        let able = || rows.iter().filter(|row| row.method != TRUTH && row.failed.is_none());
        let quickest_ms =
            |height_px: f32| able().filter(|row| row.height_px == height_px).map(|row| row.cost.ms).fold(f64::MAX, f64::min);
        let fits = |row: &&Row| row.cost.ms <= self.most_ms(row.height_px).max(quickest_ms(row.height_px));
        let quick: Vec<Row> = able().filter(fits).cloned().collect();
        let mut bands = answer::bands(&quick, self.max_flip, CostKind::Ms);
        for band in bands.iter_mut().filter(|band| band.method.is_none()) {
            let here = quick.iter().filter(|row| row.height_px == band.height_px);
            let Some(best) = here.min_by(|a, b| a.error.flip.total_cmp(&b.error.flip)) else { continue };
            (band.method, band.level) = (Some(best.method.clone()), best.level.clone());
            (band.flip, band.cost) = (best.error.flip, CostKind::Ms.of(&best.cost));
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
    /// By preset, and [`PHOTOGRAPH`]: what is drawn at which height in pixels, nearest first. `cost` is in milliseconds.
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
    use crate::compare::{Cost, Figures};
    use crate::plant::presets::{PRESETS, preset};
    use crate::repr::method;

    fn row(method: &str, height_px: f32, flip: f64, us: u32) -> Row {
        Row {
            method: method.to_owned(),
            level: None,
            height_px,
            error: Figures { flip, ..Figures::default() },
            cost: Cost { ms: 1e-3 * f64::from(us), ..Cost::default() },
            failed: None,
        }
    }

    #[test]
    fn the_least_error_that_is_quick_enough_stands_in_where_none_is_good_enough() {
        let rows = [
            row(TRUTH, 100.0, 0.0, 10),
            row("fine", 100.0, 0.01, 500),
            row("good", 100.0, 0.05, 90),
            row("plain", 100.0, 0.07, 10),
            row("coarse", 100.0, 0.3, 1),
            row("fine", 20.0, 0.01, 5),
            row("plain", 20.0, 0.2, 3),
            row("coarse", 20.0, 0.25, 1),
            row("plain", 1.0, 0.5, 3),
        ];
        let rule = Rule::default();
        let bands = rule.bands(&rows);
        let told: Vec<_> = bands.iter().map(|band| (band.method.as_deref(), band.cost)).collect();
        assert_eq!(
            told,
            [(Some("plain"), 0.01), (Some("plain"), 0.003), (Some("plain"), 0.003)],
            "under the limit the quickest; else the least error"
        );
        assert_eq!(Chain::of(&bands).links.len(), 1);
        let hurried = Rule { ms_per_px2: 1e-12, ..rule }.bands(&rows);
        assert!(
            hurried[..2].iter().all(|band| band.method.as_deref() == Some("coarse")),
            "where none is quick enough the quickest"
        );
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
