//! Procedural multiresolution (Lluch03 §5): the branches of a tree in order of importance, so that any prefix is a tree.
//!
//! ```text
//! chain ──parse──▶ WeightedTree ──Metric──▶ Multichain ──LevelTurtle──▶ Levels: shapes, level n = a prefix
//!                                                └──stream──▶ bytes ──any prefix──▶ Multichain
//! ```

pub mod levels;
pub mod metric;
pub mod multichain;
mod visits;
pub mod weighted;

pub use levels::{LevelTurtle, Levels};
pub use metric::{Metric, weights};
pub use multichain::{Item, Multichain, Step};
pub use weighted::{Branch, Role, WeightedTree};

/// No branch.
const NONE: u32 = u32::MAX;

#[cfg(test)]
mod tests;
