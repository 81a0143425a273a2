//! The comparison: every method, at every level, from every view, at every distance, in every light, held against the tree itself, with
//! what it costs ("which stand-in for this tree, at which distance, at what cost?").
//!
//! ```text
//! Plan ──▶ truth pictures ─┐
//!   METHODS ──▶ BuiltTree ─┴▶ cells (Figures) ─┬▶ rows (mean error and Cost by method, level, distance) ──▶ answer ──▶ page
//!                                              └▶ Store: what is finished stays finished
//! ```
//!
//! One method is built, looked at and dropped before the next: what is in memory is one tree's truth and one method.

pub mod answer;
mod cost;
mod motion;
pub mod page;
mod plan;
mod run;
mod score;
mod staging;
mod store;

use serde::{Deserialize, Serialize};

pub use cost::Cost;
pub use motion::{Motion, largest_step};
pub use plan::{Plan, Profile, Sun, View, Views};
pub use run::{Progress, Request, coarser, every_method, finer, run};
pub use score::{COLUMNS, Column, Figures};
pub use staging::{BACKGROUNDS, Seen, Stage};
pub use store::{Identity, Store};

/// The method that is the truth of a reference tree.
pub const TRUTH: &str = "geometry";

/// One picture held against the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Method.
    pub method: String,
    /// A level told; `None` where the method drew the one that belongs there.
    pub level: Option<String>,
    /// Which of [`Plan::views`].
    pub view: usize,
    /// How many pixels high the tree is.
    pub height_px: f32,
    /// Which of [`Plan::suns`].
    pub sun: usize,
    /// Errors.
    pub error: Figures,
}

/// One method at one level and distance, over all views and suns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Method.
    pub method: String,
    /// A level told; `None` where the method drew the one that belongs there.
    pub level: Option<String>,
    /// How many pixels high the tree is.
    pub height_px: f32,
    /// Mean errors over views and suns.
    pub error: Figures,
    /// What it costs there.
    pub cost: Cost,
    /// Why there are no figures.
    pub failed: Option<String>,
}

/// One method as a whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodRun {
    /// Its id.
    pub method: String,
    /// Its name.
    pub name: String,
    /// Where it comes from.
    pub citation: String,
    /// Why it was not compared: it cannot take the tree, or failed.
    pub refused: Option<String>,
    /// Every effective parameter.
    pub parameters: Vec<(String, String)>,
    /// Milliseconds to build.
    pub build_ms: f64,
    /// Bytes of all textures and geometry on the device, all levels.
    pub memory_bytes: usize,
    /// Bytes of its GLB file; 0 where it has none.
    pub disk_bytes: usize,
    /// Its levels by name, and the distances at which they are all there.
    pub levels: Vec<(String, f32)>,
    /// In motion.
    pub motion: Motion,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// By level and distance.
    pub rows: Vec<Row>,
}

/// All of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The tree.
    pub source: String,
    /// Its height, metres.
    pub height_m: f32,
    /// What was looked at.
    pub plan: Plan,
    /// Method by method.
    pub methods: Vec<MethodRun>,
    /// Every picture.
    pub cells: Vec<Cell>,
}
