//! Trees that grow: L-systems, the turtle that draws them, and the skeleton it leaves behind (Lluch03; Truelsen §3, §6.1; Lluch04 §3.2).
//!
//! ```text
//! grammar (.lsys, XML) ──derive──▶ modules ──turtle──▶ Skeleton ──mesh──▶ wood and leaves
//!                                     └──multires──▶ multichain ──prefix──▶ modules of the first n levels
//! ```

pub mod boxes;
pub mod command;
pub mod derive;
pub mod grammar;
mod growth;
pub mod mesh;
pub mod module;
pub mod multires;
mod neighbours;
pub mod presets;
pub mod skeleton;
pub mod turtle;

pub use command::{Action, Command};
pub use derive::{DeriveParams, Progress};
pub use grammar::Grammar;
pub use module::{Alphabet, Chain, Module, Symbol};
pub use skeleton::{Bone, BoneKind, Branch, Polygon, Skeleton};
pub use turtle::{Growth, Turtle, TurtleParams, draw};

#[cfg(test)]
mod derive_tests;
#[cfg(test)]
mod turtle_tests;
