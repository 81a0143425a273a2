//! Trees that grow: L-systems, the turtle that draws them, and the skeleton it leaves behind (Lluch03; Truelsen §3, §6.1; Lluch04 §3.2).
//!
//! ```text
//! grammar (.lsys, XML) ──derive──▶ modules ──turtle──▶ Skeleton ──mesh──▶ wood and leaves
//!                                     └──multires──▶ multichain ──prefix──▶ modules of the first n levels
//! ```

pub mod mesh;
pub mod skeleton;

pub use skeleton::{Bone, BoneKind, Skeleton};
