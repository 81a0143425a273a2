//! The report of a comparison: `report.html`, `report.json` and `cells.csv`.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::{Error, Result, files};

use super::answer::{Band, CostKind, bands, chain};
use super::{COLUMNS, Column, Comparison, Identity, Row};

/// Everything that the page shows.
#[derive(Serialize)]
struct Report<'a> {
    identity: &'a Identity,
    max_flip: f64,
    cost: CostKind,
    bands: Vec<Band>,
    chain: Vec<(String, Option<String>, f32)>,
    columns: &'static [Column],
    comparison: &'a Comparison,
}

/// Writes it; gives where the page is.
///
/// # Errors
/// Those of [`files::write_all`].
pub fn write(folder: &Path, comparison: &Comparison, identity: &Identity, max_flip: f64, cost: CostKind) -> Result<PathBuf> {
    let rows: Vec<Row> = comparison.methods.iter().flat_map(|run| run.rows.iter().cloned()).collect();
    let bands = bands(&rows, max_flip, cost);
    let report = Report { identity, max_flip, cost, chain: chain(&bands), bands, columns: COLUMNS, comparison };
    let json = serde_json::to_vec_pretty(&report).map_err(|e| Error::Internal { stage: "compare::page", what: e.to_string() })?;
    let page = folder.join("report.json");
    files::write_all(&[(page.clone(), json), (folder.join("cells.csv"), cells(comparison))])?;
    Ok(page)
}

/// A line per picture.
fn cells(comparison: &Comparison) -> Vec<u8> {
    let mut text = "method,level,azimuth_deg,elevation_deg,height_px,sun".to_owned();
    COLUMNS.iter().for_each(|column| text += &format!(",{}", column.id));
    for cell in &comparison.cells {
        let view = comparison.plan.views[cell.view];
        let level = cell.level.as_deref().unwrap_or("");
        text += &format!("\n{},{level},{},{},{},{}", cell.method, view.azimuth_deg, view.elevation_deg, cell.height_px, cell.sun);
        COLUMNS.iter().for_each(|column| text += &format!(",{:.5}", (column.of)(&cell.error)));
    }
    text.push('\n');
    text.into_bytes()
}
