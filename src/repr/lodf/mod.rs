//! LoDF, level of detail foliage (Rebollo et al. 2007): leaves that collapse pairwise, in clusters that change one by one.

pub mod foliage;
mod forest;
mod grid;
#[cfg(test)]
mod printed;
mod resolution;
pub mod simplify;
#[cfg(test)]
mod simplify_tests;

pub use forest::{Forest, LeafId, LeafShape};
pub use resolution::{Change, Resolution};
