//! Splitting an outline that one star-shaped solid cannot hold into several that can (She fig. 4b: "several sphere-boards").

use imageproc::distance_transform::Norm;
use imageproc::morphology::dilate;
use imageproc::region_labelling::{Connectivity, connected_components};

use super::CrownParams;
use super::region::Region;
use super::star::{Star, best_center};
use crate::raster::{Mask, fill_polygon};

/// How far a lobe reaches into what is covered already, as a fraction of the outline's size, so that no crack shows between solids.
const OVERLAP: f64 = 0.04;

/// The regions to model, largest part first: the whole outline when one star-shaped solid loses at most `lobe_split` of it, otherwise
/// greedily the largest piece that is still missing, until little enough is.
pub(super) fn split(whole: &Region, params: &CrownParams) -> Vec<(Region, Star)> {
    let total = whole.mask.count() as f64;
    let star = Star::fit(whole, best_center(whole));
    let mut missing = without(&whole.mask, &star, whole);
    let mut parts = vec![(whole.clone(), star)];
    while parts.len() < params.crowns_most as usize && missing.count() as f64 > params.lobe_split * total {
        let Some(piece) = largest_piece(&missing).filter(|p| p.count() as f64 >= params.lobe_smallest * total) else { break };
        let overlap = (OVERLAP * f64::from(whole.mask.width().max(whole.mask.height()))).round() as u8;
        let grown = Mask::from_gray(&dilate(&piece.to_gray(), Norm::L2, overlap));
        let lobe = whole.with(grown.zip(&whole.mask, |a, b| a && b));
        let star = Star::fit(&lobe, best_center(&lobe));
        let still = without(&missing, &star, whole);
        if missing.count() as f64 - still.count() as f64 <= 0.5 * params.lobe_smallest * total {
            break;
        }
        missing = still;
        parts.push((lobe, star));
    }
    parts
}

/// The cells of `mask` outside `star`.
fn without(mask: &Mask, star: &Star, cells: &Region) -> Mask {
    let mut covered = Mask::new(mask.width(), mask.height());
    let corners: Vec<_> = star.polygon().into_iter().map(|p| cells.to_cells(p)).collect();
    fill_polygon(&mut covered, &corners);
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
