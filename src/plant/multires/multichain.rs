//! The multichain (Lluch03 §5.3): the modules of a chain in order of importance, cut into levels by SAVE and RESTORE.

use std::ops::Range;

use super::visits::order;
use super::{Metric, NONE, WeightedTree};

/// One element of a multichain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// A module, by its place in the chain that holds it.
    Module(u32),
    /// Store the turtle's state under this number. Numbers count the SAVEs from 0, so that a plain vector can hold the states; the
    /// paper's ids are the branches' own, [`Multichain::saved_by`].
    Save(u32),
    /// Set the turtle back to the state of this number.
    Restore(u32),
}

/// One branch of a multichain, or its tail: `RESTORE?  module*  SAVE?`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Which state it sets out from; `None` where it goes on from the step before it, and at the very first.
    pub restore: Option<u32>,
    /// How many brackets opened between the branch it grows from and itself. They are gone from the chain, and nothing is popped, but a
    /// turtle may tell trunk from branch by them, or thin the wood.
    pub brackets: u32,
    /// The original position of its first module, by which seeded noise may be keyed.
    pub position: u32,
    /// Its modules, where they are stored.
    pub modules: Range<u32>,
    /// Under which number its end is stored, if others grow from it later.
    pub save: Option<u32>,
}

impl Step {
    /// A run of modules that goes on from the step before it.
    fn of(modules: &Range<u32>) -> Self {
        Self { restore: None, brackets: 0, position: modules.start, modules: modules.clone(), save: None }
    }

    /// The step as the paper writes it.
    pub fn items(&self) -> impl Iterator<Item = Item> + use<> {
        let modules = self.modules.clone().map(Item::Module);
        self.restore.map(Item::Restore).into_iter().chain(modules).chain(self.save.map(Item::Save))
    }
}

/// A tree's branches from most to least important. Level 1 is a path from the root to a leaf; every further level restores one state and
/// adds one path (§5.4), tails included (after which it restores the state before them and goes on). Levels are counted from 1, as in the paper: the first `n` of them are level of detail `n`, all of them the tree.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Multichain {
    pub(super) steps: Vec<Step>,
    /// Where each level ends in `steps`.
    pub(super) ends: Vec<u32>,
    /// The step that stores each state.
    pub(super) saved_by: Vec<u32>,
}

impl Multichain {
    /// Sorts the branches of `tree`. Each level is found as by going down from the root to the child of largest weight left, the first of
    /// equals, until a branch is reached that has not been output (§5.3); it goes on to a leaf in the same way. A subtree that has been
    /// output whole is not entered (ours: branches without length would else lead into it). A branch with several children is followed
    /// by a SAVE, as in the paper's example (its text has one after every branch that is no leaf).
    ///
    /// There are never more modules than the original has, brackets, SAVEs and RESTOREs counted: a branch with k > 1 children costs one
    /// SAVE and k − 1 RESTOREs, and had at least k − 1 pairs of brackets; one with a tail costs a RESTORE more, and had k pairs.
    pub fn new(tree: &WeightedTree, metric: Metric) -> Self {
        let order = order(tree, metric);
        let mut chain = Self { steps: Vec::with_capacity(tree.branches().len()), ..Self::default() };
        let mut number_of = vec![NONE; tree.branches().len()];
        for start in order.starts {
            let mut restore = tree.branches()[start as usize].parent.map(|parent| number_of[parent as usize]);
            let mut at = start;
            while at != NONE {
                let branch = &tree.branches()[at as usize];
                let (children, has_tail) = (tree.children(at as usize).len(), !branch.tail.is_empty());
                let save = (children > 1 || children == 1 && has_tail).then_some(chain.saved_by.len() as u32);
                if let Some(number) = save {
                    number_of[at as usize] = number;
                    chain.saved_by.push(chain.steps.len() as u32);
                }
                let brackets = branch.depth - branch.parent.map_or(0, |p| tree.branches()[p as usize].depth);
                chain.steps.push(Step { restore, brackets, save, ..Step::of(&branch.modules) });
                restore = None;
                if has_tail {
                    chain.steps.push(Step::of(&branch.tail));
                    restore = save;
                }
                at = order.heir[at as usize];
            }
            chain.ends.push(chain.steps.len() as u32);
        }
        chain
    }

    /// How many levels there are; a tree has as many as leaves.
    pub fn levels(&self) -> usize {
        self.ends.len()
    }

    /// All branches, most important first.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// What level `n` adds to level `n − 1`; nothing outside `1..=levels()`.
    pub fn level(&self, n: usize) -> &[Step] {
        let begin = self.steps_of_first(n.saturating_sub(1));
        &self.steps[begin..self.steps_of_first(n)]
    }

    /// Level of detail `n` as a whole: its prefix of the steps. Everything for `n` beyond the last level.
    pub fn first(&self, n: usize) -> &[Step] {
        &self.steps[..self.steps_of_first(n)]
    }

    fn steps_of_first(&self, n: usize) -> usize {
        n.min(self.levels()).checked_sub(1).map_or(0, |last| self.ends[last] as usize)
    }

    /// The branch, as an index of [`steps`](Self::steps), whose SAVE has this number; `None` from [`saves`](Self::saves) on.
    pub fn saved_by(&self, number: u32) -> Option<usize> {
        self.saved_by.get(number as usize).map(|&step| step as usize)
    }

    /// How many SAVEs there are: states that a turtle has to hold.
    pub fn saves(&self) -> usize {
        self.saved_by.len()
    }

    /// The whole multichain as the paper writes it.
    pub fn items(&self) -> impl Iterator<Item = Item> {
        self.steps.iter().flat_map(Step::items)
    }
}
