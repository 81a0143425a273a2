//! Which stand-in for which distance: the cheapest whose error stays under a limit, and the chain of levels that follows. Where none stays
//! under it, at least nothing is drawn that something cheaper and no worse could stand for.

use serde::{Deserialize, Serialize};

use crate::repr::REFERENCE_FOCAL_PX;
use crate::{Error, Result};

use super::{Cost, Row};

crate::choices! {
    /// What cheap means.
    pub enum CostKind {
        /// Milliseconds of the device for an instance.
        Ms = "ms",
        /// Bytes of textures and geometry on the device.
        Bytes = "bytes",
        /// Triangles.
        Triangles = "triangles",
    }
}

impl CostKind {
    /// That cost as a number.
    pub fn of(self, cost: &Cost) -> f64 {
        match self {
            Self::Ms => cost.ms,
            Self::Bytes => (cost.texture_bytes + cost.geometry_bytes) as f64,
            Self::Triangles => cost.triangles as f64,
        }
    }
}

/// The answer for one distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// How many pixels high the tree is.
    pub height_px: f32,
    /// From how far on, in tree heights as `repr::Seen` has them: half way, by ratio, to the nearer band.
    pub from_distance: f32,
    /// Method of the cheapest that is good enough; where none is, of the cheapest that is no worse there than what stands before it, and
    /// `None` where nothing does.
    pub method: Option<String>,
    /// Its level; `None` for the one that it draws there itself.
    pub level: Option<String>,
    /// Whether it is good enough.
    #[serde(default)]
    pub good: bool,
    /// Its mean FLIP there, or that of the best where there is no method.
    pub flip: f64,
    /// Its cost.
    pub cost: f64,
    /// The method of least error there, whatever it costs, and that error.
    pub best: Option<(String, f64)>,
}

/// The bands of `rows`, nearest first. The truth itself (`geometry`) counts as a method like any other: it is its own error of zero, at its price.
pub fn bands(rows: &[Row], max_flip: f64, kind: CostKind) -> Vec<Band> {
    let mut heights: Vec<f32> = rows.iter().map(|row| row.height_px).collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    heights.dedup();
    let mut bands: Vec<Band> = vec![];
    let mut before: Option<&Row> = None;
    for (i, &height_px) in heights.iter().enumerate() {
        let here = || rows.iter().filter(move |row| row.height_px == height_px && row.failed.is_none());
        let order = |a: &&Row, b: &&Row| kind.of(&a.cost).total_cmp(&kind.of(&b.cost)).then(a.error.flip.total_cmp(&b.error.flip));
        let cheapest = |most: f64| here().filter(|row| row.error.flip <= most).min_by(order);
        let good = cheapest(max_flip);
        let kept = before.and_then(|old| here().find(|row| (&row.method, &row.level) == (&old.method, &old.level)));
        let chosen = good.or_else(|| cheapest(kept?.error.flip));
        let best = here().filter(|row| row.method != super::TRUTH).min_by(|a, b| a.error.flip.total_cmp(&b.error.flip));
        before = chosen.or(before);
        bands.push(Band {
            height_px,
            from_distance: if i == 0 { 0.0 } else { REFERENCE_FOCAL_PX / (heights[i - 1] * height_px).sqrt() },
            method: chosen.map(|row| row.method.clone()),
            level: chosen.and_then(|row| row.level.clone()),
            good: good.is_some(),
            flip: chosen.or(best).map_or(1.0, |row| row.error.flip),
            cost: chosen.map_or(0.0, |row| kind.of(&row.cost)),
            best: best.map(|row| (row.method.clone(), row.error.flip)),
        });
    }
    bands
}

/// The chain of stand-ins that a comparison recommends, nearest first: what to draw at which distance. `report.json` holds it as `chain`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Chain {
    /// Its links; none where no stand-in is good enough at any distance.
    pub links: Vec<Link>,
}

/// One stand-in of a [`Chain`], drawn until the next one begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Method, or name of a stand-in of somebody else's.
    pub method: String,
    /// One level of it, whatever the distance; `None` for the one that it draws there itself.
    pub level: Option<String>,
    /// It is drawn where the tree is this many pixels high or fewer; `None` for the first, however near.
    pub from_height_px: Option<f32>,
    /// The same as a distance in tree heights, as `repr::Seen` has them: from there on; 0 for the first.
    pub from_distance: f32,
}

impl Chain {
    /// What the bands say: neighbours of one method and level are one. A band without an answer keeps what stands before it.
    pub fn of(bands: &[Band]) -> Self {
        let mut links: Vec<Link> = vec![];
        for band in bands {
            let Some(method) = band.method.clone() else { continue };
            let level = band.level.clone();
            if links.last().is_some_and(|last| (&last.method, &last.level) == (&method, &level)) {
                continue;
            }
            let from_distance = if links.is_empty() { 0.0 } else { band.from_distance };
            let from_height_px = (from_distance > 0.0).then(|| REFERENCE_FOCAL_PX / from_distance);
            links.push(Link { method, level, from_height_px, from_distance });
        }
        Self { links }
    }

    /// The chain of a `report.json`.
    ///
    /// # Errors
    /// [`Error::BrokenReport`] for anything else.
    pub fn of_report(bytes: &[u8]) -> Result<Self> {
        #[derive(Deserialize)]
        struct Report {
            chain: Chain,
        }
        let chain = serde_json::from_slice::<Report>(bytes).map_err(|cause| Error::BrokenReport { what: cause.to_string() })?.chain;
        let distances = chain.links.iter().map(|link| link.from_distance);
        let sound = distances.clone().all(|d| d.is_finite() && d >= 0.0) && distances.is_sorted();
        if sound {
            Ok(chain)
        } else {
            Err(Error::BrokenReport { what: "the links of its chain do not run from near to far".to_owned() })
        }
    }

    /// The link at a distance in tree heights.
    pub fn at(&self, distance: f32) -> Option<&Link> {
        self.links.iter().rev().find(|link| link.from_distance <= distance)
    }
}

/// Which of `rows` (at one distance) no other beats in both cost and error: the rest need not be considered.
pub fn pareto(rows: &[&Row], kind: CostKind) -> Vec<bool> {
    let point = |row: &Row| (kind.of(&row.cost), row.error.flip);
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    rows.iter().map(|row| !rows.iter().any(|other| beats(point(other), point(row)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Figures;

    fn row(method: &str, height_px: f32, flip: f64, ms: f64) -> Row {
        Row {
            method: method.to_owned(),
            level: None,
            height_px,
            error: Figures { flip, ..Figures::default() },
            cost: Cost { ms, ..Cost::default() },
            failed: None,
        }
    }

    #[test]
    fn the_cheapest_that_is_good_enough_wins_and_levels_join_into_a_chain() {
        let rows = [
            row("geometry", 512.0, 0.0, 9.0),
            row("slices", 512.0, 0.05, 3.0),
            row("billboard", 512.0, 0.2, 0.1),
            row("geometry", 64.0, 0.0, 5.0),
            row("slices", 64.0, 0.02, 2.0),
            row("billboard", 64.0, 0.06, 0.1),
            row("geometry", 16.0, 0.0, 5.0),
            row("slices", 16.0, 0.02, 2.0),
            row("billboard", 16.0, 0.03, 0.1),
        ];
        let bands = bands(&rows, 0.08, CostKind::Ms);
        let names: Vec<_> = bands.iter().map(|band| band.method.as_deref().unwrap()).collect();
        assert_eq!(names, ["slices", "billboard", "billboard"]);
        assert_eq!(bands[1].best.as_ref().unwrap().0, "slices");
        let chain = Chain::of(&bands);
        assert_eq!(chain.links.len(), 2);
        let switch = REFERENCE_FOCAL_PX / (512.0f32 * 64.0).sqrt();
        assert!(
            (chain.links[1].from_distance - switch).abs() < 1e-3 && (chain.links[1].from_height_px.unwrap() - 181.0).abs() < 0.1
        );
        assert_eq!(
            (chain.at(0.0).unwrap().method.as_str(), chain.at(switch + 1.0).unwrap().method.as_str()),
            ("slices", "billboard")
        );
        assert!(super::bands(&rows[1..3], 0.01, CostKind::Ms)[0].method.is_none());
    }

    #[test]
    fn where_none_is_good_enough_something_cheaper_and_no_worse_takes_over_or_what_was_there_stays() {
        let rows = [
            row("geometry", 256.0, 0.05, 50.0),
            row("billboard", 256.0, 0.24, 0.1),
            row("geometry", 64.0, 0.18, 20.0),
            row("sphere-board", 64.0, 0.12, 0.6),
            row("octahedral", 64.0, 0.11, 2.0),
            row("billboard", 64.0, 0.24, 0.1),
            row("sphere-board", 16.0, 0.13, 0.5),
            row("octahedral", 16.0, 0.1, 1.9),
            row("billboard", 16.0, 0.14, 0.1),
        ];
        let bands = bands(&rows, 0.08, CostKind::Ms);
        let told: Vec<_> = bands.iter().map(|band| (band.method.as_deref().unwrap(), band.good)).collect();
        assert_eq!(told, [("geometry", true), ("sphere-board", false), ("sphere-board", false)]);
        assert_eq!((bands[1].flip, bands[1].best.clone().unwrap().1), (0.12, 0.11));
        let far = super::bands(&rows[2..], 0.08, CostKind::Ms);
        assert!(far.iter().all(|band| band.method.is_none() && !band.good), "nothing stands before it");
        assert_eq!(far[1].flip, 0.1, "what the best has");
    }

    #[test]
    fn a_chain_is_read_back_from_a_report_or_what_is_wrong_is_said() {
        let link = |from: f32| format!(r#"{{"method":"a","level":null,"from_height_px":null,"from_distance":{from}}}"#);
        let report = |links: &[String]| format!(r#"{{"other":1,"chain":{{"links":[{}]}}}}"#, links.join(","));
        assert_eq!(Chain::of_report(report(&[link(0.0), link(3.0)]).as_bytes()).unwrap().links[1].from_distance, 3.0);
        for broken in [report(&[link(3.0), link(1.0)]), report(&[link(-1.0)]), "{}".to_owned(), String::new()] {
            assert!(matches!(Chain::of_report(broken.as_bytes()), Err(Error::BrokenReport { .. })), "{broken}");
        }
    }

    #[test]
    fn what_is_beaten_in_both_is_not_on_the_front() {
        let rows = [row("a", 1.0, 0.1, 1.0), row("b", 1.0, 0.05, 2.0), row("c", 1.0, 0.2, 2.0), row("d", 1.0, 0.1, 1.0)];
        assert_eq!(pareto(&rows.iter().collect::<Vec<_>>(), CostKind::Ms), [true, true, false, true]);
    }
}
