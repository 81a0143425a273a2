//! Texture matching (She §3.2, fig. 12): the block of the exemplar whose borders agree best with what the neighbours show.
//!
//! Compared are texels along all shared edges, one step inside and one outside each. Candidates are a grid of places times three
//! rotations about upright, refined round the best; foliage hangs, so a block never turns far.

use glam::{Affine2, Mat2, Vec2, Vec4};

use super::flat::Flat;
use crate::raster::{ALPHA_CUTOFF, Layer};

/// Places tried per rotation before refinement; more finds little better and costs time.
const PLACES: usize = 300;
/// Rotations tried about the upright one, radians.
const TURNS: [f32; 3] = [0.0, -0.14, 0.14];
/// Side of the cells in which use of the exemplar is counted, texels.
const CELL: usize = 6;

/// What the step from foliage to sky weighs against steps of colour (0..=255): as much as a dark leaf beside a bright one.
pub(super) const ALPHA: f32 = 80.0;

/// Something a neighbour shows at a place of this polygon's plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Where, metres in the polygon's plane.
    pub at: Vec2,
    /// What: encoded sRGB 0..=255 and alpha × [`ALPHA`], in the exemplar's brightness.
    pub shown: Vec4,
}

/// The linear part that turns a polygon's plane (y up, metres) into the exemplar (y down, texels), `up` upright and `turn` from there.
pub(super) fn upright(up: Vec2, turn: f32, texels_per_m: f32) -> Mat2 {
    let up = Vec2::from_angle(turn).rotate(up);
    // `up` goes to (0, −1) and what lies right of it to (1, 0).
    texels_per_m * Mat2::from_cols(Vec2::new(up.y, -up.x), Vec2::new(-up.x, -up.y))
}

/// The exemplar, padded by its own reflection so that no candidate needs a border check, and how often its cells were used.
pub(super) struct Matcher {
    padded: Vec<Vec4>,
    stride: usize,
    pad: usize,
    side: [usize; 2],
    used: Vec<f32>,
    cells: [usize; 2],
    total: f32,
    /// What one use of a cell adds to the cost factor of its places.
    wear: f32,
    gaps: Gaps,
}

/// Keeps the gaps at their share: a border that happens to fit well must neither breed nor starve them.
struct Gaps {
    /// The part of the surroundings of each exemplar texel that is transparent.
    around: Vec<f32>,
    /// The share aimed at, and the area and gap area placed so far.
    target: f32,
    placed: [f32; 2],
    /// The share the next block should have.
    wanted: f32,
}

impl Gaps {
    /// Sets the share that brings the whole back to the target.
    fn aim(&mut self) {
        let so_far = if self.placed[0] > 0.0 { self.placed[1] / self.placed[0] } else { self.target };
        self.wanted = (self.target + 4.0 * (self.target - so_far)).clamp(0.0, 1.0);
    }
}

impl Matcher {
    /// `reach` is the largest distance of a sample from its polygon's middle, texels; `gap_share` the part of the surface to be gaps.
    pub(super) fn new(exemplar: &Layer, reach: f32, gap_share: f32) -> Self {
        let side = [exemplar.width, exemplar.height];
        let pad = (reach.ceil() as usize).min(side[0].max(side[1])) + 4;
        let stride = side[0] + 2 * pad;
        let padded = Layer::from_fn(stride, side[1] + 2 * pad, |x, y| {
            let t = exemplar.mirrored(x as i64 - pad as i64, y as i64 - pad as i64);
            t.truncate().extend(ALPHA * t.w)
        });
        let cells = side.map(|s| s.div_ceil(CELL));
        let holes = exemplar.texels.iter().map(|t| Vec4::new(f32::from(t.w < ALPHA_CUTOFF), 0.0, 0.0, 1.0)).collect();
        let holes = Layer { texels: holes, ..*exemplar }.low_pass((0.3 * reach).clamp(1.0, 64.0) as usize);
        let around: Vec<f32> = holes.texels.iter().map(|t| t.x / t.w.max(1e-6)).collect();
        // No more than the exemplar could give at best.
        let target = gap_share.min(around.iter().copied().fold(0.0, f32::max));
        let gaps = Gaps { around, target, placed: [0.0; 2], wanted: target };
        Self { padded: padded.texels, stride, pad, side, used: vec![0.0; cells[0] * cells[1]], cells, total: 0.0, wear: 0.25, gaps }
    }

    /// Notes that a block was taken from round `center`, so that the next one is rather taken elsewhere.
    pub(super) fn note(&mut self, center: Vec2, area: f32) {
        self.gaps.placed[0] += area;
        self.gaps.placed[1] += area * self.gaps.around[self.texel(center.x as i64, center.y as i64)];
        let cell = self.cell(center.x as i64, center.y as i64);
        self.used[cell] += 1.0;
        self.total += 1.0;
        let cells = self.used.len() as f32;
        self.wear = 0.25 * cells / (self.total + cells);
        self.gaps.aim();
    }

    /// What a place's cost is multiplied with: more where the exemplar was used often, and where the share of gaps is not the wanted one.
    fn worn(&self, x: i64, y: i64) -> f32 {
        1.0 + self.wear * self.used[self.cell(x, y)] + 4.0 * (self.gaps.around[self.texel(x, y)] - self.gaps.wanted).abs()
    }

    fn texel(&self, x: i64, y: i64) -> usize {
        let at = |v: i64, axis: usize| (v.max(0) as usize).min(self.side[axis] - 1);
        at(y, 1) * self.side[0] + at(x, 0)
    }

    fn cell(&self, x: i64, y: i64) -> usize {
        let at = |v: i64, axis: usize| ((v.max(0) as usize) / CELL).min(self.cells[axis] - 1);
        at(y, 1) * self.cells[0] + at(x, 0)
    }

    /// Where the middle of a block may lie so that its corners stay inside the exemplar: inclusive texel ranges of x and y.
    pub(super) fn places(&self, flat: &Flat, linear: Mat2) -> [(i64, i64); 2] {
        let middle = flat.middle();
        let reach = flat.corners().iter().map(|&c| (linear * (c - middle)).abs()).fold(Vec2::ZERO, Vec2::max);
        std::array::from_fn(|axis| {
            let (side, reach) = (self.side[axis] as i64, reach[axis].ceil().min(1e6) as i64 + 1);
            if 2 * reach < side { (reach, side - 1 - reach) } else { (side / 2, side / 2) }
        })
    }

    /// The map from the polygon's plane into the exemplar that agrees best with `samples`; `base` is the upright linear part's `up`.
    pub(super) fn best(&self, flat: &Flat, samples: &[Sample], up: Vec2, jitter: f32, texels_per_m: f32) -> (Affine2, f32) {
        let middle = flat.middle();
        let mut best = (f32::INFINITY, Mat2::IDENTITY, (0i64, 0i64));
        for turn in TURNS {
            let linear = upright(up, turn + jitter, texels_per_m);
            let Some(probes) = self.probes(samples, middle, linear) else { continue };
            let [xs, ys] = self.places(flat, linear);
            let step = ((((xs.1 - xs.0 + 1) * (ys.1 - ys.0 + 1)) as f32 / PLACES as f32).sqrt().ceil() as i64).max(1);
            let try_at = |x: i64, y: i64, best: &mut (f32, Mat2, (i64, i64))| {
                let worn = self.worn(x, y);
                let cost = worn * self.cost(&probes, x, y, best.0 / worn);
                if cost < best.0 {
                    *best = (cost, linear, (x, y));
                }
            };
            let before = best.0;
            for y in (ys.0..=ys.1).step_by(step as usize) {
                for x in (xs.0..=xs.1).step_by(step as usize) {
                    try_at(x, y, &mut best);
                }
            }
            if best.0 < before && step > 1 {
                let (cx, cy) = best.2;
                for y in (cy - step + 1).max(ys.0)..=(cy + step - 1).min(ys.1) {
                    for x in (cx - step + 1).max(xs.0)..=(cx + step - 1).min(xs.1) {
                        try_at(x, y, &mut best);
                    }
                }
            }
        }
        if best.0.is_infinite() {
            let linear = upright(up, jitter, texels_per_m);
            let [xs, ys] = self.places(flat, linear);
            best = (best.0, linear, ((xs.0 + xs.1) / 2, (ys.0 + ys.1) / 2));
        }
        let center = Vec2::new(best.2.0 as f32 + 0.5, best.2.1 as f32 + 0.5);
        (Affine2::from_mat2_translation(best.1, center - best.1 * middle), best.0)
    }

    /// Cost of a map found otherwise, comparable with [`Matcher::best`]'s.
    pub(super) fn cost_of(&self, flat: &Flat, samples: &[Sample], map: Affine2) -> f32 {
        let middle = flat.middle();
        let center = map.transform_point2(middle).floor();
        match self.probes(samples, middle, map.matrix2) {
            Some(probes) => {
                let (x, y) = (center.x as i64, center.y as i64);
                self.worn(x, y) * self.cost(&probes, x, y, f32::INFINITY)
            }
            None => f32::INFINITY,
        }
    }

    /// Index offsets from the block's middle, and what should be there; `None` when the block is too large for the padding.
    fn probes(&self, samples: &[Sample], middle: Vec2, linear: Mat2) -> Option<Vec<(isize, Vec4)>> {
        samples
            .iter()
            .map(|s| {
                let o = (linear * (s.at - middle)).round();
                let fits = o.abs().max_element() < self.pad as f32;
                fits.then(|| (o.y as isize * self.stride as isize + o.x as isize, s.shown))
            })
            .collect()
    }

    fn cost(&self, probes: &[(isize, Vec4)], x: i64, y: i64, limit: f32) -> f32 {
        let inside = |v: i64, axis: usize| v.clamp(0, self.side[axis] as i64 - 1) as usize + self.pad;
        let center = (inside(y, 1) * self.stride + inside(x, 0)) as isize;
        let mut squares = Vec4::ZERO;
        for chunk in probes.chunks(8) {
            for &(offset, shown) in chunk {
                let difference = self.padded[(center + offset) as usize] - shown;
                squares += difference * difference;
            }
            if squares.element_sum() >= limit {
                break;
            }
        }
        squares.element_sum()
    }
}
