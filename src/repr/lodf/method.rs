//! LoDF as one of the methods.

use std::sync::Arc;

use super::{Detail, LeafForest, Zones};
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec};
use crate::repr::{BuiltPart, BuiltTree, Drawn, Job, Level, Representation, Scope, Seen, SourceKind, TreeSource};
use crate::{Result, Warning};

crate::params! {
    /// Levels of detail of foliage.
    pub struct LodfParams {
        /// Leaves of a cluster, on the average: so many end up as one.
        cluster_leaves: u32 = 72, in 2..=4096, unit "", source "Rebollo tables IV and V: 63 to 75";
        /// D_MIN: nearer than that, in heights of the tree, every leaf is shown.
        full_within: f64 = 2.0, in 0.0..=1000.0, unit "heights", source "ours: a tree fills the picture";
        /// D_MAX: farther than that no fewer leaves are shown.
        least_beyond: f64 = 20.0, in 0.01..=10000.0, unit "heights", source "ours: a tree is 65 px high at 1080 rows";
        /// Share of the leaves that is shown there; never fewer than one a cluster.
        least_share: f64 = 0.1, in 0.0..=1.0, unit "", source "ours: one leaf a cluster is seen to be too few";
        /// Whether all of a crown has the same detail, or by what its zones are finer or coarser.
        zones: Zones = Zones::Uniform, unit "", source "Rebollo §IV-B: far away no zone needs more than another";
    }
}

impl LodfParams {
    /// As what is drawn has it.
    pub fn detail(&self) -> Detail {
        let near = self.full_within as f32;
        Detail { near, far: (self.least_beyond as f32).max(near * 1.001 + 1e-3), least: self.least_share as f32, zones: self.zones }
    }
}

/// Level of detail foliage.
pub struct Lodf;

/// Shares of the leaves that are written to files and counted.
const SHARES: [f32; 4] = [1.0, 0.6, 0.3, 0.1];

impl Representation for Lodf {
    fn id(&self) -> &'static str {
        "lodf"
    }

    fn name(&self) -> &'static str {
        "Level of detail foliage"
    }

    fn citation(&self) -> &'static str {
        "Rebollo et al. 2007, §IV and fig. 2–10"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Foliage]
    }

    fn partner(&self) -> &'static str {
        "lodstrips"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::REFERENCE
    }

    fn specs(&self) -> Vec<ParamSpec> {
        LodfParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.in_leaf().err()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        built(job, &job.settings.read()?, false)
    }
}

/// The foliage of a source as forests; `resent` as [`LeafForest::resent`].
///
/// # Errors
/// [`Error::EmptyModel`](crate::Error::EmptyModel) for a tree of nothing.
pub fn built(job: &Job, params: &LodfParams, resent: bool) -> Result<BuiltTree> {
    let bounds = job.source.box_of_all()?;
    let mut warnings = vec![];
    let mut parts = vec![];
    for part in job.source.parts(Scope::Foliage) {
        let leaves = part.surface.mesh.polygon_count();
        let forest = LeafForest {
            anchor: bounds.center(),
            detail: params.detail(),
            resent,
            ..LeafForest::of(&part.surface, leaves.div_ceil(params.cluster_leaves as usize))
        };
        warnings.extend(doubts(&part.name, part.surface.mesh.triangles.len(), leaves));
        parts.push(BuiltPart { part: part.clone(), drawn: Drawn::Forest(Arc::new(forest)), seen: Seen::default() });
    }
    let levels = levels(&params.detail());
    Ok(BuiltTree { levels, warnings, ..BuiltTree::new(bounds, parts) })
}

/// How leaves were recognised, where they are not plain quads.
fn doubts(part: &str, triangles: usize, leaves: usize) -> Option<Warning> {
    (triangles > 0).then(|| {
        let message = format!(
            "{part}: {triangles} of {leaves} leaves are triangles that make no quad with a neighbour; they are taken for leaves of three corners"
        );
        Warning::new("triangle-leaves", message)
    })
}

/// Those of [`SHARES`] that are reached, from near to far.
fn levels(detail: &Detail) -> Vec<Level> {
    // Levels that begin at the viewer's eye would be seen nowhere.
    const NEAREST: f32 = 0.01;
    let reached = SHARES.iter().filter(|share| **share >= detail.least || **share == 1.0);
    reached
        .map(|share| Level { name: format!("{:.0} % of leaves", 100.0 * share), distance: detail.distance_of(*share).max(NEAREST) })
        .collect()
}

/// How wide the bands are over which plain levels give way to one another.
const BAND: f32 = 0.1;

/// A forest as plain surfaces, one for each of the levels, each seen where it has about as many leaves as the forest would show.
pub fn plain_levels(built: &BuiltPart, forest: &LeafForest) -> Vec<BuiltPart> {
    let distances: Vec<f32> = levels(&forest.detail).iter().map(|level| level.distance).collect();
    let edge = |k: usize| (distances[k - 1] * distances[k]).sqrt();
    let level = |(k, distance): (usize, &f32)| {
        let near = if k == 0 { 0.0 } else { edge(k) };
        let far = if k + 1 == distances.len() { f32::MAX } else { edge(k + 1) };
        let surface = forest.surface_at(&built.part.surface, *distance);
        let part = Part { name: format!("{}_{k}", built.part.name), surface, ..built.part.clone() };
        BuiltPart::still(part).seen(Seen::between(forest.anchor, near, far, BAND))
    };
    distances.iter().enumerate().map(level).collect()
}

#[cfg(test)]
mod tests {
    use crate::repr::trial::{bare, built, one_leaf, tree};
    use crate::repr::{BuiltTree, Drawn, Stats};

    fn leaves_at(built: &BuiltTree, distance: f32) -> usize {
        let forest = built.parts.iter().find_map(|part| match &part.drawn {
            Drawn::Forest(forest) => Some(forest.leaves_at(distance)),
            _ => None,
        });
        forest.unwrap()
    }

    #[test]
    fn files_have_plain_levels_with_as_many_leaves_as_are_drawn() {
        for settings in [&[][..], &["full_within=0"], &["least_share=0.5"], &["least_share=1"]] {
            let built = built("lodf", settings, &tree()).unwrap();
            built.check().unwrap();
            let plain = built.clone().plain();
            plain.check().unwrap();
            for level in super::levels(&super::LodfParams::default().detail()).iter().filter(|_| settings.is_empty()) {
                let there: usize = plain
                    .parts_at(level.distance)
                    .filter(|part| part.part.name.starts_with("leaf"))
                    .map(|part| part.part.surface.mesh.polygon_count())
                    .sum();
                assert_eq!(there, leaves_at(&built, level.distance), "{}", level.name);
            }
            for level in &built.levels {
                assert!(Stats::at(&built, level.distance).triangles > 0 && Stats::at(&plain, level.distance).triangles > 0);
            }
        }
    }

    #[test]
    fn one_leaf_is_drawn_and_none_is_refused() {
        let one = built("lodf", &[], &one_leaf());
        assert!(one.is_ok(), "{:?}", one.err());
        for method in ["lodf", "vdf"] {
            let none = built(method, &[], &bare()).unwrap_err().to_string();
            assert!(none.contains("no leaves"), "{none}");
        }
    }
}
