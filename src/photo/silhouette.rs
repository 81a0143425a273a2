//! The crown's outline, its axis and its significant turning points (She §3.1, fig. 7e and 8a). Pixels of the photograph, y down.

use glam::DVec2;
use imageproc::{geometry::approximate_polygon_dp, point::Point};

use super::contour::{contours, signed_area, smooth_closed};
use super::trunk;
use crate::raster::Mask;
use crate::{Error, Result};

crate::params! {
    /// How the outline is simplified.
    pub struct SilhouetteParams {
        /// Largest distance between the outline and its simplification, as a fraction of the crown's height.
        outline_tolerance: f64 = 0.01, in 0.001..=0.1, unit "", source "ours: keeps boughs and drops leaves; She names no scale";
        /// Smallest piece of a crown that stands by itself, as a part of the largest's area: anything smaller is a loose twig.
        min_piece: f64 = 0.02, in 0.0..=1.0, unit "", source "ours: pines and acacias hold their foliage in separate cushions";
        /// Largest lean of the crown's axis from the vertical.
        axis_lean_deg: f64 = 30.0, in 0.0..=60.0, unit "°", source "ours: crowns lean less even where trunks lean more";
    }
}

/// The crown's axis in the picture, pixels; a leaning tree has a leaning axis.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axis {
    /// Where the axis leaves the crown below.
    pub base: DVec2,
    /// Where it leaves the crown above.
    pub top: DVec2,
}

impl Silhouette {
    /// The contours of all its pieces, the largest first.
    pub fn pieces(&self) -> impl Iterator<Item = &[DVec2]> {
        std::iter::once(&self.contour[..]).chain(self.others.iter().map(|piece| &piece[..]))
    }
}

/// The outline of the crown, pixels.
#[derive(Debug, Clone)]
pub struct Silhouette {
    /// The outer contour of the largest piece, closed, without repeating its first point.
    pub contour: Vec<DVec2>,
    /// Those of its other pieces, the largest first.
    pub others: Vec<Vec<DVec2>>,
    /// The axis the profile is revolved about.
    pub axis: Axis,
    /// Significant turning points left of the axis, from the base to the top.
    pub left: Vec<DVec2>,
    /// Significant turning points right of the axis, from the base to the top.
    pub right: Vec<DVec2>,
}

/// Smallest crown that has an outline worth modelling, pixels.
const SMALLEST_CROWN: usize = 9;

/// Standard deviation of the smoothing along the contour, in pixel edges: enough to hide the staircase, too little to move a corner.
const STAIRCASE: f64 = 1.0;

/// How much a crown's width holds its axis upright: a round crown leans half as much as its rows' middles do.
const STIFFNESS: f64 = 0.1;

/// Traces the regions of `crown`; the axis is that of all of them, the turning points are the largest's. `tree` is the whole tree with its trunk (the crown itself where no trunk is visible): where
/// the trunk enters the crown, the axis is drawn to it.
///
/// # Errors
/// [`Error::MaskSize`] when the masks differ in size, [`Error::CrownTooSmall`] when the largest region has under nine pixels.
pub fn trace(crown: &Mask, tree: &Mask, params: &SilhouetteParams) -> Result<Silhouette> {
    let (expected, found) = ((crown.width(), crown.height()), (tree.width(), tree.height()));
    if expected != found {
        return Err(Error::MaskSize { what: "tree mask", expected, found });
    }
    let mut pieces = contours(crown, params.min_piece).into_iter();
    let raw = pieces.next().unwrap_or_default();
    if signed_area(&raw) < SMALLEST_CROWN as f64 - 1.0 {
        return Err(Error::CrownTooSmall { needed: SMALLEST_CROWN, found: crown.count() });
    }
    let contour = smooth_closed(&raw, STAIRCASE);
    let sizeable = pieces.filter(|piece| signed_area(piece) >= SMALLEST_CROWN as f64);
    let others: Vec<Vec<DVec2>> = sizeable.map(|piece| smooth_closed(&piece, STAIRCASE)).collect();
    let spans = row_spans(contour.iter().chain(others.iter().flatten()));
    let neck = trunk::neck(crown, tree).filter(|neck| carries(*neck, &spans));
    let line = fit_line(&spans, neck, params.axis_lean_deg.to_radians().tan());
    let Some((below, above)) = crossings(&contour, line) else {
        return Err(Error::CrownTooSmall { needed: SMALLEST_CROWN, found: crown.count() });
    };
    let (left, right) = sides(&contour, below, above);
    let tolerance_px = params.outline_tolerance * (below.point.y - above.point.y);
    Ok(Silhouette {
        left: simplify(&left, tolerance_px),
        right: simplify(&right, tolerance_px),
        axis: Axis { base: below.point, top: above.point },
        contour,
        others,
    })
}

/// A line through the picture: x = `x0` + `slope` · y.
#[derive(Clone, Copy)]
struct Line {
    x0: f64,
    slope: f64,
}

/// One row of the crown: height, middle and width between its outermost contour points.
struct Span {
    y: f64,
    middle: f64,
    width: f64,
}

fn row_spans<'a>(contours: impl Iterator<Item = &'a DVec2> + Clone) -> Vec<Span> {
    let (low, high) = contours.clone().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p.y), b.max(p.y)));
    let mut rows = vec![(f64::MAX, f64::MIN); (high - low).ceil() as usize + 1];
    for p in contours {
        let row = &mut rows[(p.y - low) as usize];
        *row = (row.0.min(p.x), row.1.max(p.x));
    }
    let span = |(i, &(a, b)): (usize, &(f64, f64))| Span { y: low + i as f64 + 0.5, middle: 0.5 * (a + b), width: b - a };
    rows.iter().enumerate().filter(|(_, r)| r.0 < r.1).map(span).collect()
}

/// Whether a trunk's neck lies under the crown's middle half, and not under a neighbour's.
fn carries(neck: DVec2, spans: &[Span]) -> bool {
    let left = spans.iter().fold(f64::MAX, |m, s| m.min(s.middle - 0.5 * s.width));
    let right = spans.iter().fold(f64::MIN, |m, s| m.max(s.middle + 0.5 * s.width));
    (neck.x - 0.5 * (left + right)).abs() <= 0.25 * (right - left)
}

/// Weighted line through the rows' middles by iteratively reweighted least squares (Tukey's biweight), so that one long branch does
/// not tilt the axis. A trunk's neck weighs as much as a quarter of the rows.
fn fit_line(spans: &[Span], neck: Option<DVec2>, steepest: f64) -> Line {
    let total: f64 = spans.iter().map(|s| s.width).sum();
    // The wider a crown, the less its rows' middles tell of a lean: its mean square width holds the axis upright.
    let stiffness = STIFFNESS * spans.iter().map(|s| s.width.powi(3)).sum::<f64>() / total.max(1e-12);
    let mut points: Vec<(DVec2, f64)> = spans.iter().map(|s| (DVec2::new(s.middle, s.y), s.width)).collect();
    points.extend(neck.map(|n| (n, total / 4.0)));
    let mut trust = vec![1.0; points.len()];
    let mut line = Line { x0: 0.0, slope: 0.0 };
    for _ in 0..8 {
        line = least_squares(&points, &trust, stiffness, steepest);
        let residual = |(p, _): &(DVec2, f64)| (p.x - line.x0 - line.slope * p.y).abs();
        let mut sorted: Vec<f64> = points.iter().map(residual).collect();
        sorted.sort_by(f64::total_cmp);
        // 4.685 standard deviations, the deviation from the median residual; never sharper than two pixels.
        let cut = (4.685 * 1.4826 * sorted[sorted.len() / 2]).max(2.0);
        trust = points.iter().map(|p| (1.0 - (residual(p) / cut).powi(2)).max(0.0).powi(2)).collect();
        // The neck is no outlier: it is where the tree does stand.
        trust[spans.len()..].fill(1.0);
    }
    line
}

fn least_squares(points: &[(DVec2, f64)], trust: &[f64], stiffness: f64, steepest: f64) -> Line {
    let weighted = || points.iter().zip(trust).map(|((p, w), t)| (*p, w * t));
    let total: f64 = weighted().map(|(_, w)| w).sum::<f64>().max(1e-12);
    let mean = weighted().map(|(p, w)| p * w).sum::<DVec2>() / total;
    let (xy, yy) = weighted().fold((0.0, 0.0), |(xy, yy), (p, w)| {
        let d = p - mean;
        (xy + w * d.x * d.y, yy + w * d.y * d.y)
    });
    let slope = if yy > 0.0 { (xy / (yy + stiffness * total)).clamp(-steepest, steepest) } else { 0.0 };
    Line { x0: mean.x - slope * mean.y, slope }
}

/// Where a line crosses the contour: the point, and the contour point before it.
#[derive(Clone, Copy)]
struct Crossing {
    point: DVec2,
    before: usize,
}

/// The lowest and the highest crossing of `line` with the contour; a line that misses (a crown like a sickle) is moved onto it.
fn crossings(contour: &[DVec2], line: Line) -> Option<(Crossing, Crossing)> {
    let side = |p: DVec2| p.x - line.x0 - line.slope * p.y;
    let mean = contour.iter().map(|&p| side(p)).sum::<f64>() / contour.len() as f64;
    let cross = |shift: f64| {
        let all = (0..contour.len()).filter_map(move |i| {
            let (p, q) = (contour[i], contour[(i + 1) % contour.len()]);
            let (a, b) = (side(p) - shift, side(q) - shift);
            ((a < 0.0) != (b < 0.0)).then(|| Crossing { point: p.lerp(q, a / (a - b)), before: i })
        });
        let all: Vec<Crossing> = all.collect();
        let lowest = all.iter().copied().max_by(|a, b| a.point.y.total_cmp(&b.point.y))?;
        let highest = all.iter().copied().min_by(|a, b| a.point.y.total_cmp(&b.point.y))?;
        (lowest.before != highest.before).then_some((lowest, highest))
    };
    cross(0.0).or_else(|| cross(mean))
}

/// The contour from base to top on the left and on the right.
fn sides(contour: &[DVec2], below: Crossing, above: Crossing) -> (Vec<DVec2>, Vec<DVec2>) {
    let n = contour.len();
    let chain = |from: Crossing, to: Crossing| {
        let count = (to.before + n - from.before) % n;
        let between = (1..=count).map(|k| contour[(from.before + k) % n]);
        std::iter::once(from.point).chain(between).chain(std::iter::once(to.point)).collect::<Vec<_>>()
    };
    // The contour runs clockwise in the picture: from the base it climbs the left side.
    let (left, mut right) = (chain(below, above), chain(above, below));
    right.reverse();
    (left, right)
}

/// Douglas–Peucker: the turning points that matter at this scale.
fn simplify(chain: &[DVec2], tolerance_px: f64) -> Vec<DVec2> {
    let points: Vec<Point<f64>> = chain.iter().map(|p| Point::new(p.x, p.y)).collect();
    approximate_polygon_dp(&points, tolerance_px.max(0.25), false).iter().map(|p| DVec2::new(p.x, p.y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn traced(mask: &Mask) -> Silhouette {
        trace(mask, mask, &SilhouetteParams::default()).unwrap()
    }

    fn ellipse(size: u32, lean: f64) -> Mask {
        let half = f64::from(size) / 2.0;
        Mask::from_fn(size, size, |x, y| {
            let (x, y) = ((f64::from(x) + 0.5 - half) / half, (f64::from(y) + 0.5 - half) / half);
            ((x + lean * y) / 0.4).powi(2) + (y / 0.9).powi(2) < 1.0
        })
    }

    fn lean(silhouette: &Silhouette) -> f64 {
        let d = silhouette.axis.top - silhouette.axis.base;
        d.x / -d.y
    }

    #[test]
    fn a_symmetric_crown_stands_upright_and_a_leaning_one_leans() {
        assert!(lean(&traced(&ellipse(200, 0.0))).abs() < 1e-3);
        let leaning = lean(&traced(&ellipse(200, 0.4)));
        assert!((0.25..0.45).contains(&leaning), "{leaning}");
    }

    #[test]
    fn one_long_branch_does_not_tilt_the_axis() {
        let plain = ellipse(200, 0.0);
        let branch = Mask::from_fn(200, 200, |x, y| (100..195).contains(&x) && (60..72).contains(&y));
        let silhouette = traced(&plain.zip(&branch, |a, b| a || b));
        assert!(lean(&silhouette).abs() < 0.03, "{}", lean(&silhouette));
    }

    #[test]
    fn the_axis_is_drawn_to_the_trunk() {
        let crown = Mask::from_fn(200, 200, |x, y| (f64::from(x) - 100.0).hypot(f64::from(y) - 80.0) < 60.0);
        let trunk = Mask::from_fn(200, 200, |x, y| (118..126).contains(&x) && (100..190).contains(&y));
        let tree = crown.zip(&trunk, |a, b| a || b);
        let silhouette = trace(&crown, &tree, &SilhouetteParams::default()).unwrap();
        assert!(silhouette.axis.base.x > 103.0, "{:?}", silhouette.axis);
        // A neighbour's trunk, far out, steers nothing.
        let neighbour = Mask::from_fn(200, 200, |x, y| (180..188).contains(&x) && (100..190).contains(&y));
        let silhouette = trace(&crown, &crown.zip(&neighbour, |a, b| a || b), &SilhouetteParams::default()).unwrap();
        assert!(lean(&silhouette).abs() < 1e-3, "{:?}", silhouette.axis);
    }

    #[test]
    fn the_corners_of_a_kite_are_its_turning_points() {
        // Corners: top (100, 20), right (160, 90), bottom (100, 190), left (40, 90).
        let mask = Mask::from_fn(200, 210, |x, y| {
            let (x, y) = ((f64::from(x) + 0.5 - 100.0).abs(), f64::from(y) + 0.5);
            x < if y < 90.0 { (y - 20.0) * 60.0 / 70.0 } else { (190.0 - y) * 0.6 }
        });
        let silhouette = traced(&mask);
        for (side, x) in [(&silhouette.left, 40.0), (&silhouette.right, 160.0)] {
            assert!(side.iter().any(|p| p.distance(DVec2::new(x, 90.0)) < 3.0), "{side:?}");
            assert!(side.len() <= 5, "{side:?}");
        }
    }

    #[test]
    fn turning_points_depend_on_the_shape_and_not_on_the_resolution() {
        let star = |scale: f64| {
            let size = (200.0 * scale) as u32;
            traced(&Mask::from_fn(size, size, |x, y| {
                let d = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / scale - 100.0;
                d.length() < 70.0 + 15.0 * (7.0 * d.to_angle()).cos()
            }))
        };
        let (coarse, fine) = (star(1.0), star(3.0));
        assert!(coarse.left.len().abs_diff(fine.left.len()) <= 4, "{} and {}", coarse.left.len(), fine.left.len());
    }

    #[test]
    fn specks_and_unequal_masks_are_errors() {
        let params = SilhouetteParams::default();
        for found in [0u32, 1, 2] {
            let mask = Mask::from_fn(9, 9, |x, y| x < found && y < found);
            assert!(matches!(trace(&mask, &mask, &params), Err(Error::CrownTooSmall { .. })), "{found}");
        }
        let mask = Mask::from_fn(9, 9, |_, _| true);
        assert!(trace(&mask, &mask, &params).is_ok());
        assert!(matches!(trace(&mask, &Mask::new(9, 8), &params), Err(Error::MaskSize { .. })));
    }

    proptest! {
        #[test]
        fn any_mask_gives_ordered_sides_or_an_error(bits in proptest::collection::vec(any::<bool>(), 100), scale in 1u32..4) {
            let mask = Mask::from_fn(10 * scale, 10 * scale, |x, y| bits[(x / scale + 10 * (y / scale)) as usize]);
            if let Ok(s) = trace(&mask, &mask, &SilhouetteParams::default()) {
                prop_assert!(s.axis.base.y > s.axis.top.y);
                for side in [&s.left, &s.right] {
                    prop_assert_eq!(side[0], s.axis.base);
                    prop_assert_eq!(side[side.len() - 1], s.axis.top);
                    prop_assert!(side.iter().all(|p| p.is_finite()));
                }
            }
        }
    }
}
