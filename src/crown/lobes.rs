//! Splitting an outline that one star-shaped solid cannot hold into several that can (She fig. 4b: "several sphere-boards").

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec2;
use imageproc::distance_transform::Norm;
use imageproc::morphology::dilate;
use imageproc::region_labelling::{Connectivity, connected_components};

use super::CrownParams;
use super::region::Region;
use super::star::{Star, best_center, best_deep_center, depth};
use crate::raster::Mask;

/// How far a lobe reaches into what is covered already, as a fraction of the outline's size, so that no crack shows between solids.
const OVERLAP: f64 = 0.04;

/// What a gap costs while an outline is split: a lobe is a solid piece and leaves the gaps to its neighbours.
const LOBE_GAP_COST: f64 = 3.0;

/// How deep in a lobe its centre lies, as a part of the deepest place: keeps it out of the bridges between lobes.
const LOBE_DEPTH: f64 = 0.5;

/// The regions to model, main part first: the whole outline when one star-shaped solid is at most `lobe_split` from it (1 − IoU),
/// otherwise its lobes. Area lost alone would not do: from between two discs one star reaches both and fills what parts them.
pub(super) fn split(whole: &Region, params: &CrownParams) -> Vec<(Region, Star)> {
    let star = Star::fit(whole, best_center(whole, 1.0), 1.0);
    if 1.0 - star.iou(whole) > params.lobe_split && params.max_crowns > 1 {
        let parts = lobes(whole, params);
        if parts.len() > 1 {
            return parts;
        }
    }
    vec![(whole.clone(), star)]
}

/// The lobes' regions, each with a little of its neighbours, and their stars.
fn lobes(whole: &Region, params: &CrownParams) -> Vec<(Region, Star)> {
    let territories = partition(whole, &greedy_centers(whole, params));
    // One step of Lloyd's algorithm: a piece that was cut off by chance grows to the lobe it belongs to.
    let region_center = |t: &Mask| best_deep_center(&whole.with(t.clone()), 1.0, LOBE_DEPTH);
    let centers: Vec<DVec2> = territories.iter().filter(|t| t.count() > 0).map(region_center).collect();
    let territories = partition(whole, &centers);
    let overlap = (OVERLAP * f64::from(whole.mask.width().max(whole.mask.height()))).round() as u8;
    let fitted = |territory: &Mask| {
        let grown = Mask::from_gray(&dilate(&territory.to_gray(), Norm::L2, overlap));
        let region = whole.with(grown.zip(&whole.mask, |a, b| a && b));
        let star = Star::fit(&region, best_deep_center(&region, 1.0, LOBE_DEPTH), 1.0);
        (region, star)
    };
    let smallest = params.min_lobe * whole.mask.count() as f64;
    territories.iter().filter(|t| t.count() as f64 >= smallest).map(fitted).collect()
}

/// Greedy cover: the centre of the best star, then again and again that of the largest piece still missing, until little enough is.
fn greedy_centers(whole: &Region, params: &CrownParams) -> Vec<DVec2> {
    let total = whole.mask.count() as f64;
    let mut centers = vec![best_deep_center(whole, LOBE_GAP_COST, LOBE_DEPTH)];
    let mut missing = without(&whole.mask, &Star::fit(whole, centers[0], LOBE_GAP_COST), whole);
    while centers.len() < params.max_crowns as usize && missing.count() as f64 > 0.5 * params.lobe_split * total {
        let Some(piece) = largest_piece(&missing).filter(|p| p.count() as f64 >= params.min_lobe * total) else { break };
        let center = best_deep_center(&whole.with(piece.clone()), LOBE_GAP_COST, LOBE_DEPTH);
        // The piece is taken out whether or not its star holds all of it, so that this ends.
        let rest = without(&missing, &Star::fit(whole, center, LOBE_GAP_COST), whole);
        missing = rest.zip(&piece, |rest, piece| rest && !piece);
        centers.push(center);
    }
    centers
}

/// The cells of the region that are nearest to each centre, walking inside the region; wide places have a head start of their own
/// half-width, so that borders fall into the bridges. Cells that no centre reaches belong to none.
fn partition(whole: &Region, centers: &[DVec2]) -> Vec<Mask> {
    let (width, height) = (whole.mask.width(), whole.mask.height());
    let depth = depth(&whole.mask);
    let start = |(lobe, &center): (usize, &DVec2)| {
        let c = whole.to_cells(center).clamp(DVec2::ZERO, DVec2::new(f64::from(width - 1), f64::from(height - 1)));
        let (x, y) = (c.x as u32, c.y as u32);
        Reverse((5 * (255 - u32::from(depth.get_pixel(x, y).0[0])), lobe, x, y))
    };
    let mut open: BinaryHeap<_> = centers.iter().enumerate().map(start).collect();
    let mut lobes = vec![Mask::new(width, height); centers.len()];
    let mut free = whole.mask.clone();
    while let Some(Reverse((cost, lobe, x, y))) = open.pop() {
        if !free.get(x.into(), y.into()) {
            continue;
        }
        free.set(x, y, false);
        lobes[lobe].set(x, y, true);
        for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
            let (nx, ny) = (i64::from(x) + dx, i64::from(y) + dy);
            if free.get(nx, ny) {
                // Chamfer distance: 5 along, 7 across.
                let step = if dx != 0 && dy != 0 { 7 } else { 5 };
                open.push(Reverse((cost + step, lobe, nx as u32, ny as u32)));
            }
        }
    }
    lobes
}

/// The cells of `mask` outside `star`.
fn without(mask: &Mask, star: &Star, cells: &Region) -> Mask {
    let mut covered = Mask::new(mask.width(), mask.height());
    star.fill(&mut covered, cells);
    mask.zip(&covered, |a, b| a && !b)
}

/// The largest connected piece, the topmost of equals.
fn largest_piece(mask: &Mask) -> Option<Mask> {
    let labels = connected_components(&mask.to_gray(), Connectivity::Four, image::Luma([0]));
    let mut sizes = vec![0usize; *labels.as_raw().iter().max()? as usize + 1];
    labels.as_raw().iter().for_each(|&l| sizes[l as usize] += 1);
    let largest = (1..sizes.len()).rev().max_by_key(|&l| sizes[l])?;
    Some(Mask::from_fn(mask.width(), mask.height(), |x, y| labels.get_pixel(x, y).0[0] as usize == largest))
}
