//! An outline as cells: what the star-shaped fit and the split into lobes work on. Metres, x right, y up.

use glam::DVec2;

use crate::raster::{Mask, fill_polygon};

/// Cells along the longer side of an outline: fine enough for 1 % of a crown, coarse enough to search in milliseconds.
const CELLS: f64 = 240.0;

/// A set of square cells in a view's plane.
#[derive(Debug, Clone)]
pub(super) struct Region {
    pub mask: Mask,
    /// Top left corner of the mask, metres.
    pub origin: DVec2,
    /// Side of a cell, metres.
    pub cell_m: f64,
}

impl Region {
    /// Fills a closed contour; `None` when it encloses no cell.
    #[cfg(test)]
    pub fn from_contour(contour: &[DVec2]) -> Option<Self> {
        Self::of(std::iter::once(&contour.to_vec()))
    }

    /// Fills closed contours; `None` when they enclose no cell.
    pub fn of<'a>(contours: impl Iterator<Item = &'a Vec<DVec2>> + Clone) -> Option<Self> {
        let (low, high) = contours.clone().flatten().fold((DVec2::MAX, DVec2::MIN), |(a, b), &p| (a.min(p), b.max(p)));
        let size = high - low;
        if !size.is_finite() || size.max_element() <= 0.0 {
            return None;
        }
        let cell_m = size.max_element() / CELLS;
        let cells = (size / cell_m).ceil() + 2.0;
        let origin = DVec2::new(low.x - cell_m, high.y + cell_m);
        let mut region = Self { mask: Mask::new(cells.x as u32, cells.y as u32), origin, cell_m };
        for contour in contours {
            let corners: Vec<DVec2> = contour.iter().map(|&p| region.to_cells(p)).collect();
            fill_polygon(&mut region.mask, &corners);
        }
        (region.mask.count() > 0).then_some(region)
    }

    /// The same cells with another set chosen.
    pub fn with(&self, mask: Mask) -> Self {
        Self { mask, ..self.clone() }
    }

    /// What lies between the top and the bottom of `other`, another view of the same tree; `None` for nothing.
    pub fn at_the_height_of(&self, other: &Self) -> Option<Self> {
        let rows = other.mask.bounds()?;
        let height = |row: u32| other.to_metres(DVec2::new(0.0, f64::from(row))).y;
        let (top, bottom) = (height(rows.y), height(rows.y + rows.height));
        let inside = |x: u32, y: u32| {
            (bottom..=top).contains(&self.to_metres(DVec2::new(0.0, f64::from(y) + 0.5)).y) && self.mask.get(x.into(), y.into())
        };
        let region = self.with(Mask::from_fn(self.mask.width(), self.mask.height(), inside));
        (region.mask.count() > 0).then_some(region)
    }

    /// Metres to cells, y down.
    pub fn to_cells(&self, p: DVec2) -> DVec2 {
        DVec2::new(p.x - self.origin.x, self.origin.y - p.y) / self.cell_m
    }

    /// Cells, y down, to metres.
    pub fn to_metres(&self, c: DVec2) -> DVec2 {
        self.origin + DVec2::new(c.x, -c.y) * self.cell_m
    }

    /// Mean of the cells' centres.
    pub fn centroid(&self) -> DVec2 {
        let width = self.mask.width() as usize;
        let set = self.mask.as_raw().iter().enumerate().filter(|(_, v)| **v != 0);
        let (sum, count) = set.fold((DVec2::ZERO, 0.0), |(sum, n), (i, _)| {
            (sum + DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5), n + 1.0)
        });
        self.to_metres(sum / f64::max(count, 1.0))
    }
}
