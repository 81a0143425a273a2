//! Trees for scenes that need thousands of them.
//!
//! A photograph goes in at the top and a small 3-D model comes out; beside it, true trees are grown or imported to compare with, and
//! everything is drawn by the same passes. Data flows one way, and a module imports only from floors below it (`tests/floors.rs` holds
//! the table):
//!
//! ```text
//! photo ──segment──▶ mask ──silhouette──▶ feature points ──crown──▶ crown mesh ──texture──▶ textured crown ─┐
//!                                                                                           trunk ─────────┴▶ TreeModel ─▶ GLB
//! L-system ──derive──▶ modules ──turtle──▶ skeleton ──mesh──▶ wood, leaves ─▶ ReferenceTree ◀── GLB/glTF/OBJ
//!                                           TreeModel | ReferenceTree ──▶ Parts ──upload──▶ frame
//! ```
//!
//! * floor 0: [`error`], [`seed`], [`params`](mod@params), [`files`], [`geom`], [`raster`], [`page`] — what everything stands on;
//! * floor 1: [`photo`] — decoding, segmentation, silhouette, exemplar, trunk cues; [`plant`] — grown trees; [`metrics`] — how alike two pictures are;
//! * floor 2: [`crown`] and [`texture`] — outline to closed surface, exemplar to atlas;
//! * floor 3: [`model`] — the pipeline from photograph to `TreeModel`, parts, reference trees, and their files;
//! * floor 4: [`repr`] — the tree representations, each from the same source by the same call, as plain data;
//! * floor 5: [`gpu`] — the device, and what it shares with shaders;
//! * floor 6: [`render`] — the passes of a frame;
//! * floor 7: [`compare`] — every representation held against the tree itself; [`grove`] — thousands of trees on their ground; [`report`] — pictures for people: stage drawings, contact sheets, previews, photographs of true trees;
//! * floor 8: [`cli`] — arguments, progress, messages.
//!
//! The method is that of She et al. 2018, "Sphere-board" trees (cited as "She §…"); where this library goes beyond the paper, the
//! documentation says "ours" and why.

#![warn(missing_docs)]

pub mod cli;
pub mod compare;
pub mod crown;
pub mod error;
pub mod files;
pub mod geom;
pub mod gpu;
pub mod grove;
pub mod metrics;
pub mod model;
pub mod page;
pub mod params;
pub mod photo;
pub mod plant;
pub mod raster;
pub mod render;
pub mod report;
pub mod repr;
pub mod seed;
pub mod texture;

pub use error::{Error, Result, Warning};
pub use seed::Seed;
