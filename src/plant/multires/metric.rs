//! How much a branch counts (Lluch03 §5.1), and what is left of that while the multichain is written (§5.3, eq. 4).
//!
//! Equation 4 takes from a branch's weight the length of everything below it that has been output; for branching length (d) the weight
//! left is therefore the branching length over the branches not yet output. The paper says nothing of metrics (a)–(c); for them too we
//! count only branches not yet output (ours).
//!
//! A subtree is *visited* once per level that grows in it: visit 0 outputs its top branch and a path from there to a leaf, each later
//! visit one more path. What the subtree still weighs before visit `i` is then a fold over its visits from `i` to the last:
//!
//! | metric | weight left | fold | a visit's value |
//! | --- | --- | --- | --- |
//! | (a) children | the top's children not output | sum | 1 if it outputs a child of the top |
//! | (b) descendants | the top's descendants not output | sum | how many of them it outputs |
//! | (c) longest path | the longest path not output | max | the length of its path |
//! | (d) branching length | the length not output | sum | the length of its path |
//!
//! So the weight never grows from visit to visit, whatever the metric: the one fact that sorting (`visits`) needs. (For a
//! subtree whose top has been output, (a) counts 0 while grandchildren wait; weights compare subtrees, and the finished take no part.)

use super::WeightedTree;

crate::choices! {
    /// The weight of a branch, by which levels are chosen.
    pub enum Metric {
        /// Metric (a): how many branches grow from it.
        Children = "children",
        /// Metric (b): how many branches grow from it, and from these, and so on.
        Descendants = "descendants",
        /// Metric (c): the length of the longest path from its begin to a leaf.
        LongestPath = "longest-path",
        /// Metric (d): its own length and that of all its descendants; the paper's choice.
        BranchingLength = "branching-length",
    }
}

impl Metric {
    /// Two folds over visits, put together.
    pub(super) fn fold(self, a: u64, b: u64) -> u64 {
        if self == Self::LongestPath { a.max(b) } else { a + b }
    }

    /// Whether weights are lengths, not numbers of branches.
    pub(super) fn is_length(self) -> bool {
        matches!(self, Self::LongestPath | Self::BranchingLength)
    }
}

/// Lengths as whole numbers, so that sums are exact: what is equal stays equal however it was added up, and ties are ties.
///
/// The unit is the power of two that brings the sum of all lengths just below 2⁶⁰; a length loses at most half a unit. (Lengths whose sum
/// no number can hold weigh nothing, all alike.)
pub(super) fn whole_lengths(tree: &WeightedTree) -> Vec<u64> {
    let total: f64 = tree.branches().iter().map(|b| b.length).sum();
    let sensible = total > 0.0 && total.is_finite();
    // The roundings of 2³² branches have room in what 2⁶⁰ leaves free of 2⁶⁴.
    let units = if sensible { (59.0 - total.log2().floor()).min(1000.0).exp2() } else { 0.0 };
    tree.branches().iter().map(|b| (b.length * units).round() as u64).collect()
}

/// The weight of every branch before anything is output (fig. 3), in the unit of the chain or in branches.
pub fn weights(tree: &WeightedTree, metric: Metric) -> Vec<f64> {
    let mut weights: Vec<f64> = tree.branches().iter().map(|branch| if metric.is_length() { branch.length } else { 0.0 }).collect();
    let mut longest = vec![0f64; weights.len()];
    for b in (0..weights.len()).rev() {
        // Children stand after their parent: this branch has received all of its own.
        weights[b] += longest[b];
        let Some(parent) = tree.branches()[b].parent.map(|p| p as usize) else { continue };
        match metric {
            Metric::Children => weights[parent] += 1.0,
            Metric::Descendants => weights[parent] += weights[b] + 1.0,
            Metric::LongestPath => longest[parent] = longest[parent].max(weights[b]),
            Metric::BranchingLength => weights[parent] += weights[b],
        }
    }
    weights
}
