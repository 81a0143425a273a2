//! The ellipse that holds most evidence: the plainest crown, and a gentle prior for the real one (She fig. 4a starts from a sphere).

use rayon::prelude::*;

use super::small::{Plane, Small};

/// An upright ellipse in reduced pixels: centre and half axes.
#[derive(Debug, Clone, Copy)]
pub struct Ellipse {
    /// Centre column.
    pub x: f32,
    /// Centre row.
    pub y: f32,
    /// Half axes, horizontal and vertical.
    pub half: (f32, f32),
}

/// Shortest half axis considered, reduced pixels.
const SMALLEST_PX: f32 = 5.0;

impl Ellipse {
    /// Climbs from a grid of places and sizes to the largest sum of evidence inside.
    pub fn fit(small: &Small, evidence: &[f32]) -> Self {
        let sums = Sums::new(small, evidence);
        let (w, h) = (small.width as f32, small.height as f32);
        let mut starts = Vec::new();
        for x in [0.35, 0.5, 0.65] {
            for y in [0.35, 0.5] {
                for a in [0.2, 0.35, 0.5] {
                    for b in [0.2, 0.35] {
                        starts.push(Self { x: x * w, y: y * h, half: (a * w, b * h) });
                    }
                }
            }
        }
        let climbed: Vec<(f32, Self)> = starts.into_par_iter().map(|s| s.climb(&sums, 0.08 * w, 0.08 * h)).collect();
        climbed.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("the grid of starts is not empty").1
    }

    /// Distance from the centre, 1 on the ellipse.
    pub fn level(&self, x: f32, y: f32) -> f32 {
        ((x - self.x) / self.half.0).hypot((y - self.y) / self.half.1)
    }

    /// Moves and stretches by halving steps while the sum grows.
    fn climb(mut self, sums: &Sums, mut dx: f32, mut dy: f32) -> (f32, Self) {
        let mut best = sums.inside(&self);
        while dx.max(dy) > 0.5 {
            let mut grew = false;
            for (x, y, a, b) in [(dx, 0.0, 0.0, 0.0), (0.0, dy, 0.0, 0.0), (0.0, 0.0, dx, 0.0), (0.0, 0.0, 0.0, dy)] {
                for sign in [1.0, -1.0] {
                    let half = ((self.half.0 + sign * a).max(SMALLEST_PX), (self.half.1 + sign * b).max(SMALLEST_PX));
                    let other = Self { x: self.x + sign * x, y: self.y + sign * y, half };
                    let sum = sums.inside(&other);
                    if sum > best {
                        (self, best, grew) = (other, sum, true);
                    }
                }
            }
            if !grew {
                (dx, dy) = (dx / 2.0, dy / 2.0);
            }
        }
        (best, self)
    }
}

/// Running sums along rows.
struct Sums {
    width: usize,
    height: usize,
    rows: Plane,
}

impl Sums {
    fn new(small: &Small, evidence: &[f32]) -> Self {
        let mut rows = Vec::with_capacity((small.width + 1) * small.height);
        for row in evidence.chunks(small.width) {
            let mut sum = 0.0;
            rows.push(0.0);
            rows.extend(row.iter().map(|v| {
                sum += v;
                sum
            }));
        }
        Self { width: small.width, height: small.height, rows }
    }

    fn inside(&self, e: &Ellipse) -> f32 {
        let mut total = 0.0;
        for y in 0..self.height {
            let up = (y as f32 + 0.5 - e.y) / e.half.1;
            if up.abs() < 1.0 {
                let reach = e.half.0 * (1.0 - up * up).sqrt();
                let column = |v: f32| (v.round().max(0.0) as usize).min(self.width);
                let row = &self.rows[y * (self.width + 1)..(y + 1) * (self.width + 1)];
                total += row[column(e.x + reach)] - row[column(e.x - reach)];
            }
        }
        total
    }
}
