//! The comparison: every method, at every level, from every view, at every distance, in every light, held against the tree itself, with
//! what it costs ("which stand-in for this tree, at which distance, at what cost?").
//!
//! ```text
//! Plan ──▶ truth pictures ─┐
//!   METHODS ──▶ BuiltTree ─┴▶ cells (Figures) ─┬▶ rows (mean error and Cost by method, level, distance) ──▶ answer ──▶ page
//!                                              └▶ Store: what is finished stays finished
//! ```
//!
//! Each renderer builds one method, looks at it and drops it before the next: what is in memory is the truth's pictures and as many methods
//! as there are renderers. What is timed is timed alone.

pub mod answer;
mod bench;
mod budget;
pub mod chain;
mod contender;
mod cost;
mod film;
mod motion;
pub mod page;
pub mod papers;
pub mod photograph;
mod pictures;
mod plan;
mod run;
#[cfg(test)]
mod run_tests;
mod score;
mod staging;
mod store;
mod truth;

use serde::{Deserialize, Serialize};

pub use budget::{Budget, Load, Spent, fit, peak_mb};
pub use contender::{Contender, Workshop};
pub use cost::Cost;
pub use motion::{Motion, largest_step};
pub use plan::{MotionPlan, Plan, Profile, Sun, View, Views};
pub use run::{Progress, Request, every_method, run};
pub use score::{COLUMNS, Column, Figures};
pub use staging::{BACKGROUNDS, Seen, Stage};
pub use store::{Identity, Store};
pub use truth::{coarser, finer};

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
    /// Errors; of no use where it failed.
    pub error: Figures,
    /// Why there is no picture.
    pub failed: Option<String>,
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
    /// Mean errors over views and suns, but for pictures that failed.
    pub error: Figures,
    /// What it costs there.
    pub cost: Cost,
    /// What failed there, if anything: such a row is no part of any answer.
    pub failed: Option<String>,
}

/// One method as a whole.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    /// Bytes of its GLB file; 0 where none could be written.
    pub disk_bytes: usize,
    /// Its levels by name, and the distances at which they are all there.
    pub levels: Vec<(String, f32)>,
    /// In motion; `None` where it could not be looked at.
    pub motion: Option<Motion>,
    /// Where the time went.
    pub spent: Spent,
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
    /// What it was expected to take, and took.
    pub budget: Budget,
    /// Method by method.
    pub methods: Vec<MethodRun>,
    /// Every picture.
    pub cells: Vec<Cell>,
}
