//! What the page needs of a comparison's pictures: errors by elevation, where the kept pictures lie, and where our own method loses.

use serde::Serialize;

use crate::compare::answer::CostKind;
use crate::compare::pictures::file_of;
use crate::compare::{Cell, Comparison, Figures, Plan, Row, TRUTH, View};

/// The method that is this project's own: the page says where it is beaten.
pub const OURS: &str = "sphere-board";

/// Errors of one method from one elevation at one distance: the mean over azimuths and suns.
#[derive(Debug, Serialize)]
pub struct OfElevation {
    method: String,
    level: Option<String>,
    height_px: f32,
    elevation_deg: f32,
    /// Held against the photograph itself, from its own view.
    photographed: bool,
    error: Figures,
}

/// A kept picture; of method M it is `pictures/M/FILE`, and the truth's lies in `pictures/truth`.
#[derive(Debug, Serialize)]
pub struct Picture {
    azimuth_deg: f32,
    elevation_deg: f32,
    height_px: f32,
    sun: usize,
    file: String,
}

/// A distance and elevation from which another method of equal or fewer bytes has a lower FLIP than ours.
#[derive(Debug, PartialEq, Serialize)]
pub struct Loss {
    height_px: f32,
    elevation_deg: f32,
    photographed: bool,
    ours: Entry,
    /// Those that beat it, least error first.
    by: Vec<Entry>,
}

/// One side of a [`Loss`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    method: String,
    flip: f64,
    bytes: f64,
}

/// The cells' errors by method, level, distance and elevation, in the order of the cells.
pub fn by_elevation(comparison: &Comparison) -> Vec<OfElevation> {
    let elevation_deg = |cell: &Cell| comparison.plan.views[cell.view].elevation_deg;
    let alike = |a: &Cell, b: &Cell| {
        let own = |cell: &Cell| comparison.plan.photographed == Some(cell.view);
        (&a.method, &a.level, a.height_px) == (&b.method, &b.level, b.height_px)
            && (elevation_deg(a), own(a)) == (elevation_deg(b), own(b))
    };
    let mut groups: Vec<Vec<&Cell>> = vec![];
    for cell in comparison.cells.iter().filter(|cell| cell.failed.is_none()) {
        // Cells of one distance lie together: a group is mostly among the last few.
        match groups.iter_mut().rev().find(|group| alike(group[0], cell)) {
            Some(group) => group.push(cell),
            None => groups.push(vec![cell]),
        }
    }
    let mean = |group: Vec<&Cell>| OfElevation {
        method: group[0].method.clone(),
        level: group[0].level.clone(),
        height_px: group[0].height_px,
        elevation_deg: elevation_deg(group[0]),
        photographed: comparison.plan.photographed == Some(group[0].view),
        error: Figures::mean(&group.iter().map(|cell| cell.error).collect::<Vec<_>>()),
    };
    groups.into_iter().map(mean).collect()
}

/// Every picture that a run keeps of each method.
pub fn pictures(plan: &Plan) -> Vec<Picture> {
    let kept = plan.views.iter().enumerate().filter(|(number, _)| plan.is_first(*number)).map(|(_, view)| *view);
    let of_height = |height_px: f32| (0..plan.suns.len()).map(move |sun| (height_px, sun));
    let of_view = |view: View| {
        plan.heights_px.iter().copied().flat_map(of_height).map(move |(height_px, sun)| Picture {
            azimuth_deg: view.azimuth_deg,
            elevation_deg: view.elevation_deg,
            height_px,
            sun,
            file: file_of(view, height_px, sun),
        })
    };
    kept.flat_map(of_view).collect()
}

/// Where [`OURS`] loses. Levels told do not count, nor does the truth: what is drawn is what belongs there.
pub fn losses(rows: &[Row], elevations: &[OfElevation]) -> Vec<Loss> {
    let entry = |of: &OfElevation| {
        let same = |row: &&Row| row.method == of.method && row.level.is_none() && row.height_px == of.height_px;
        let row = rows.iter().find(same).filter(|row| row.failed.is_none())?;
        Some(Entry { method: of.method.clone(), flip: of.error.flip, bytes: CostKind::Bytes.of(&row.cost) })
    };
    let drawn = |of: &&OfElevation| of.level.is_none();
    let loss = |own: &OfElevation| {
        let ours = entry(own)?;
        let here = |of: &&OfElevation| {
            (of.height_px, of.elevation_deg, of.photographed) == (own.height_px, own.elevation_deg, own.photographed)
        };
        let rivals = elevations.iter().filter(drawn).filter(here).filter(|of| of.method != OURS && of.method != TRUTH);
        let mut by: Vec<Entry> =
            rivals.filter_map(entry).filter(|rival| rival.bytes <= ours.bytes && rival.flip < ours.flip).collect();
        by.sort_by(|a, b| a.flip.total_cmp(&b.flip));
        (!by.is_empty()).then_some(Loss {
            height_px: own.height_px,
            elevation_deg: own.elevation_deg,
            photographed: own.photographed,
            ours,
            by,
        })
    };
    elevations.iter().filter(drawn).filter(|of| of.method == OURS).filter_map(loss).collect()
}
