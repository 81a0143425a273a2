//! Which level of detail every cluster of a forest has (Rebollo §IV-B and C, algorithms 1, 2 and 4).
//!
//! Slips of the printed algorithms that are set right here, each with its test: algorithm 2 reads `Changed_groups` before it steps back, so
//! that a split changes the cluster of the next collapse instead of the last one; algorithm 4 adds the numbers of leaves where it must
//! subtract them; and a variable change leaves the uniform `index` behind, so that the next uniform change starts from a level that is
//! not there.

use super::forest::Forest;

/// The levels of all clusters of one tree: what an instance has of its own (fig. 10).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resolution {
    /// Collapses done in each cluster: `Init_group` is twice that.
    collapsed: Vec<u16>,
    /// How many of `Changed_groups` are done, while the level is uniform.
    index: Option<usize>,
    /// Leaves shown.
    shown: usize,
}

/// How a cluster has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// Which.
    pub cluster: u32,
    /// Collapses done before.
    pub from: u16,
    /// Collapses done now.
    pub to: u16,
}

impl Resolution {
    /// The original.
    pub fn finest(forest: &Forest) -> Self {
        Self { collapsed: vec![0; forest.clusters()], index: Some(0), shown: forest.leaves() }
    }

    /// Whether all clusters are at one place of `Changed_groups`.
    pub fn is_uniform(&self) -> bool {
        self.index.is_some()
    }

    /// Leaves shown: `n_actual_leaves`.
    pub fn shown(&self) -> usize {
        self.shown
    }

    /// Collapses done in a cluster.
    pub fn collapsed(&self, cluster: u32) -> usize {
        usize::from(self.collapsed[cluster as usize])
    }

    /// `Init_group` of a cluster: where its leaves begin that are not yet consumed.
    pub fn init_group(&self, cluster: u32) -> usize {
        2 * self.collapsed(cluster)
    }

    /// `Active_leaves` of a cluster.
    pub fn active_leaves(&self, forest: &Forest, cluster: u32) -> usize {
        forest.size(cluster) - self.collapsed(cluster)
    }

    /// Algorithm 2: the same level everywhere, as many leaves as asked for or as near to that as there is. Walks `Changed_groups` from where
    /// it stands; after a variable change, which may be at no place of it, every cluster is compared once. Gives each changed cluster once.
    pub fn set_uniform(&mut self, forest: &Forest, leaves: usize) -> Vec<Change> {
        let target = forest.leaves().saturating_sub(leaves).min(forest.changed_groups().len());
        let Some(index) = self.index.replace(target) else {
            let wanted = forest.collapsed_at(target);
            return self.set(forest, |cluster| usize::from(wanted[cluster as usize]));
        };
        let walked = &forest.changed_groups()[index.min(target)..index.max(target)];
        let mut clusters: Vec<u32> = walked.to_vec();
        clusters.sort_unstable();
        clusters
            .chunk_by(|a, b| a == b)
            .map(|same| {
                let count = same.len() as u16;
                let from = self.collapsed[same[0] as usize];
                let to = if target > index { from + count } else { from - count };
                self.change(same[0], to)
            })
            .collect()
    }

    /// Algorithm 4: as many collapses in each cluster as `wanted` says, or as there are. Gives the changed clusters.
    pub fn set_variable(&mut self, forest: &Forest, wanted: impl FnMut(u32) -> usize) -> Vec<Change> {
        self.index = None;
        self.set(forest, wanted)
    }

    fn set(&mut self, forest: &Forest, mut wanted: impl FnMut(u32) -> usize) -> Vec<Change> {
        let mut changes = vec![];
        for cluster in 0..forest.clusters() as u32 {
            let to = wanted(cluster).min(forest.size(cluster) - 1) as u16;
            if to != self.collapsed[cluster as usize] {
                changes.push(self.change(cluster, to));
            }
        }
        changes
    }

    fn change(&mut self, cluster: u32, to: u16) -> Change {
        let from = std::mem::replace(&mut self.collapsed[cluster as usize], to);
        self.shown = self.shown + usize::from(from) - usize::from(to);
        Change { cluster, from, to }
    }
}
