//! From a skeleton to surfaces: wood as generalised cones with half-sphere joints ([`wood`], Truelsen §3.2, fig. 10), leaves as
//! alpha-tested quads ([`leaves`]), and the pictures that go on them ([`bark`], [`foliage`]). Metres, +Y up.

pub mod bark;
pub mod blades;
pub mod foliage;
pub mod leaves;
mod light;
mod limbs;
mod paint;
#[cfg(test)]
mod tests;
pub mod wood;

pub use bark::BarkKind;
pub use foliage::LeafKind;
pub use leaves::{LeafParams, Leaves, Sheet};
pub use wood::WoodParams;
