//! The star-shaped region that comes nearest to an outline, and the centre that makes it come nearest (ours: a crown that is closed,
//! free of self-intersection and spherically triangulated has to be star-shaped, so it is best to choose the star first).

use std::f64::consts::TAU;

use glam::DVec2;
use image::GrayImage;
use imageproc::distance_transform::{Norm, distance_transform};

use super::region::Region;
use crate::raster::{Mask, fill_polygon};

/// Rays around the centre in the final fit: a quarter of a degree, so that a column's ends are still several rays wide.
const RAYS: usize = 1440;
/// Rays, and cells per step, while the first candidates are compared, and while the best of them are refined.
const COARSE: (usize, f64) = (72, 2.0);
const FINE: (usize, f64) = (120, 1.0);
/// Candidate centres along the longer side before refinement.
const CANDIDATES: f64 = 14.0;
/// What a centre loses, in areas of the outline, for standing one outline's size off the middle: breaks ties among the many centres
/// that see all of a round crown.
const OFF_MIDDLE: f64 = 0.1;

/// A region as a radius per direction.
#[derive(Debug, Clone)]
pub(super) struct Star {
    /// Metres, x right, y up.
    pub center: DVec2,
    /// One radius per ray, metres; ray i points to angle `i / n · 2π`, counter-clockwise from +x.
    pub radius_m: Vec<f64>,
    /// Area of the outline inside, square metres.
    pub inside_m2: f64,
    /// Area beyond the outline, square metres.
    pub outside_m2: f64,
    /// Area of the whole region as the same rays sample it, square metres: what `inside_m2` is to be compared with, since both share
    /// the sampling's error.
    pub region_m2: f64,
}

impl Star {
    /// The best star-shaped fit about `center`: each ray ends where the area gained inside less `gap_cost` times the area beyond the
    /// outline is largest. At a cost of 1 a gap in the foliage does not cut off the branch behind it.
    pub fn fit(region: &Region, center: DVec2, gap_cost: f64) -> Self {
        cast(region, center, gap_cost, RAYS, 0.5)
    }

    /// Radius towards `angle`, metres, interpolated between rays.
    pub fn radius(&self, angle: f64) -> f64 {
        let n = self.radius_m.len();
        let at = (angle / TAU).rem_euclid(1.0) * n as f64;
        let (i, t) = (at as usize, at.fract());
        self.radius_m[i % n] * (1.0 - t) + self.radius_m[(i + 1) % n] * t
    }

    /// Radius that sweeps the same area as the star does within `half_rad` on both sides of `angle`.
    pub fn mean_radius(&self, angle: f64, half_rad: f64) -> f64 {
        let n = self.radius_m.len() as i64;
        let step = TAU / n as f64;
        let reach = (half_rad / step) as i64;
        let first = (angle / step).round() as i64;
        let squares = (first - reach..=first + reach).map(|i| self.radius_m[i.rem_euclid(n) as usize].powi(2));
        (squares.sum::<f64>() / (2 * reach + 1) as f64).sqrt()
    }

    /// The star as a closed polygon, metres.
    pub fn polygon(&self) -> Vec<DVec2> {
        let n = self.radius_m.len() as f64;
        let corner = |(i, &r): (usize, &f64)| self.center + r * DVec2::from_angle(i as f64 / n * TAU);
        self.radius_m.iter().enumerate().map(corner).collect()
    }

    /// Adds the star's cells to `mask`, which has the cells of `region`.
    pub fn fill(&self, mask: &mut Mask, region: &Region) {
        let corners: Vec<DVec2> = self.polygon().into_iter().map(|p| region.to_cells(p)).collect();
        fill_polygon(mask, &corners);
    }

    /// Intersection over union with a region.
    pub fn iou(&self, region: &Region) -> f64 {
        let mut mask = Mask::new(region.mask.width(), region.mask.height());
        self.fill(&mut mask, region);
        mask.iou(&region.mask)
    }
}

/// The centre whose star fits best: coarse candidates over the region, then halving steps around the best two.
pub(super) fn best_center(region: &Region, gap_cost: f64) -> DVec2 {
    best_center_where(region, gap_cost, |_| true)
}

/// The best centre among those in the thick of the region, at least `depth` times as far from its border as any cell is: not in a
/// bridge between two lobes, from where both can be seen.
pub(super) fn best_deep_center(region: &Region, gap_cost: f64, depth: f64) -> DVec2 {
    let distance = self::depth(&region.mask);
    let deepest = distance.as_raw().iter().copied().max().unwrap_or(0);
    best_center_where(region, gap_cost, |c| {
        let cell = region.to_cells(c);
        f64::from(distance.get_pixel(cell.x as u32, cell.y as u32).0[0]) >= depth * f64::from(deepest)
    })
}

/// Every cell's distance to the nearest cell outside, in cells, at most 255.
pub(super) fn depth(mask: &Mask) -> GrayImage {
    let mut outside = mask.to_gray();
    outside.pixels_mut().for_each(|p| p.0[0] = 255 - p.0[0]);
    distance_transform(&outside, Norm::L2)
}

fn best_center_where(region: &Region, gap_cost: f64, allowed: impl Fn(DVec2) -> bool) -> DVec2 {
    let size = f64::from(region.mask.width().max(region.mask.height())) * region.cell_m;
    let middle = region.centroid();
    let score = |c: DVec2, (rays, step): (usize, f64)| {
        if !contains(region, c) || !allowed(c) {
            return f64::NEG_INFINITY;
        }
        let star = cast(region, c, gap_cost, rays, step);
        (star.inside_m2 - gap_cost * star.outside_m2) / star.region_m2.max(1e-12)
            - OFF_MIDDLE * ((c - middle) / size).length_squared()
    };
    let step = size / CANDIDATES;
    let span = CANDIDATES as i32;
    let grid = (-span..=span).flat_map(|y| (-span..=span).map(move |x| middle + step * DVec2::new(x.into(), y.into())));
    let mut found: Vec<(f64, DVec2)> = grid.map(|c| (score(c, COARSE), c)).filter(|f| f.0.is_finite()).collect();
    if found.is_empty() {
        // A region thinner than the candidates are apart: any of its own cells will do.
        found.extend(nearest_cell(region).map(|c| (0.0, c)));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fine = |c: DVec2| score(c, FINE);
    let refined = found.into_iter().take(2).map(|(_, c)| climb((fine(c), c), step, region.cell_m, &fine));
    refined.reduce(|a, b| if b.0 > a.0 { b } else { a }).map_or(middle, |best| best.1)
}

/// Walks uphill from a scored start, halving the step until it is a cell.
fn climb((mut best, mut at): (f64, DVec2), mut step: f64, smallest: f64, score: &impl Fn(DVec2) -> f64) -> (f64, DVec2) {
    while step > smallest {
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(x, y)| at + step * DVec2::new(x.into(), y.into()));
        let better = around.map(|c| (score(c), c)).into_iter().filter(|(s, _)| *s > best);
        match better.reduce(|a, b| if b.0 > a.0 { b } else { a }) {
            Some((s, c)) => (best, at) = (s, c),
            None => step *= 0.5,
        }
    }
    (best, at)
}

/// The middle of the cell nearest to the middle of the region.
fn nearest_cell(region: &Region) -> Option<DVec2> {
    let (width, middle) = (region.mask.width() as usize, region.centroid());
    let set = region.mask.as_raw().iter().enumerate().filter(|(_, v)| **v != 0);
    let at = set.map(|(i, _)| region.to_metres(DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)));
    at.min_by(|a, b| a.distance_squared(middle).total_cmp(&b.distance_squared(middle)))
}

fn contains(region: &Region, p: DVec2) -> bool {
    let c = region.to_cells(p).floor();
    region.mask.get(c.x as i64, c.y as i64)
}

/// Casts `rays` from `center` in steps of `step` cells.
fn cast(region: &Region, center: DVec2, gap_cost: f64, rays: usize, step: f64) -> Star {
    let (width, height) = (region.mask.width() as usize, region.mask.height() as usize);
    let (data, start) = (region.mask.as_raw(), region.to_cells(center));
    let farthest = [0, 1, 2, 3].map(|k| start.distance(DVec2::new((k % 2 * width) as f64, (k / 2 * height) as f64)));
    let steps = (farthest.into_iter().fold(0.0, f64::max) / step) as usize;
    // Area of one step of one ray, in units of its radius.
    let weight = step * region.cell_m * region.cell_m * TAU / rays as f64;
    let mut star = Star { center, radius_m: Vec::with_capacity(rays), inside_m2: 0.0, outside_m2: 0.0, region_m2: 0.0 };
    for i in 0..rays {
        let along = DVec2::from_angle(i as f64 / rays as f64 * TAU) * DVec2::new(1.0, -1.0);
        let (mut inside, mut outside) = (0.0, 0.0);
        // Gain, end, inside and outside so far; never shorter than one cell, so that the solid keeps a kernel.
        let mut best = (0.0, 1.0, 0.0, 0.0);
        for k in 0..steps {
            let r = (k as f64 + 0.5) * step;
            let p = start + r * along;
            if p.x < 0.0 || p.y < 0.0 || p.x >= width as f64 || p.y >= height as f64 {
                break;
            }
            if data[p.y as usize * width + p.x as usize] != 0 {
                inside += r;
                let gain = inside - gap_cost * outside;
                if gain > best.0 {
                    best = (gain, (k + 1) as f64 * step, inside, outside);
                }
            } else {
                outside += r;
            }
        }
        let (_, end, held, beyond) = best;
        star.radius_m.push(end.max(1.0) * region.cell_m);
        star.inside_m2 += held * weight;
        star.outside_m2 += beyond * weight;
        star.region_m2 += inside * weight;
    }
    star
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc() -> Region {
        let corner = |i| DVec2::new(3.0, 5.0) + 2.0 * DVec2::from_angle(f64::from(i) * TAU / 200.0);
        Region::from_contour(&(0..200).map(corner).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_disc_is_its_own_star_from_its_middle() {
        let region = disc();
        let center = best_center(&region, 1.0);
        assert!(center.distance(DVec2::new(3.0, 5.0)) < 0.1, "{center}");
        let star = Star::fit(&region, center, 1.0);
        assert!(star.iou(&region) > 0.985, "{}", star.iou(&region));
        assert!((star.radius(1.0) - 2.0).abs() < 0.1 && (star.mean_radius(1.0, 0.2) - 2.0).abs() < 0.1);
    }

    #[test]
    fn the_kernel_of_an_l_is_found() {
        // An L of two arms, 4 × 1 each: only the unit square at the corner sees all of it.
        let l = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0)].map(|(x, y)| DVec2::new(x, y));
        let region = Region::from_contour(&l).unwrap();
        let center = best_center(&region, 1.0);
        assert!(center.x < 1.05 && center.y < 1.05, "{center}");
        assert!(Star::fit(&region, center, 1.0).iou(&region) > 0.97);
    }
}
