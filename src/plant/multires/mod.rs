//! Procedural multiresolution (Lluch03 §5): the branches of a tree in order of importance, so that any prefix is a tree.
//!
//! ```text
//! Chain ──parse──▶ WeightedTree ──Metric──▶ Multichain ──turtle──▶ SkeletonLevels: bones, level n = a prefix
//!                                               └──stream──▶ bytes ──any prefix──▶ Receiver: a Multichain again
//! ```
//!
//! [`SkeletonLevels`] does all of the first line for a grown chain. The parts below it know nothing of how modules are stored
//! ([`WeightedTree`], [`Multichain`]) or drawn ([`LevelTurtle`]).
//!
//! # Where the paper leaves room
//!
//! * Equation 4's path length counts both ends (`X(n, m)` holds n and m); only so do the weights come to 0, and §5.4's levels come out.
//! * "The first non-output node with the largest branching length" is found by going down from the root along the largest weight left,
//!   not by searching all nodes: the global maximum would output C12 (weight 5) before C9 (3), and §5.4 has it after.
//! * SAVE follows branches with several children, as §5.4 prints it, not all intermediate ones, as §5.3 says: none stands behind C15.
//! * Ties go to the first child in the order of the chain; finished subtrees take no part.
//! * What a branch is in a chain that goes on after a bracket, and what leaves are: [`weighted`].
//!
//! # For a drawable method `multichain`
//!
//! A method that draws levels builds once and draws prefixes. It takes [`SkeletonLevels::extent`] of the last level, meshes
//! [`so_far`](SkeletonLevels::so_far) bone by bone *in that order*, and notes where each bone's triangles end; level `n` is then the index
//! range up to `extent(n).bones`, with leaves behind the twig that bears them. A tree has as many levels as branch tips, so that
//! a table of coarse, medium, high and fine ones picks four `n`, by share of the branches. Geomorphing follows [`between`]: a vertex of level
//! n + 1 moves on the line from the point where its path leaves the tree to its own place, so that one extra position per vertex and one
//! number `t` do on the graphics processor what [`SkeletonLevels::transition`] does here.

pub mod levels;
pub mod metric;
pub mod multichain;
pub mod skeletons;
pub mod stream;
pub mod transition;
mod visits;
pub mod weighted;

pub use levels::{LevelTurtle, Levels};
pub use metric::{Metric, weights};
pub use multichain::{Item, Multichain, Step};
pub use skeletons::{Extent, SkeletonLevels, SkeletonTurtle};
pub use stream::{Receiver, Reception, Word};
pub use transition::{between, split_level};
pub use weighted::{Branch, Role, WeightedTree};

/// No branch.
const NONE: u32 = u32::MAX;

#[cfg(test)]
mod tests;
