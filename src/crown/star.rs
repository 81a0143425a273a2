//! The star-shaped region that comes nearest to an outline, and the centre that makes it come nearest (ours: a crown that is closed,
//! free of self-intersection and spherically triangulated has to be star-shaped, so it is best to choose the star first).

use std::f64::consts::TAU;

use glam::DVec2;

use super::region::Region;

/// Rays around the centre in the final fit: half a degree.
const RAYS: usize = 720;
/// Rays while centres are compared.
const SEARCH_RAYS: usize = 120;
/// Candidate centres along the longer side before refinement.
const CANDIDATES: f64 = 14.0;
/// What a centre loses, in areas of the outline, for standing one outline's size off the middle: breaks ties among the many centres
/// that see all of a round crown.
const OFF_MIDDLE: f64 = 0.05;

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
}

impl Star {
    /// The best star-shaped fit about `center`: each ray ends where the area gained inside less the area lost outside is largest, so
    /// a gap in the foliage does not cut off the branch behind it.
    pub fn fit(region: &Region, center: DVec2) -> Self {
        cast(region, center, RAYS, 0.5)
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

    /// Intersection over union with the region the star was fitted to.
    #[cfg(test)]
    pub fn iou(&self, region: &Region) -> f64 {
        self.inside_m2 / (region.area_m2() + self.outside_m2)
    }
}

/// The centre whose star fits best: coarse candidates over the region, then halving steps around the best three.
pub(super) fn best_center(region: &Region) -> DVec2 {
    let size = f64::from(region.mask.width().max(region.mask.height())) * region.cell_m;
    let (middle, area) = (region.centroid(), region.area_m2());
    let score = |c: DVec2| {
        let star = cast(region, c, SEARCH_RAYS, 1.0);
        (star.inside_m2 - star.outside_m2) / area - OFF_MIDDLE * ((c - middle) / size).length_squared()
    };
    let step = size / CANDIDATES;
    let span = CANDIDATES as i32;
    let grid = (-span..=span).flat_map(|y| (-span..=span).map(move |x| middle + step * DVec2::new(x.into(), y.into())));
    let mut found: Vec<(f64, DVec2)> = grid.filter(|&c| contains(region, c)).map(|c| (score(c), c)).collect();
    found.push((score(middle), middle));
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(3);
    let refined = found.into_iter().map(|start| climb(start, step, region.cell_m, &score));
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

fn contains(region: &Region, p: DVec2) -> bool {
    let c = region.to_cells(p).floor();
    region.mask.get(c.x as i64, c.y as i64)
}

/// Casts `rays` from `center` in steps of `step` cells.
fn cast(region: &Region, center: DVec2, rays: usize, step: f64) -> Star {
    let (width, height) = (region.mask.width() as usize, region.mask.height() as usize);
    let (data, start) = (region.mask.as_raw(), region.to_cells(center));
    let farthest = [0, 1, 2, 3].map(|k| start.distance(DVec2::new((k % 2 * width) as f64, (k / 2 * height) as f64)));
    let steps = (farthest.into_iter().fold(0.0, f64::max) / step) as usize;
    // Area of one step of one ray, in units of its radius.
    let weight = step * region.cell_m * region.cell_m * TAU / rays as f64;
    let mut star = Star { center, radius_m: Vec::with_capacity(rays), inside_m2: 0.0, outside_m2: 0.0 };
    for i in 0..rays {
        let along = DVec2::from_angle(i as f64 / rays as f64 * TAU) * DVec2::new(1.0, -1.0);
        let (mut gain, mut inside) = (0.0, 0.0);
        // Never shorter than one cell, so that the solid keeps a kernel.
        let mut best = (0.0, 1.0, 0.0);
        for k in 0..steps {
            let r = (k as f64 + 0.5) * step;
            let p = start + r * along;
            if p.x < 0.0 || p.y < 0.0 || p.x >= width as f64 || p.y >= height as f64 {
                break;
            }
            if data[p.y as usize * width + p.x as usize] != 0 {
                gain += r;
                inside += r;
                if gain > best.0 {
                    best = (gain, (k + 1) as f64 * step, inside);
                }
            } else {
                gain -= r;
            }
        }
        let (gain, end, inside) = best;
        star.radius_m.push(end.max(1.0) * region.cell_m);
        star.inside_m2 += inside * weight;
        star.outside_m2 += (inside - gain) * weight;
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
        let center = best_center(&region);
        assert!(center.distance(DVec2::new(3.0, 5.0)) < 0.1, "{center}");
        let star = Star::fit(&region, center);
        assert!(star.iou(&region) > 0.985, "{}", star.iou(&region));
        assert!((star.radius(1.0) - 2.0).abs() < 0.1 && (star.mean_radius(1.0, 0.2) - 2.0).abs() < 0.1);
    }

    #[test]
    fn the_kernel_of_an_l_is_found() {
        // An L of two arms, 4 × 1 each: only the unit square at the corner sees all of it.
        let l = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0)].map(|(x, y)| DVec2::new(x, y));
        let region = Region::from_contour(&l).unwrap();
        let center = best_center(&region);
        assert!(center.x < 1.05 && center.y < 1.05, "{center}");
        assert!(Star::fit(&region, center).iou(&region) > 0.97);
    }
}
