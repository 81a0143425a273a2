//! The leaves that one tree shows at the moment, as they lie on a device, and what has to be sent there after a change of level
//! (`Visualised_leaves`, Rebollo §IV-A and fig. 7).
//!
//! Between two collapses of a cluster the first of the two leaves that go next is growing into the one that replaces them while the other
//! shrinks: how far that has gone is told by [`ClusterLevel`]. These pairs stand in a list of their own, so that all others, nine in ten, are
//! drawn as the plain leaves that they are. Both lists are without gaps: no vertex is ever worked on for a leaf that is not shown. A leaf
//! takes over the place of its heir, the next pair that of the last, and what leaves the middle of a list is replaced by its end. So a
//! collapse or a split writes four places.

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

/// Bytes of a leaf in a list on a device: the vertices of its two triangles.
pub const LISTED: usize = 6 * size_of::<u32>();

/// What has to be sent: ranges of [`Shown::still`], [`Shown::pairs`] and [`Shown::levels`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sent {
    /// Whether the level of all is another.
    pub level: bool,
    /// Of leaves that are as they are.
    pub still: Vec<Range<usize>>,
    /// Of pairs.
    pub pairs: Vec<Range<usize>>,
    /// Of levels.
    pub levels: Vec<Range<usize>>,
    /// Clusters that show other leaves than before.
    pub changed: usize,
    /// Clusters of which at least the level is sent.
    pub touched: usize,
}

impl Sent {
    /// How many bytes that is; none where nothing has changed.
    pub fn bytes(&self) -> usize {
        let of = |ranges: &[Range<usize>], each: usize| ranges.iter().map(|range| each * range.len()).sum::<usize>();
        let level = if self.level { size_of::<f32>() } else { 0 };
        level + of(&self.still, LISTED) + of(&self.pairs, 2 * LISTED) + of(&self.levels, size_of::<ClusterLevel>())
    }
}

/// A list without gaps, each place of which is somebody's.
#[derive(Debug, Clone)]
struct Places<T> {
    entries: Vec<T>,
    /// Whose each place is.
    owner: Vec<u32>,
    /// Where each owner's place is, if there is one.
    place: Vec<u32>,
    /// Places written since the last change was told.
    dirty: Vec<u32>,
}

/// No place.
const NOWHERE: u32 = u32::MAX;

impl<T: Copy> Places<T> {
    /// Nothing yet, for so many owners.
    fn new(owners: usize) -> Self {
        Self { entries: vec![], owner: vec![], place: vec![NOWHERE; owners], dirty: vec![] }
    }

    fn has(&self, owner: u32) -> bool {
        self.place[owner as usize] != NOWHERE
    }

    /// Puts an entry in the place of its owner, a new one at the end if there is none.
    fn put(&mut self, owner: u32, entry: T) {
        let place = &mut self.place[owner as usize];
        if *place == NOWHERE {
            *place = self.entries.len() as u32;
            self.entries.push(entry);
            self.owner.push(owner);
        }
        self.entries[*place as usize] = entry;
        self.dirty.push(*place);
    }

    /// Puts an entry in the place of another owner, who has none then.
    fn put_instead(&mut self, gone: u32, owner: u32, entry: T) {
        let place = std::mem::replace(&mut self.place[gone as usize], NOWHERE);
        self.place[owner as usize] = place;
        self.owner[place as usize] = owner;
        self.put(owner, entry);
    }

    /// Takes away the place of an owner, if there is one; the last comes into it.
    fn remove(&mut self, owner: u32) {
        let place = std::mem::replace(&mut self.place[owner as usize], NOWHERE);
        if place == NOWHERE {
            return;
        }
        let (last, entry) = self.owner.pop().zip(self.entries.pop()).expect("it has a place");
        if last != owner {
            self.place[last as usize] = place;
            self.owner[place as usize] = last;
            self.put(last, entry);
        }
    }

    /// Places to be sent, as few ranges.
    fn sent(&mut self) -> Vec<Range<usize>> {
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.retain(|&place| (place as usize) < self.entries.len());
        dirty.sort_unstable();
        dirty.dedup();
        ranges(&dirty, 1)
    }
}

/// The leaves shown of one tree: all that it has of its own (fig. 10).
#[derive(Debug, Clone)]
pub struct Shown {
    resolution: Resolution,
    /// Numbers of leaves ([`Forest::flat`]) that are as they are. Owner: the original whose picture is worn there, by its place among all
    /// clusters' originals.
    still: Places<u32>,
    /// The two leaves of each cluster that are on their way into one.
    pairs: Places<[u32; 2]>,
    levels: Vec<ClusterLevel>,
    level: f32,
    /// Places of leaves that are as they are, written since the lists were made.
    scattered: usize,
}

/// One in so many places may be written before the lists are put in order again.
const ORDERLY: usize = 4;

/// Levels of clusters so near one another are sent at once.
const GAP: u32 = 4;

impl Shown {
    /// The original.
    pub fn finest(forest: &LeafForest) -> Self {
        let structure = &forest.forest;
        let levels = (0..structure.clusters() as u32).map(|cluster| uniform_level(forest, cluster, 0)).collect();
        let (still, pairs) = listed(structure, &Resolution::finest(structure));
        Self { resolution: Resolution::finest(structure), still, pairs, levels, level: 0.0, scattered: 0 }
    }

    /// Another level: the lists from scratch, in the order in which leaves are stored.
    pub fn at(forest: &LeafForest, wanted: &Wanted) -> Self {
        let mut shown = Self::finest(forest);
        shown.step(forest, wanted);
        (shown.still, shown.pairs) = listed(&forest.forest, &shown.resolution);
        shown
    }

    /// Numbers of the leaves that are as they are.
    pub fn still(&self) -> &[u32] {
        &self.still.entries
    }

    /// Numbers of those that are on their way into another: the heir, which grows into it, and the one that shrinks.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs.entries
    }

    /// How many leaves are shown.
    pub fn leaves(&self) -> usize {
        self.still().len() + 2 * self.pairs().len()
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
        let before = self.level();
        let (changes, touched) = self.step(forest, wanted);
        for change in &changes {
            self.rewrite(&forest.forest, *change);
        }
        let (still, pairs, levels) = (self.still.sent(), self.pairs.sent(), ranges(&touched, GAP));
        self.scattered += still.iter().map(Range::len).sum::<usize>();
        Sent { level: self.level() != before, still, pairs, levels, changed: changes.len(), touched: touched.len() }
    }

    /// Puts the lists in the order in which leaves are stored where changes have scattered them: what is drawn reads vertices one after
    /// another then. Gives what is to be sent instead of `sent`: on the average, `ORDERLY` places more for each that changes.
    pub fn tidied(&mut self, forest: &LeafForest, sent: Sent) -> Sent {
        if ORDERLY * self.scattered <= self.leaves() {
            return sent;
        }
        (self.still, self.pairs) = listed(&forest.forest, &self.resolution);
        self.scattered = 0;
        self.whole(sent)
    }

    /// The same with all of both lists.
    pub fn whole(&self, sent: Sent) -> Sent {
        let all = |leaves: usize| Vec::from_iter((leaves > 0).then_some(0..leaves));
        Sent { still: all(self.still().len()), pairs: all(self.pairs().len()), ..sent }
    }

    /// Goes to another level, but for the lists; gives the clusters that change, and those whose level does.
    fn step(&mut self, forest: &LeafForest, wanted: &Wanted) -> (Vec<Change>, Vec<u32>) {
        let structure = &forest.forest;
        match wanted {
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
        }
    }

    fn rewrite(&mut self, forest: &Forest, Change { cluster, from, to }: Change) {
        let owner = |number| forest.wearer(LeafId { cluster, number }) as u32;
        let flat = |number| forest.flat(LeafId { cluster, number });
        let before = pair(forest, cluster, usize::from(from));
        let after = pair(forest, cluster, usize::from(to));
        // The last pair, as far as its leaves stay, has no place yet among those that stand still; nor shall the next pair.
        let mut loose: Vec<(u32, u32)> = before.into_iter().flatten().map(|number| (owner(number), flat(number))).collect();
        let mut set = |still: &mut Places<u32>, owner: u32, leaf: u32| match loose.iter_mut().find(|loose| loose.0 == owner) {
            Some(loose) => loose.1 = leaf,
            None => still.put(owner, leaf),
        };
        let mut gone = vec![];
        for collapsed in from..to {
            let Some([heir, absorbed, made]) = forest.next(cluster, usize::from(collapsed)) else { break };
            set(&mut self.still, owner(heir), flat(made));
            gone.push(owner(absorbed));
        }
        for collapsed in (to..from).rev() {
            let Some([heir, absorbed, _]) = forest.next(cluster, usize::from(collapsed)) else { break };
            set(&mut self.still, owner(heir), flat(heir));
            set(&mut self.still, owner(absorbed), flat(absorbed));
        }
        gone.extend(after.into_iter().flatten().map(owner));
        loose.retain(|(owner, _)| !gone.contains(owner));
        // What is loose goes to where something leaves.
        gone.retain(|owner| self.still.has(*owner));
        for (owner, leaf) in loose {
            match gone.pop() {
                Some(gone) => self.still.put_instead(gone, owner, leaf),
                None => self.still.put(owner, leaf),
            }
        }
        gone.into_iter().for_each(|owner| self.still.remove(owner));
        match after {
            Some(pair) => self.pairs.put(cluster, pair.map(flat)),
            None => self.pairs.remove(cluster),
        }
    }
}

/// The lists of a level: leaves that are as they are, and pairs.
fn listed(forest: &Forest, resolution: &Resolution) -> (Places<u32>, Places<[u32; 2]>) {
    let (mut still, mut pairs) = (Places::new(forest.leaves()), Places::new(forest.clusters()));
    let mut others = vec![];
    for cluster in 0..forest.clusters() as u32 {
        let collapsed = resolution.collapsed(cluster);
        let pair = pair(forest, cluster, collapsed);
        others.clear();
        others.extend(forest.shown(cluster, collapsed).skip(2 * usize::from(pair.is_some())));
        others.sort_unstable();
        for leaf in others.iter().map(|&number| LeafId { cluster, number }) {
            still.put(forest.wearer(leaf) as u32, forest.flat(leaf));
        }
        if let Some(pair) = pair {
            pairs.put(cluster, pair.map(|number| forest.flat(LeafId { cluster, number })));
        }
    }
    (still.dirty, pairs.dirty) = (vec![], vec![]);
    (still, pairs)
}

/// The heir of a cluster's next collapse and what it absorbs.
fn pair(forest: &Forest, cluster: u32, collapsed: usize) -> Option<[u16; 2]> {
    forest.next(cluster, collapsed).map(|[heir, absorbed, _]| [heir, absorbed])
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

/// Rising numbers as few ranges, those together that are no farther apart than `gap`.
fn ranges(rising: &[u32], gap: u32) -> Vec<Range<usize>> {
    rising.chunk_by(|a, b| b - a <= gap).map(|run| run[0] as usize..run[run.len() - 1] as usize + 1).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Seed;
    use crate::repr::lodf::foliage::synthetic;

    fn sorted(shown: &Shown) -> Vec<u32> {
        let mut entries = [shown.still(), shown.pairs().as_flattened()].concat();
        entries.sort_unstable();
        entries
    }

    /// What a device would hold of a list after being sent only that.
    fn receive<T: Copy>(device: &mut Vec<T>, list: &[T], nothing: T, sent: &[Range<usize>]) {
        device.resize(list.len(), nothing);
        sent.iter().for_each(|range| device[range.clone()].copy_from_slice(&list[range.clone()]));
    }

    /// Just the leaves that go next stand among the pairs.
    fn only_pairs_are_on_their_way(structure: &Forest, shown: &Shown) -> bool {
        let wanted = (0..structure.clusters() as u32).filter_map(|cluster| {
            let pair = pair(structure, cluster, shown.resolution.collapsed(cluster))?;
            Some(pair.map(|number| structure.flat(LeafId { cluster, number })))
        });
        let (mut wanted, mut found): (Vec<_>, Vec<_>) = (wanted.collect(), shown.pairs().to_vec());
        wanted.sort_unstable();
        found.sort_unstable();
        wanted == found
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
            let halfway = Wanted::Uniform(0.5 * structure.changed_groups().len() as f32);
            let mut walked = shown.clone();
            walked.set(&forest, &halfway);
            prop_assert_eq!(sorted(&Shown::at(&forest, &halfway)), sorted(&walked));
            let (mut still, mut pairs, mut levels) = (shown.still().to_vec(), shown.pairs().to_vec(), shown.levels.clone());
            for (uniform, share, seed) in walk {
                let before = shown.resolution.clone();
                let wanted = if uniform {
                    Wanted::Uniform(share * structure.changed_groups().len() as f32)
                } else {
                    Wanted::Variable((0..structure.clusters() as u64).map(|g| 30.0 * Seed(seed).keyed("walk", g).unit() as f32).collect())
                };
                let sent = shown.set(&forest, &wanted);
                receive(&mut still, shown.still(), u32::MAX, &sent.still);
                receive(&mut pairs, shown.pairs(), [u32::MAX; 2], &sent.pairs);
                receive(&mut levels, shown.levels(), shown.levels[0], &sent.levels);
                prop_assert_eq!(&still, shown.still());
                prop_assert_eq!(&pairs, shown.pairs());
                prop_assert_eq!(&levels, &shown.levels);
                prop_assert!(only_pairs_are_on_their_way(structure, &shown));
                prop_assert_eq!(shown.leaves(), shown.resolution.shown());
                let mut straight: Vec<u32> = (0..structure.clusters() as u32).flat_map(|cluster| {
                    structure.shown(cluster, shown.resolution.collapsed(cluster)).map(move |number| structure.flat(LeafId { cluster, number }))
                }).collect();
                straight.sort_unstable();
                prop_assert_eq!(sorted(&shown), straight);
                // Four places for each collapse or split, runs of near levels sent with what lies between; levels of touched clusters only.
                let differ = (0..structure.clusters() as u32).map(|g| before.collapsed(g).abs_diff(shown.resolution.collapsed(g)));
                let steps: usize = differ.clone().sum();
                prop_assert_eq!(sent.changed, differ.filter(|d| *d > 0).count());
                prop_assert!(sent.bytes() <= 4 + 2 * steps * 4 * 8 + sent.touched * size_of::<ClusterLevel>() * 8);
                // However scattered, in order they show the same.
                let (mut tidy, sorted_before) = (shown.clone(), sorted(&shown));
                let all = tidy.tidied(&forest, Sent::default());
                prop_assert!(all == Sent::default() || all.bytes() == LISTED * shown.leaves());
                prop_assert_eq!(sorted(&tidy), sorted_before);
                prop_assert_eq!(shown.set(&forest, &wanted).bytes(), 0, "nothing changes");
            }
        }
    }

    #[test]
    fn a_little_change_sends_little() {
        let forest = LeafForest::of(&synthetic(20_000, Seed(5)), 280);
        let mut shown = Shown::finest(&forest);
        let all = 4 * shown.leaves();
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
