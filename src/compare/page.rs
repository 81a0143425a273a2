//! The report of a comparison: `report.html` (one page that needs nothing but itself and the pictures beside it), `report.json` (what is
//! embedded in it, byte for byte) and `cells.csv` (every picture's errors, which the page shows as means only).
//!
//! ```text
//! Comparison ─┬▶ Report ──▶ JSON ─┬▶ report.json
//!             │                   └▶ page/report.html ◀── page/*.css, page/*.js, crate::page
//!             └▶ cells.csv
//! ```

mod digest;

use std::path::{Path, PathBuf};

use minijinja::context;
use serde::Serialize;

use crate::metrics::{FRAMES_PER_SECOND, PIXELS_PER_DEGREE};
use crate::page::{self, Page};
use crate::repr::REFERENCE_FOCAL_PX;
use crate::{Result, files};

use super::answer::{Band, Chain, CostKind, bands};
use super::motion::STRIPS;
use super::{BACKGROUNDS, Budget, COLUMNS, Column, Comparison, Identity, MethodRun, Row, TRUTH};
use digest::{Loss, OfElevation, Picture};

/// Words and places of the page; everything else is drawn by its scripts from the data.
const BODY: &str = include_str!("page/report.html");
const STYLE: &str = include_str!("page/compare.css");
/// One script after the other, in one scope with those of all pages.
const SCRIPT: &str = concat!(
    include_str!("page/common.js"),
    include_str!("page/tables.js"),
    include_str!("page/plots.js"),
    include_str!("page/viewer.js"),
    include_str!("page/motion.js"),
    include_str!("page/page.js")
);

/// What was asked of a comparison beyond what is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Mean FLIP up to which a stand-in is good enough.
    pub max_flip: f64,
    /// What cheap means.
    pub cost: CostKind,
    /// The command line that makes this page.
    pub command: &'a str,
}

/// Everything that the page shows.
#[derive(Serialize)]
struct Report<'a> {
    identity: &'a Identity,
    command: &'a str,
    max_flip: f64,
    cost: CostKind,
    /// A tree that stands `d` of its heights away is `focal_px / d` pixels high.
    focal_px: f32,
    pixels_per_degree: f32,
    /// At which films are judged.
    frames_per_second: f32,
    backgrounds: [[u8; 3]; 2],
    source: &'a str,
    height_m: f32,
    budget: &'a Budget,
    truth: &'static str,
    ours: &'static str,
    bands: Vec<Band>,
    chain: Chain,
    losses: Vec<Loss>,
    /// Names of the strips among a method's pictures: a walk round the tree, and one away from it.
    strips: [&'static str; 2],
    columns: &'static [Column],
    pictures: Vec<Picture>,
    elevations: Vec<OfElevation>,
    methods: &'a [MethodRun],
}

/// The recommendation of a comparison.
pub fn chain(comparison: &Comparison, asked: &Asked) -> Chain {
    Chain::of(&bands(&rows(comparison), asked.max_flip, asked.cost))
}

fn rows(comparison: &Comparison) -> Vec<Row> {
    comparison.methods.iter().flat_map(|run| run.rows.iter().cloned()).collect()
}

/// Writes it; gives where the page is.
///
/// # Errors
/// Those of [`files::write_all`].
pub fn write(folder: &Path, comparison: &Comparison, identity: &Identity, asked: Asked) -> Result<PathBuf> {
    let json = data(comparison, identity, asked)?;
    let page = folder.join("report.html");
    let html = html(&comparison.source, &json)?;
    files::write_all(&[
        (folder.join("report.json"), json.into_bytes()),
        (folder.join("cells.csv"), cells(comparison)),
        (page.clone(), html.into_bytes()),
    ])?;
    Ok(page)
}

/// The data as JSON that can stand within HTML.
fn data(comparison: &Comparison, identity: &Identity, asked: Asked) -> Result<String> {
    let rows = rows(comparison);
    let bands = bands(&rows, asked.max_flip, asked.cost);
    let elevations = digest::by_elevation(comparison);
    let report = Report {
        identity,
        command: asked.command,
        max_flip: asked.max_flip,
        cost: asked.cost,
        focal_px: REFERENCE_FOCAL_PX,
        pixels_per_degree: PIXELS_PER_DEGREE,
        frames_per_second: FRAMES_PER_SECOND,
        backgrounds: BACKGROUNDS,
        source: &comparison.source,
        height_m: comparison.height_m,
        budget: &comparison.budget,
        truth: TRUTH,
        ours: digest::OURS,
        chain: Chain::of(&bands),
        bands,
        losses: digest::losses(&rows, &elevations),
        strips: STRIPS,
        columns: COLUMNS,
        pictures: digest::pictures(&comparison.plan),
        elevations,
        methods: &comparison.methods,
    };
    page::json(&report)
}

fn html(source: &str, json: &str) -> Result<String> {
    let title = format!("{source}: stand-ins compared");
    Page { title: &title, body: BODY, style: STYLE, script: Some((SCRIPT, json)) }.render(context! { source })
}

/// A line per picture, then one per film: that of a walk round the tree has its flicker for a change, that of a walk away its popping.
fn cells(comparison: &Comparison) -> Vec<u8> {
    let mut text = "method,level,azimuth_deg,elevation_deg,height_px,sun".to_owned();
    COLUMNS.iter().for_each(|column| text += &format!(",{}", column.id));
    text += ",film,change,jod,failed";
    for cell in &comparison.cells {
        let view = comparison.plan.views[cell.view];
        let level = cell.level.as_deref().unwrap_or("");
        text += &format!("\n{},{level},{},{},{},{}", cell.method, view.azimuth_deg, view.elevation_deg, cell.height_px, cell.sun);
        match &cell.failed {
            None => COLUMNS.iter().for_each(|column| text += &format!(",{:.5}", (column.of)(&cell.error))),
            Some(_) => text += &",".repeat(COLUMNS.len()),
        }
        text +=
            &format!(",,,,{}", cell.failed.as_deref().map_or_else(String::new, |why| format!("\"{}\"", why.replace('"', "\"\""))));
    }
    for (run, motion) in comparison.methods.iter().filter_map(|run| Some((run, run.motion?))) {
        let away = motion.popping.zip(motion.dolly_jod).map(|(popping, jod)| ("dolly", popping, jod));
        for (film, change, jod) in [("orbit", motion.flicker, motion.orbit_jod)].into_iter().chain(away) {
            text += &format!("\n{}{},{film},{change:.5},{jod:.5},", run.method, ",".repeat(5 + COLUMNS.len()));
        }
    }
    text.push('\n');
    text.into_bytes()
}

#[cfg(test)]
mod tests;
