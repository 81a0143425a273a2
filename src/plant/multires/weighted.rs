//! The weighted tree (Lluch03 §5.2, fig. 3): one node per branch of a bracketed chain, with the modules that draw it and its length.
//!
//! Modules stay where they are: a branch names them by position in the chain, so that any storage will do. Four readings are ours,
//! since the paper's parse (which adds every module between brackets to one node) loses the shape of an ordinary chain:
//!
//! * `F[+F]F` goes on after a side branch. What follows the bracket is a branch of its own, the last child of what stands before it;
//!   its place in the paper's node would move the side branch from the fork to the tip.
//! * A bracket without any advance (a leaf, a lone turn) is no branch: it stays among the modules of the branch that bears it, so that
//!   leaves come and go with their wood. The same holds for everything between `{` and `}`, which one polygon needs together.
//! * What follows the last side branch without any advance (the leaf at a tip, `F[+F][-F]L`) is no branch either, but the *tail* of the one
//!   that bears it.
//! * Brackets that hold nothing of their own (`[[F]]`, `[]`) make no node.

use std::ops::Range;

use crate::{Error, Result};

/// What a module means to the weighted tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// `[`
    Open,
    /// `]`
    Close,
    /// `{`: what follows, up to its [`PolygonEnd`](Role::PolygonEnd), stays together.
    PolygonBegin,
    /// `}`
    PolygonEnd,
    /// `%`: the rest of the branch is not drawn.
    Cut,
    /// Moves the turtle and draws wood; its length in any one unit (§5.1: branches are as long as their advances together).
    Advance(f64),
    /// Anything else: turns, radii, leaves, moves without wood.
    Other,
}

/// One branch: a longest run of modules that no branching bracket interrupts.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// The branch that it grows from; `None` for the root, branch 0.
    pub parent: Option<u32>,
    /// Its modules, as positions in the chain. Balanced brackets may be among them.
    pub modules: Range<u32>,
    /// Its last modules, behind the branches that grow from it; they are read from where `modules` end. Mostly empty.
    pub tail: Range<u32>,
    /// How many branching brackets are open round it.
    pub depth: u32,
    /// The sum of its advances, in the unit of the chain.
    pub length: f64,
}

impl Branch {
    fn new(parent: Option<u32>, position: u32, depth: usize) -> Self {
        Self { parent, modules: position..position, tail: 0..0, depth: depth as u32, length: 0.0 }
    }
}

/// Most brackets in a row that open one branch (ours: a turtle has to obey each, and streams come from strangers).
pub(super) const MOST_BRACKETS: u32 = 4096;

/// The branches of a chain in the order of the chain, each after its parent. Branch 0, the root, is always there; it has no modules when
/// the chain opens with a bracket or is empty.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedTree {
    branches: Vec<Branch>,
    /// Where each branch's children begin in `children`; one more entry than branches.
    first_child: Vec<u32>,
    children: Vec<u32>,
}

impl WeightedTree {
    /// Reads a chain, once for its brackets and once for its branches, in time and memory proportional to its length; nesting costs no
    /// stack.
    ///
    /// # Errors
    /// [`Error::UnreadableChain`] for unbalanced brackets, a branch that ends inside a polygon, and a length that is not finite.
    pub fn parse(roles: impl Iterator<Item = Role> + Clone) -> Result<Self> {
        let places = places(roles.clone())?;
        let mut branches = vec![Branch::new(None, 0, 0)];
        // Where the next branch would grow from, whether the next module still belongs to that branch, and whether it has wood.
        let (mut at, mut goes_on, mut has_wood, mut open) = (0u32, true, false, vec![]);
        for (position, (role, place)) in (0u32..).zip(roles.zip(places)) {
            match (role, place) {
                (Role::Open, Place::Fork) => {
                    open.push(at);
                    goes_on = false;
                }
                (Role::Close, Place::Fork) => {
                    if goes_on && !has_wood {
                        fold_tail(&mut branches);
                    }
                    at = open.pop().expect("the first reading saw them balanced");
                    goes_on = false;
                }
                _ => {
                    if !goes_on {
                        if open.len() as u32 - branches[at as usize].depth > MOST_BRACKETS {
                            return Err(Error::UnreadableChain {
                                position: position as usize,
                                what: "stands in thousands of needless brackets",
                            });
                        }
                        branches.push(Branch::new(Some(at), position, open.len()));
                        (at, goes_on, has_wood) = (branches.len() as u32 - 1, true, false);
                    }
                    let branch = &mut branches[at as usize];
                    branch.modules.end = position + 1;
                    if let (Role::Advance(length), Place::Wood) = (role, place) {
                        // Walking backwards draws as much wood as walking forwards.
                        branch.length += length.abs();
                        has_wood = true;
                    }
                }
            }
        }
        if goes_on && !has_wood {
            fold_tail(&mut branches);
        }
        Ok(Self::from_branches(branches))
    }

    fn from_branches(branches: Vec<Branch>) -> Self {
        let parents = || branches.iter().enumerate().filter_map(|(b, branch)| Some((b, branch.parent? as usize)));
        let mut first_child = vec![0u32; branches.len() + 1];
        parents().for_each(|(_, parent)| first_child[parent + 1] += 1);
        for b in 0..branches.len() {
            first_child[b + 1] += first_child[b];
        }
        let (mut free, mut children) = (first_child.clone(), vec![0; branches.len() - 1]);
        for (b, parent) in parents() {
            children[free[parent] as usize] = b as u32;
            free[parent] += 1;
        }
        Self { branches, first_child, children }
    }

    /// Every branch, in the order of the chain.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// The branches that grow from branch `b`, in the order of the chain.
    ///
    /// # Panics
    /// When there is no branch `b`.
    pub fn children(&self, b: usize) -> &[u32] {
        &self.children[self.first_child[b] as usize..self.first_child[b + 1] as usize]
    }
}

/// Makes the last branch the tail of the one that it goes on from, if it does: `[[F]+]` goes on from none of its own.
fn fold_tail(branches: &mut Vec<Branch>) {
    let Some(Branch { parent: Some(parent), depth, modules, .. }) = branches.last().cloned() else { return };
    if branches[parent as usize].depth == depth {
        branches.pop();
        branches[parent as usize].tail = modules;
    }
}

/// What the first reading finds out about a module.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// It stays with its branch.
    Inside,
    /// A bracket that opens or closes a branch.
    Fork,
    /// An advance that draws wood, not the edge of a polygon.
    Wood,
}

/// Which brackets hold wood, and which advances are wood.
fn places(roles: impl Iterator<Item = Role>) -> Result<Vec<Place>> {
    struct Open {
        position: usize,
        polygons: usize,
        has_wood: bool,
    }
    let (mut places, mut open, mut polygons) = (vec![], Vec::<Open>::new(), vec![]);
    // How many brackets were open at a `%`, until the innermost of them closes.
    let mut cut = None;
    let unreadable = |position, what| Err(Error::UnreadableChain { position, what });
    for (position, role) in roles.enumerate() {
        if position >= u32::MAX as usize {
            return unreadable(position, "is one more than can be counted");
        }
        places.push(Place::Inside);
        match role {
            Role::Open => open.push(Open { position, polygons: polygons.len(), has_wood: false }),
            Role::Close => {
                cut = cut.filter(|&brackets| brackets != open.len());
                let Some(closed) = open.pop() else { return unreadable(position, "closes a bracket that none has opened") };
                if closed.polygons != polygons.len() {
                    return unreadable(position, "closes a bracket in the middle of a polygon");
                }
                if closed.has_wood {
                    (places[closed.position], places[position]) = (Place::Fork, Place::Fork);
                    open.last_mut().into_iter().for_each(|outer| outer.has_wood = true);
                }
            }
            Role::Advance(length) if !length.is_finite() => {
                return unreadable(position, "has a length that is not a finite number");
            }
            _ if cut.is_some() => {}
            Role::Cut => cut = Some(open.len()),
            Role::PolygonBegin => polygons.push(position),
            // A `}` too many is the turtle's to judge: it holds nothing together.
            Role::PolygonEnd => drop(polygons.pop()),
            Role::Advance(length) if !length.is_finite() => {
                return unreadable(position, "has a length that is not a finite number");
            }
            Role::Advance(_) if polygons.is_empty() => {
                places[position] = Place::Wood;
                open.last_mut().into_iter().for_each(|bracket| bracket.has_wood = true);
            }
            Role::Advance(_) | Role::Other => {}
        }
    }
    if let Some(bracket) = open.last() {
        return unreadable(bracket.position, "opens a bracket that none closes");
    }
    if let Some(polygon) = polygons.last() {
        return unreadable(*polygon, "opens a polygon that none closes");
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `F` advances by 1, `L` is a leaf.
    fn roles(text: &str) -> Vec<Role> {
        let role = |c| match c {
            '[' => Role::Open,
            ']' => Role::Close,
            '{' => Role::PolygonBegin,
            '}' => Role::PolygonEnd,
            '%' => Role::Cut,
            'F' => Role::Advance(1.0),
            _ => Role::Other,
        };
        text.chars().map(role).collect()
    }

    /// Each branch as parent, text, depth and length.
    fn parsed(text: &str) -> Vec<(Option<u32>, &str, u32, f64)> {
        let tree = WeightedTree::parse(roles(text).into_iter()).unwrap();
        let text_of = |range: &Range<u32>| &text[range.start as usize..range.end as usize];
        tree.branches().iter().map(|b| (b.parent, text_of(&b.modules), b.depth, b.length)).collect()
    }

    #[test]
    fn what_follows_a_side_branch_is_its_sibling() {
        assert_eq!(
            parsed("F[+F]FF[-F]"),
            [(None, "F", 0, 1.0), (Some(0), "+F", 1, 1.0), (Some(0), "FF", 0, 2.0), (Some(2), "-F", 1, 1.0)]
        );
    }

    #[test]
    fn leaves_and_polygons_stay_with_their_branch() {
        assert_eq!(parsed("F[+L]F[[&]L]"), [(None, "F[+L]F[[&]L]", 0, 2.0)]);
        assert_eq!(parsed("F{.F[+F].}[F]"), [(None, "F{.F[+F].}", 0, 1.0), (Some(0), "F", 1, 1.0)]);
        assert_eq!(parsed("[{.F.}][L[F]]"), [(None, "[{.F.}]", 0, 0.0), (Some(0), "L", 1, 0.0), (Some(1), "F", 2, 1.0)]);
    }

    #[test]
    fn what_ends_a_branch_without_wood_is_its_tail() {
        let tree = WeightedTree::parse(roles("F[+F[F]L][-F]L[L]").into_iter()).unwrap();
        assert_eq!(tree.branches().iter().map(|b| b.tail.clone()).collect::<Vec<_>>(), [13..17, 7..8, 0..0, 0..0]);
        assert_eq!(tree.branches().len(), 4);
    }

    #[test]
    fn what_is_cut_off_has_no_branches() {
        assert_eq!(parsed("F[F%[F]{F]F"), [(None, "F", 0, 1.0), (Some(0), "F%[F]{F", 1, 1.0), (Some(0), "F", 0, 1.0)]);
        assert_eq!(parsed("F%F[F]"), [(None, "F%F[F]", 0, 1.0)]);
    }

    #[test]
    fn brackets_round_nothing_make_no_branch() {
        assert_eq!(parsed("F[[F][F]]"), [(None, "F", 0, 1.0), (Some(0), "F", 2, 1.0), (Some(0), "F", 2, 1.0)]);
        assert_eq!(parsed(""), [(None, "", 0, 0.0)]);
        assert_eq!(parsed("[F]"), [(None, "", 0, 0.0), (Some(0), "F", 1, 1.0)]);
        assert_eq!(parsed("F[]F"), [(None, "F[]F", 0, 2.0)]);
    }

    #[test]
    fn what_cannot_be_read_is_named_by_position() {
        let at = |roles: Vec<Role>| match WeightedTree::parse(roles.into_iter()) {
            Err(Error::UnreadableChain { position, .. }) => position,
            other => panic!("{other:?}"),
        };
        assert_eq!(at(roles("F]")), 1);
        assert_eq!(at(roles("F[[F]")), 1);
        assert_eq!(at(roles("F[{F]}")), 4);
        assert_eq!(at(roles("F{F")), 1);
        assert_eq!(at(roles(&("[".repeat(5000) + "F" + &"]".repeat(5000)))), 5000);
        assert_eq!(at(vec![Role::Other, Role::Advance(f64::NAN)]), 1);
    }

    #[test]
    fn a_million_nested_brackets_need_no_stack() {
        let deep = "F[".repeat(1_000_000) + "F" + &"]".repeat(1_000_000);
        assert_eq!(WeightedTree::parse(roles(&deep).into_iter()).unwrap().branches().len(), 1_000_001);
    }
}
