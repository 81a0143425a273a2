//! The leaves that one tree shows at the moment, one after another without gaps (`Visualised_leaves`, Rebollo §IV-A and fig. 7), as they lie
//! on a device, and what has to be sent there after a change of level.
//!
//! A leaf takes over the place of its heir; the place of what was absorbed goes to the last one. So a collapse or a split writes two
//! places and no vertex is ever worked on for a leaf that is not shown. Between two collapses of a cluster the first of the two leaves that
//! go next is growing into the one that replaces them while the other shrinks: how far that has gone is told by [`ClusterLevel`].

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::LeafForest;
use super::detail::Wanted;
use super::forest::{Forest, LeafId};
use super::resolution::{Change, Resolution};

/// What is under way in a cluster.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ClusterLevel {
    /// The leaf that is being made ([`Forest::flat`]); [`ClusterLevel::NONE`] where one leaf is left.
    pub making: u32,
    /// At which level that began, as [`Shown::level`] counts.
    pub from: f32,
    /// At which it ends.
    pub to: f32,
    /// Unused: keeps the size a multiple of 16.
    pub pad: u32,
}

impl ClusterLevel {
    /// No leaf is being made.
    pub const NONE: u32 = u32::MAX;
    /// A variable level is told in steps of this share of a collapse, so that a cluster is sent only when it can be seen to change.
    const STEPS: f32 = 32.0;
}

/// What has to be sent: ranges of [`Shown::entries`] and of [`Shown::levels`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sent {
    /// Of entries.
    pub entries: Vec<Range<usize>>,
    /// Of levels.
    pub levels: Vec<Range<usize>>,
    /// Clusters that show other leaves than before.
    pub changed: usize,
    /// Clusters of which at least the level is sent.
    pub touched: usize,
}

impl Sent {
    /// How many bytes that is, with the four of the level itself.
    pub fn bytes(&self) -> usize {
        let of = |ranges: &[Range<usize>], each: usize| ranges.iter().map(|range| each * range.len()).sum::<usize>();
        size_of::<f32>() + of(&self.entries, size_of::<u32>()) + of(&self.levels, size_of::<ClusterLevel>())
    }
}

/// The leaves shown of one tree: all that it has of its own (fig. 10).
#[derive(Debug, Clone)]
pub struct Shown {
    resolution: Resolution,
    /// Numbers of leaves ([`Forest::flat`]).
    entries: Vec<u32>,
    /// Whose each place is: the original whose picture is worn there, by its place among all clusters' originals.
    owner: Vec<u32>,
    /// Where each original's picture is worn, if it is.
    slot: Vec<u32>,
    levels: Vec<ClusterLevel>,
    level: f32,
    dirty: Vec<u32>,
}

/// Places so near one another are sent at once.
const GAP: u32 = 8;

impl Shown {
    /// The original, sent in full.
    pub fn finest(forest: &LeafForest) -> Self {
        let leaves = forest.forest.leaves() as u32;
        let entries = (0..forest.forest.clusters() as u32).flat_map(|cluster| {
            (0..forest.forest.size(cluster) as u16).map(move |number| forest.forest.flat(LeafId { cluster, number }))
        });
        let resolution = Resolution::finest(&forest.forest);
        let levels = (0..forest.forest.clusters() as u32).map(|cluster| uniform_level(forest, cluster, 0)).collect();
        let all: Vec<u32> = (0..leaves).collect();
        Self { entries: entries.collect(), owner: all.clone(), slot: all, levels, level: 0.0, dirty: vec![], resolution }
    }

    /// Numbers of the leaves shown.
    pub fn entries(&self) -> &[u32] {
        &self.entries
    }

    /// What is under way in each cluster.
    pub fn levels(&self) -> &[ClusterLevel] {
        &self.levels
    }

    /// How far the foliage is between two collapses, as [`ClusterLevel`] counts.
    pub fn level(&self) -> f32 {
        self.level
    }

    /// Collapses done in each cluster.
    pub fn resolution(&self) -> &Resolution {
        &self.resolution
    }

    /// Shows another level. Touches changed clusters only.
    pub fn set(&mut self, forest: &LeafForest, wanted: &Wanted) -> Sent {
        let structure = &forest.forest;
        let (changes, touched) = match wanted {
            Wanted::Uniform(index) => {
                let last = structure.changed_groups().len() as f32;
                let index = if index.is_nan() { 0.0 } else { index.clamp(0.0, last) };
                let was_variable = !self.resolution.is_uniform();
                let changes = self.resolution.set_uniform(structure, structure.leaves() - index as usize);
                self.level = index;
                let touched: Vec<u32> = if was_variable {
                    (0..structure.clusters() as u32).collect()
                } else {
                    changes.iter().map(|change| change.cluster).collect()
                };
                for &cluster in &touched {
                    self.levels[cluster as usize] = uniform_level(forest, cluster, self.resolution.collapsed(cluster));
                }
                (changes, touched)
            }
            Wanted::Variable(collapsed) => {
                let steps = |cluster: u32| {
                    let wanted = collapsed.get(cluster as usize).copied().unwrap_or(0.0);
                    let most = (structure.size(cluster) - 1) as f32;
                    let wanted = if wanted.is_nan() { 0.0 } else { wanted.clamp(0.0, most) };
                    (wanted * ClusterLevel::STEPS).round() / ClusterLevel::STEPS
                };
                let changes = self.resolution.set_variable(structure, |cluster| steps(cluster) as usize);
                self.level = 0.0;
                let mut touched = vec![];
                for cluster in 0..structure.clusters() as u32 {
                    let level = variable_level(structure, cluster, steps(cluster));
                    if self.levels[cluster as usize] != level {
                        self.levels[cluster as usize] = level;
                        touched.push(cluster);
                    }
                }
                (changes, touched)
            }
        };
        for change in &changes {
            self.rewrite(structure, *change);
        }
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.retain(|&slot| (slot as usize) < self.entries.len());
        dirty.sort_unstable();
        dirty.dedup();
        Sent { entries: ranges(&dirty), levels: ranges(&touched), changed: changes.len(), touched: touched.len() }
    }

    fn rewrite(&mut self, forest: &Forest, Change { cluster, from, to }: Change) {
        for collapsed in from..to {
            let Some([heir, absorbed, made]) = forest.next(cluster, usize::from(collapsed)) else { return };
            let of = |number| LeafId { cluster, number };
            let place = self.slot[forest.wearer(of(heir))];
            self.write(place, forest.flat(of(made)));
            let freed = self.slot[forest.wearer(of(absorbed))];
            let (last, owner) = self.entries.pop().zip(self.owner.pop()).expect("the absorbed one is among them");
            if (freed as usize) < self.entries.len() {
                self.write(freed, last);
                self.owner[freed as usize] = owner;
                self.slot[owner as usize] = freed;
            }
        }
        for collapsed in (to..from).rev() {
            let Some([heir, absorbed, _]) = forest.next(cluster, usize::from(collapsed)) else { return };
            let of = |number| LeafId { cluster, number };
            let place = self.slot[forest.wearer(of(heir))];
            self.write(place, forest.flat(of(heir)));
            let owner = forest.wearer(of(absorbed)) as u32;
            let end = self.entries.len() as u32;
            self.entries.push(0);
            self.write(end, forest.flat(of(absorbed)));
            self.owner.push(owner);
            self.slot[owner as usize] = end;
        }
    }

    fn write(&mut self, slot: u32, leaf: u32) {
        self.entries[slot as usize] = leaf;
        self.dirty.push(slot);
    }
}

fn making(forest: &Forest, cluster: u32, collapsed: usize) -> u32 {
    forest.next(cluster, collapsed).map_or(ClusterLevel::NONE, |[_, _, number]| forest.flat(LeafId { cluster, number }))
}

/// Under way from the cluster's last collapse to its next.
fn uniform_level(forest: &LeafForest, cluster: u32, collapsed: usize) -> ClusterLevel {
    let ends = forest.ends(cluster);
    let from = collapsed.checked_sub(1).map_or(0.0, |last| ends[last] as f32);
    let to = ends.get(collapsed).map_or(from + 1.0, |end| *end as f32);
    ClusterLevel { making: making(&forest.forest, cluster, collapsed), from, to, pad: 0 }
}

/// Under way by so much that it shows at level 0.
fn variable_level(forest: &Forest, cluster: u32, collapsed: f32) -> ClusterLevel {
    let whole = collapsed as usize;
    let done = collapsed - whole as f32;
    ClusterLevel { making: making(forest, cluster, whole), from: -done, to: 1.0 - done, pad: 0 }
}

/// Rising numbers as few ranges, near ones together.
fn ranges(rising: &[u32]) -> Vec<Range<usize>> {
    rising.chunk_by(|a, b| b - a <= GAP).map(|run| run[0] as usize..run[run.len() - 1] as usize + 1).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Seed;
    use crate::repr::lodf::foliage::synthetic;

    fn sorted(shown: &Shown) -> Vec<u32> {
        let mut entries = shown.entries.clone();
        entries.sort_unstable();
        entries
    }

    /// What a device would hold after being sent only that.
    fn receive(device: &mut Vec<u32>, levels: &mut [ClusterLevel], shown: &Shown, sent: &Sent) {
        device.resize(shown.entries.len(), u32::MAX);
        for range in &sent.entries {
            device[range.clone()].copy_from_slice(&shown.entries[range.clone()]);
        }
        for range in &sent.levels {
            levels[range.clone()].copy_from_slice(&shown.levels[range.clone()]);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn the_device_has_what_is_shown_though_only_changes_are_sent(
            leaves in 1usize..300,
            walk in proptest::collection::vec((any::<bool>(), 0.0f32..1.2, any::<u64>()), 1..10),
        ) {
            let forest = LeafForest::of(&synthetic(leaves, Seed(5)), leaves.div_ceil(20));
            let structure = &forest.forest;
            let mut shown = Shown::finest(&forest);
            let (mut device, mut levels) = (shown.entries.clone(), shown.levels.clone());
            for (uniform, share, seed) in walk {
                let before = shown.resolution.clone();
                let wanted = if uniform {
                    Wanted::Uniform(share * structure.changed_groups().len() as f32)
                } else {
                    Wanted::Variable((0..structure.clusters() as u64).map(|g| 30.0 * Seed(seed).keyed("walk", g).unit() as f32).collect())
                };
                let sent = shown.set(&forest, &wanted);
                receive(&mut device, &mut levels, &shown, &sent);
                prop_assert_eq!(&device, &shown.entries);
                prop_assert_eq!(&levels, &shown.levels);
                let mut straight: Vec<u32> = (0..structure.clusters() as u32).flat_map(|cluster| {
                    structure.shown(cluster, shown.resolution.collapsed(cluster)).map(move |number| structure.flat(LeafId { cluster, number }))
                }).collect();
                straight.sort_unstable();
                prop_assert_eq!(sorted(&shown), straight);
                // Two places for each collapse or split, runs of near ones sent with what lies between; levels of touched clusters only.
                let differ = (0..structure.clusters() as u32).map(|g| before.collapsed(g).abs_diff(shown.resolution.collapsed(g)));
                let steps: usize = differ.clone().sum();
                prop_assert_eq!(sent.changed, differ.filter(|d| *d > 0).count());
                prop_assert!(sent.bytes() <= 4 + 2 * steps * 4 * GAP as usize + sent.touched * size_of::<ClusterLevel>() * GAP as usize);
                // Nothing changes: nothing but the level itself is sent.
                prop_assert_eq!(shown.set(&forest, &wanted).bytes(), 4);
            }
        }
    }

    #[test]
    fn a_little_change_sends_little() {
        let forest = LeafForest::of(&synthetic(20_000, Seed(5)), 280);
        let mut shown = Shown::finest(&forest);
        let all = 4 * shown.entries.len();
        shown.set(&forest, &Wanted::Uniform(5_000.0));
        let sent = shown.set(&forest, &Wanted::Uniform(5_010.4));
        assert!(sent.changed <= 10 && sent.touched == sent.changed, "{sent:?}");
        assert!(sent.bytes() * 20 < all, "{} of {all}", sent.bytes());
        // Within one collapse only the level goes.
        assert_eq!(shown.set(&forest, &Wanted::Uniform(5_010.9)).bytes(), 4);
    }

    #[test]
    fn what_is_under_way_ends_where_the_collapse_is_done() {
        let forest = LeafForest::of(&synthetic(200, Seed(2)), 4);
        let mut shown = Shown::finest(&forest);
        for index in 0..196 {
            shown.set(&forest, &Wanted::Uniform(index as f32 + 0.5));
            for level in &shown.levels {
                assert!(level.from <= shown.level && (shown.level < level.to || level.making == ClusterLevel::NONE), "{level:?}");
            }
            let next = shown.levels[forest.forest.changed_groups()[index] as usize];
            assert_eq!(next.to, index as f32 + 1.0);
        }
    }
}
