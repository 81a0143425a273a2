//! The order in which branches are output, for all metrics, in O(n log² n) whatever the tree's shape (ours).
//!
//! The paper finds every level by a walk from the root (§5.3): at a branch already output it goes on to the child that weighs most. That
//! costs the depth of the tree per level, which a long trunk with many twigs makes quadratic. But what the walk does at one branch depends
//! on nothing outside it: each time it comes, it goes to the child of largest weight left, the first of equals. A child's weight left
//! never grows from visit to visit ([`metric`](super::metric)), so the visits of a branch are those of its children, sorted by the weight
//! that the child has before the visit, falling; among equals, by the children's order. (A merge of falling sequences that always takes
//! the largest head is that sort.) From the leaves to the root, the sequences of visits are merged so; the root's are the levels.
//!
//! A sequence is a treap whose nodes know the fold of their subtree, which gives the weight before any visit. Merging moves the visits of
//! all children but the one that has most into that one's treap: a visit moves at most log₂ n times, and each move takes O(log n).

use super::metric::{Metric, whole_lengths};
use super::{NONE, WeightedTree};

/// The levels of a tree, coarsest first: the branch at which each begins, and where each path goes on.
pub(super) struct Order {
    /// The first branch of every level.
    pub starts: Vec<u32>,
    /// The child that a new path takes from each branch; [`NONE`] from a leaf.
    pub heir: Vec<u32>,
}

/// Sorts the branches of `tree`.
pub(super) fn order(tree: &WeightedTree, metric: Metric) -> Order {
    let branches = tree.branches().len();
    let mut merger = Merger {
        metric,
        visits: Treap { metric, nodes: vec![Node::default(); branches] },
        lengths: if metric.is_length() { whole_lengths(tree) } else { vec![] },
        sequences: vec![Sequence::default(); branches],
        heir: vec![NONE; branches],
        moving: vec![],
    };
    // Children stand after their parent, so that they are done before it.
    for b in (0..branches).rev() {
        merger.visit_branch(tree, b);
    }
    // A visit is known by the leaf at which its path ends; the highest branch with that leaf is where the path begins.
    let mut start_of = vec![0; branches];
    for b in (0..branches).rev() {
        start_of[merger.sequences[b].first as usize] = b as u32;
    }
    let mut starts = vec![];
    merger.visits.for_each_from_last(merger.sequences[0].root, |visit, _| starts.push(start_of[visit as usize]));
    starts.reverse();
    Order { starts, heir: merger.heir }
}

/// The visits of one subtree.
#[derive(Clone, Copy, Default)]
struct Sequence {
    /// Of its treap.
    root: u32,
    /// The first visit.
    first: u32,
    /// How many there are: one per leaf.
    len: u32,
}

/// A visit on its way into the sequence of a sibling.
struct Moving {
    /// What its child weighs before it.
    weight: u64,
    child: u32,
    visit: u32,
}

struct Merger {
    metric: Metric,
    /// Node `v` is the visit whose path ends at leaf `v`.
    visits: Treap,
    lengths: Vec<u64>,
    sequences: Vec<Sequence>,
    heir: Vec<u32>,
    moving: Vec<Moving>,
}

impl Merger {
    /// Makes the sequence of branch `b` out of those of its children.
    fn visit_branch(&mut self, tree: &WeightedTree, b: usize) {
        let children = tree.children(b);
        self.sequences[b] = match children {
            [] => {
                self.visits.nodes[b] = Node { priority: priority(b as u32), ..Node::default() };
                Sequence { root: b as u32, first: b as u32, len: 1 }
            }
            &[child] => {
                self.heir[b] = child;
                self.sequences[child as usize]
            }
            _ => self.merge(b, children),
        };
        self.revalue(tree, b);
    }

    fn merge(&mut self, b: usize, children: &[u32]) -> Sequence {
        let of = |s: &Self, child: u32| s.sequences[child as usize];
        let weight = |s: &Self, child: u32| s.visits.nodes[of(s, child).root as usize].fold;
        // The first of those that weigh most: `max_by_key` would give the last.
        let heir = children.iter().copied().rev().max_by_key(|&c| weight(self, c)).expect("a branch that forks has children");
        let host = children.iter().copied().max_by_key(|&c| of(self, c).len).expect("a branch that forks has children");
        let len = children.iter().map(|&c| of(self, c).len).sum();
        self.heir[b] = heir;

        let mut moving = std::mem::take(&mut self.moving);
        for &child in children.iter().filter(|&&c| c != host) {
            self.visits.for_each_from_last(of(self, child).root, |visit, weight| moving.push(Moving { weight, child, visit }));
        }
        // Pushed from last to first, and sorted from last to first: equals of one child keep their order.
        moving.sort_by(|x, y| x.weight.cmp(&y.weight).then(y.child.cmp(&x.child)));
        let (mut done, mut rest) = (NONE, of(self, host).root);
        for Moving { weight, child, visit } in moving.drain(..).rev() {
            let (before, after) = self.visits.split(rest, |left| left > weight || (left == weight && host < child));
            self.visits.make_single(visit);
            done = self.visits.join(done, before);
            done = self.visits.join(done, visit);
            rest = after;
        }
        self.moving = moving;
        let root = self.visits.join(done, rest);
        self.visits.nodes[root as usize].parent = NONE;
        Sequence { root, first: of(self, heir).first, len }
    }

    /// Gives the visits of `b` the values that the metric's table asks for, now that `b` is the top of the subtree.
    fn revalue(&mut self, tree: &WeightedTree, b: usize) {
        let first = self.sequences[b].first;
        match self.metric {
            Metric::LongestPath | Metric::BranchingLength => self.visits.revalue(first, |value| value + self.lengths[b]),
            Metric::Descendants => {
                for &child in tree.children(b) {
                    self.visits.revalue(self.sequences[child as usize].first, |value| value + 1);
                }
            }
            Metric::Children => {
                for &grandchild in tree.children(b).iter().flat_map(|&child| tree.children(child as usize)) {
                    self.visits.revalue(self.sequences[grandchild as usize].first, |_| 0);
                }
                for &child in tree.children(b) {
                    self.visits.revalue(self.sequences[child as usize].first, |_| 1);
                }
            }
        }
    }
}

/// Heap order for the treap: SplitMix64's finaliser, so that it is the same on every run.
fn priority(visit: u32) -> u32 {
    let mut z = u64::from(visit).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 32) as u32
}

#[derive(Clone, Copy)]
struct Node {
    left: u32,
    right: u32,
    parent: u32,
    priority: u32,
    value: u64,
    /// The metric's fold of the values of its subtree.
    fold: u64,
}

impl Default for Node {
    fn default() -> Self {
        Self { left: NONE, right: NONE, parent: NONE, priority: 0, value: 0, fold: 0 }
    }
}

/// Sequences of visits as randomised search trees, by place (Seidel & Aragon 1996, "Randomized search trees").
struct Treap {
    metric: Metric,
    nodes: Vec<Node>,
}

impl Treap {
    fn fold(&self, node: u32) -> u64 {
        if node == NONE { 0 } else { self.nodes[node as usize].fold }
    }

    /// Brings a node's fold up to date with its children, and its children's parent with it.
    fn update(&mut self, node: u32) {
        let Node { left, right, value, .. } = self.nodes[node as usize];
        for child in [left, right].into_iter().filter(|&c| c != NONE) {
            self.nodes[child as usize].parent = node;
        }
        self.nodes[node as usize].fold = self.metric.fold(self.metric.fold(self.fold(left), value), self.fold(right));
    }

    fn make_single(&mut self, node: u32) {
        let n = &mut self.nodes[node as usize];
        *n = Node { left: NONE, right: NONE, parent: NONE, fold: n.value, ..*n };
    }

    /// Changes the value of a visit, wherever it stands.
    fn revalue(&mut self, node: u32, change: impl Fn(u64) -> u64) {
        let value = self.nodes[node as usize].value;
        self.nodes[node as usize].value = change(value);
        let mut at = node;
        while at != NONE {
            self.update(at);
            at = self.nodes[at as usize].parent;
        }
    }

    /// Splits before the first visit whose weight (the fold from it to the end) no longer satisfies `stays`.
    fn split(&mut self, root: u32, stays: impl Fn(u64) -> bool) -> (u32, u32) {
        self.split_before(root, 0, &stays)
    }

    fn split_before(&mut self, root: u32, after: u64, stays: &impl Fn(u64) -> bool) -> (u32, u32) {
        if root == NONE {
            return (NONE, NONE);
        }
        let Node { left, right, value, .. } = self.nodes[root as usize];
        let behind = self.metric.fold(self.fold(right), after);
        let weight = self.metric.fold(value, behind);
        if stays(weight) {
            let (before, rest) = self.split_before(right, after, stays);
            self.nodes[root as usize].right = before;
            self.update(root);
            (root, rest)
        } else {
            let (before, rest) = self.split_before(left, weight, stays);
            self.nodes[root as usize].left = rest;
            self.update(root);
            (before, root)
        }
    }

    fn join(&mut self, a: u32, b: u32) -> u32 {
        if a == NONE || b == NONE {
            return if a == NONE { b } else { a };
        }
        let root = if self.nodes[a as usize].priority >= self.nodes[b as usize].priority {
            self.nodes[a as usize].right = self.join(self.nodes[a as usize].right, b);
            a
        } else {
            self.nodes[b as usize].left = self.join(a, self.nodes[b as usize].left);
            b
        };
        self.update(root);
        root
    }

    /// Every visit from the last to the first, with the weight before it.
    fn for_each_from_last(&self, root: u32, mut each: impl FnMut(u32, u64)) {
        let (mut path, mut at, mut weight) = (vec![], root, 0);
        while at != NONE || !path.is_empty() {
            while at != NONE {
                path.push(at);
                at = self.nodes[at as usize].right;
            }
            let Some(node) = path.pop() else { break };
            weight = self.metric.fold(weight, self.nodes[node as usize].value);
            each(node, weight);
            at = self.nodes[node as usize].left;
        }
    }
}
