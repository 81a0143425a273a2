//! The figures and tables of the five papers, redrawn on our trees (`compare --profile papers`): each beside what the paper prints, with a
//! sentence on what was found, from the figures themselves, and one on why we differ.
//!
//! ```text
//! EXHIBITS ── Exhibit::ours(&mut Bench) ──▶ Ours { tables, pictures, charts } ──▶ papers.html, papers.json, papers/*.png
//! ```
//!
//! Milliseconds are of one frame, waited for; the papers' frames per second stand as they were printed.

mod bench;
mod chart;
pub mod extraction;
mod lluch;
mod page;
mod rebollo;
mod she;
mod truelsen;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use crate::render::Renderer;
use crate::repr::{Capture, TreeSource};
use crate::{Result, Seed};

pub use bench::{Bench, in_rows, one_tree};
pub use chart::{Chart, Curve};
pub use lluch::box_polygons;

/// One figure or table of a paper, and how it is redrawn.
pub struct Exhibit {
    /// What the page's address calls it.
    pub id: &'static str,
    /// The paper.
    pub paper: &'static str,
    /// Which figure or table of it.
    pub figure: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// What the paper has.
    pub theirs: Printed,
    /// What we have.
    pub ours: fn(&mut Bench) -> Result<Ours>,
    /// Why we differ, whatever the tree; what is found on it is in [`Ours`].
    pub differs: &'static str,
}

/// What a paper prints.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Printed {
    /// In its words or ours, where it is no table.
    pub words: &'static str,
    /// Heads of its columns; empty where it has no table.
    pub head: &'static [&'static str],
    /// Its rows.
    pub rows: &'static [&'static [&'static str]],
}

impl Printed {
    /// No table.
    const fn words(words: &'static str) -> Self {
        Self { words, head: &[], rows: &[] }
    }
}

/// A table of ours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// What it says; empty where the exhibit's title does.
    pub caption: String,
    /// Heads of its columns.
    pub head: Vec<String>,
    /// Its rows, as many cells as the head has.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new<const N: usize>(caption: &str, head: [&str; N]) -> Self {
        Self { caption: caption.to_owned(), head: head.map(str::to_owned).to_vec(), rows: vec![] }
    }

    fn row<const N: usize>(&mut self, cells: [String; N]) {
        debug_assert_eq!(N, self.head.len());
        self.rows.push(cells.map(|cell| grouped(&cell)).to_vec());
    }
}

/// A whole number of five digits or more with commas; anything else as it is.
fn grouped(text: &str) -> String {
    if text.len() < 5 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return text.to_owned();
    }
    let digits = text.char_indices();
    digits.flat_map(|(i, c)| ((text.len() - i).is_multiple_of(3) && i > 0).then_some(',').into_iter().chain([c])).collect()
}

/// A picture of ours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Its file beside the page.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// Columns and rows, pixels.
    pub size_px: [u32; 2],
}

/// What an exhibit became.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Ours {
    /// Tables.
    pub tables: Vec<Table>,
    /// Pictures, in rows of `columns`.
    pub panels: Vec<Panel>,
    /// How many panels belong beside each other.
    pub columns: usize,
    /// Curves.
    pub charts: Vec<Chart>,
    /// What these figures say, in a sentence with the numbers that it rests on.
    pub found: String,
}

/// How many times as much the one is as the other, in digits.
fn times(one: f64, other: f64) -> String {
    if other > 0.0 { format!("{:.2}", one / other) } else { "?".to_owned() }
}

/// Every figure and table that is redrawn, paper by paper.
pub const EXHIBITS: &[Exhibit] = &[
    she::FIG_16,
    she::TABLE_1,
    she::FIG_17,
    truelsen::TABLE_1,
    truelsen::TABLE_2,
    truelsen::TABLE_4,
    truelsen::FIG_25_26,
    lluch::FIG_7,
    lluch::FIG_10,
    lluch::TABLE_1,
    lluch::FIG_5_7,
    rebollo::TABLES,
    rebollo::FIG_15,
    rebollo::FIG_16,
];

/// An exhibit as the page shows it.
#[derive(Serialize)]
struct Shown {
    id: &'static str,
    paper: &'static str,
    /// Authors and year alone.
    authors: &'static str,
    figure: &'static str,
    title: &'static str,
    theirs: Printed,
    ours: Ours,
    /// Why there is nothing of ours.
    failed: Option<String>,
    differs: &'static str,
    seconds: f64,
}

/// What is to be redrawn on which tree.
pub struct Request<'a> {
    /// The tree.
    pub source: &'a TreeSource,
    /// Takes pictures for methods.
    pub capture: &'a dyn Capture,
    /// Of every random number.
    pub seed: Seed,
    /// The command line that makes the page.
    pub command: &'a str,
    /// Where it goes.
    pub folder: &'a Path,
}

/// Redraws them all and writes the page; gives where it is. `told` hears of each before it begins. What fails in one exhibit (a source
/// without bones, say) is told there, and the rest goes on.
///
/// # Errors
/// [`EmptyModel`](crate::Error::EmptyModel) for a source of nothing; those of files.
pub fn run(renderer: &mut Renderer, request: &Request, told: &dyn Fn(&Exhibit)) -> Result<PathBuf> {
    let mut bench = Bench::new(renderer, request)?;
    let shown = EXHIBITS.iter().map(|exhibit| {
        told(exhibit);
        show(exhibit, &mut bench)
    });
    let shown: Vec<Shown> = shown.collect();
    page::write(&bench, request, &shown)
}

/// Redraws one.
fn show(exhibit: &Exhibit, bench: &mut Bench) -> Shown {
    let begun = Instant::now();
    let (ours, failed) = match (exhibit.ours)(bench) {
        Ok(ours) => (ours, None),
        Err(why) => (Ours::default(), Some(why.to_string())),
    };
    let Exhibit { id, paper, figure, title, theirs, differs, .. } = *exhibit;
    let authors = paper.split(", ").next().unwrap_or(paper);
    Shown { id, paper, authors, figure, title, theirs, ours, failed, differs, seconds: begun.elapsed().as_secs_f64() }
}

#[cfg(test)]
mod tests;
