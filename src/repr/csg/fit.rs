//! Which primitives stand for a tree: those whose silhouettes agree best with its own from the front, from the right and from above
//! (She fig. 15a chooses by hand).

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::primitive::{Primitive, Shape};
use crate::raster::Mask;
use crate::repr::sphere_board::picture::Picture;

/// Cells along the longer side of a silhouette.
const CELLS: f64 = 72.0;
/// Steps by which a primitive is moved and sized, of its own size, from coarse to fine.
const STEPS: [f64; 5] = [0.2, 0.1, 0.1, 0.05, 0.025];
/// How much more a cell counts that is covered and should not be than one that should be and is not: what sticks out of a crown is seen
/// against the sky, what is missing of it is hidden by the rest.
const OVERSHOOT: f64 = 1.2;
/// What a further primitive must add to the mean agreement.
const WORTH: f64 = 0.004;
/// Leaves that are looked at for what is not covered yet, and how near they stand together, of the tree's size.
const SAMPLES: usize = 500;
/// How often clusters of points are moved to their middles.
const ROUNDS: usize = 16;
const NEAR: f64 = 0.16;

/// A silhouette as cells.
#[derive(Debug, Clone)]
pub(super) struct Sight {
    axes: [DVec3; 2],
    /// Top left corner and side of a cell, metres.
    origin: DVec2,
    cell_m: f64,
    mask: Mask,
}

impl Sight {
    /// Of a picture; `inside` says which of its pixels count.
    pub fn of(picture: &Picture, inside: &Mask) -> Option<Self> {
        let bounds = inside.bounds()?;
        let step = (f64::from(bounds.width.max(bounds.height)) / CELLS).max(1.0);
        // Some cells more all round, so that what sticks out counts against a primitive.
        let rim = 6.0;
        let cells = |px: u32| (f64::from(px) / step + 2.0 * rim).ceil() as u32;
        let from = DVec2::new(f64::from(bounds.x), f64::from(bounds.y)) - rim * step;
        let mask = Mask::from_fn(cells(bounds.width), cells(bounds.height), |x, y| {
            let p = from + step * (DVec2::new(f64::from(x), f64::from(y)) + 0.5);
            inside.get(p.x.floor() as i64, p.y.floor() as i64)
        });
        let origin = (from - picture.foot_px) * picture.metres_per_px * DVec2::new(1.0, -1.0);
        let axes = picture.front().axes;
        let axes = [axes[0].as_dvec3(), axes[1].as_dvec3()];
        Some(Self { axes, origin, cell_m: step * picture.metres_per_px, mask })
    }

    /// The cells that a primitive covers.
    fn covered(&self, primitive: &Primitive) -> Vec<bool> {
        let (width, height) = (self.mask.width(), self.mask.height());
        let cells = (0..height).flat_map(|y| (0..width).map(move |x| DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)));
        cells.map(|cell| primitive.covers(self.axes, self.origin + self.cell_m * cell * DVec2::new(1.0, -1.0))).collect()
    }
}

/// Primitives and how many cover each cell of each sight.
struct Fit<'a> {
    sights: &'a [Sight],
    kinds: &'a [Shape],
    chosen: Vec<Primitive>,
    counts: Vec<Vec<u8>>,
}

impl Fit<'_> {
    /// Mean agreement with `one` more: IoU, but that what is covered and should not be counts more.
    fn agreement(&self, one: Option<&Primitive>) -> f64 {
        let iou = |(sight, counts): (&Sight, &Vec<u8>)| {
            let covered = one.map(|one| sight.covered(one));
            let (mut both, mut either, mut beside) = (0usize, 0usize, 0usize);
            for (i, (&inside, &count)) in sight.mask.as_raw().iter().zip(counts).enumerate() {
                let there = count > 0 || covered.as_ref().is_some_and(|covered| covered[i]);
                both += usize::from(inside != 0 && there);
                either += usize::from(inside != 0 || there);
                beside += usize::from(inside == 0 && there);
            }
            both as f64 / (either as f64 + (OVERSHOOT - 1.0) * beside as f64).max(1.0)
        };
        self.sights.iter().zip(&self.counts).map(iou).sum::<f64>() / self.sights.len().max(1) as f64
    }

    fn count(&mut self, one: &Primitive, more: bool) {
        for (sight, counts) in self.sights.iter().zip(&mut self.counts) {
            for (count, covered) in counts.iter_mut().zip(sight.covered(one)) {
                *count = if more { *count + u8::from(covered) } else { *count - u8::from(covered) };
            }
        }
    }

    fn add(&mut self, one: Primitive) {
        self.count(&one, true);
        self.chosen.push(one);
    }

    /// Moves, sizes and if need be exchanges one that is not counted, for the best agreement.
    fn refined(&self, start: Primitive, steps: &[f64], exchange: bool) -> (f64, Primitive) {
        let mut best = (self.agreement(Some(&start)), start);
        if exchange {
            let others =
                self.kinds.iter().filter(|kind| **kind != start.shape).map(|kind| self.refined(start.with(*kind), steps, false));
            best = others.fold(self.refined(start, steps, false), |a, b| if b.0 > a.0 + 1e-9 { b } else { a });
            return best;
        }
        for step in steps {
            for k in 0..6 {
                for sign in [-1.0, 1.0] {
                    let mut next = best.1;
                    if k < 3 {
                        next.center[k] += sign * step * next.half[k];
                    } else if next.shape == Shape::Sphere {
                        next.half *= 1.0 + sign * step;
                    } else {
                        next.half[k - 3] *= 1.0 + sign * step;
                    }
                    let agreement = self.agreement(Some(&next));
                    if agreement > best.0 + 1e-9 {
                        best = (agreement, next);
                    }
                }
            }
        }
        best
    }

    /// Every one in turn, the others as they are.
    fn settle(&mut self, steps: &[f64]) {
        for _ in 0..self.chosen.len() {
            let one = self.chosen.remove(0);
            self.count(&one, false);
            let (_, one) = self.refined(one, steps, true);
            self.add(one);
        }
    }
}

/// At most `most` primitives of these `kinds` for what the sights show; `points` lie in what is to be covered. Starts from `starts` and
/// from clusters of the points, two and more, since one large primitive that covers all leaves nothing to add: the best of all is taken.
/// Also the mean agreement that they reach.
pub(super) fn fitted(
    sights: &[Sight],
    kinds: &[Shape],
    starts: &[Primitive],
    points: &[DVec3],
    most: usize,
) -> (Vec<Primitive>, f64) {
    let clusters = (2..=most).map(|count| clustered(points, count));
    let starts: Vec<Vec<Primitive>> = std::iter::once(starts.to_vec()).chain(clusters).collect();
    let fits: Vec<_> = starts.par_iter().map(|starts| fitted_from(sights, kinds, starts, points, most)).collect();
    let worth = |fit: &(Vec<Primitive>, f64)| fit.1 - WORTH * fit.0.len() as f64;
    fits.into_iter().reduce(|best, next| if worth(&next) > worth(&best) { next } else { best }).unwrap_or_default()
}

/// Ellipsoids of `count` clusters of points (Lloyd 1982), at first about points as far from one another as can be.
fn clustered(points: &[DVec3], count: usize) -> Vec<Primitive> {
    let points: Vec<DVec3> = points.iter().step_by(points.len().div_ceil(SAMPLES).max(1)).copied().collect();
    let nearest = |p: DVec3, centers: &[DVec3]| {
        let all = centers.iter().map(|center| center.distance_squared(p)).enumerate();
        all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::MAX))
    };
    let mut centers: Vec<DVec3> = vec![];
    while centers.len() < count {
        let farthest = points.iter().max_by(|a, b| nearest(**a, &centers).1.total_cmp(&nearest(**b, &centers).1));
        let Some(farthest) = farthest else { return vec![] };
        centers.push(*farthest);
    }
    let of =
        |k: usize, centers: &[DVec3]| -> Vec<DVec3> { points.iter().copied().filter(|p| nearest(*p, centers).0 == k).collect() };
    let mean = |group: &[DVec3]| group.iter().sum::<DVec3>() / group.len().max(1) as f64;
    for _ in 0..ROUNDS {
        let groups: Vec<Vec<DVec3>> = (0..count).map(|k| of(k, &centers)).collect();
        centers.iter_mut().zip(&groups).filter(|(_, group)| !group.is_empty()).for_each(|(center, group)| *center = mean(group));
    }
    let ellipsoid = |k: usize| {
        let group = of(k, &centers);
        let spread = group.iter().map(|p| (*p - centers[k]).powf(2.0)).sum::<DVec3>() / group.len().max(1) as f64;
        // Of a solid ellipsoid the half sizes are √5 deviations.
        let half = (5.0 * spread).map(f64::sqrt);
        (group.len() > 3).then(|| Primitive { shape: Shape::Ellipsoid, center: centers[k], half: half.max(DVec3::splat(1e-3)) })
    };
    (0..count).filter_map(ellipsoid).collect()
}

fn fitted_from(sights: &[Sight], kinds: &[Shape], starts: &[Primitive], points: &[DVec3], most: usize) -> (Vec<Primitive>, f64) {
    let counts = sights.iter().map(|sight| vec![0; sight.mask.as_raw().len()]).collect();
    let mut fit = Fit { sights, kinds, chosen: vec![], counts };
    starts.iter().take(most).for_each(|start| fit.add(*start));
    fit.settle(&STEPS);
    while fit.chosen.len() < most {
        let Some(start) = uncovered(points, &fit.chosen) else { break };
        let before = fit.agreement(None);
        let (after, one) = fit.refined(start, &STEPS, true);
        if after < before + WORTH {
            break;
        }
        fit.add(one);
        fit.settle(&STEPS[2..]);
    }
    let agreement = fit.agreement(None);
    (fit.chosen, agreement)
}

/// A ball where most points lie that no primitive holds.
fn uncovered(points: &[DVec3], chosen: &[Primitive]) -> Option<Primitive> {
    let free = |p: &DVec3| chosen.iter().all(|one| one.depth_of(*p) > 1.0);
    let step = points.len().div_ceil(SAMPLES).max(1);
    let left: Vec<DVec3> = points.iter().step_by(step).copied().filter(free).collect();
    let (low, high) = points.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
    let reach = NEAR * (high - low).max_element();
    let around = |p: &DVec3| left.iter().filter(|q| q.distance(*p) < reach).copied().collect::<Vec<_>>();
    // Few leaves are not worth a primitive.
    let least = points.len() / step / 40;
    let groups = left.iter().map(around).filter(|group| group.len() > least.max(1));
    let group = groups.reduce(|best, next| if next.len() > best.len() { next } else { best })?;
    let center = group.iter().sum::<DVec3>() / group.len() as f64;
    Some(Primitive { shape: Shape::Ellipsoid, center, half: DVec3::splat(reach.max(1e-3)) })
}

impl Sight {
    /// IoU with a primitive of what lies below a height.
    pub fn agreement_below(&self, one: &Primitive, height_m: f64) -> f64 {
        let width = self.mask.width() as usize;
        let (mut both, mut either) = (0usize, 0usize);
        for (i, (&inside, covered)) in self.mask.as_raw().iter().zip(self.covered(one)).enumerate() {
            if self.origin.y - ((i / width) as f64 + 0.5) * self.cell_m < height_m {
                both += usize::from(inside != 0 && covered);
                either += usize::from(inside != 0 || covered);
            }
        }
        both as f64 / either.max(1) as f64
    }
}
