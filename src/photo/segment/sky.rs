//! The sky: grown from the picture's upper border over smooth, not green, not dark colours; then its colours, wherever they show.

use std::collections::VecDeque;

use super::small::{Plane, Small, lab};

/// What is sky in a reduced photograph.
pub struct Sky {
    /// Pixels that a smooth path joins to the upper border.
    pub grown: Vec<bool>,
    /// Likeness to the colours of the grown sky, 0..1: includes gaps inside crowns.
    pub likeness: Plane,
    /// Likeness of any colour to the sky's, on a grid of L*a*b*; empty when there is no sky.
    density: Vec<f32>,
}

impl Sky {
    /// Grows the sky; both planes are empty of sky when the upper border shows none.
    pub fn new(small: &Small) -> Self {
        let lightness: Plane = small.lab.iter().map(|c| c[0]).collect();
        let roughness = small.deviation(&lightness, 1);
        let grown = grow(small, &roughness);
        let mut sky = Self { density: density(small, &grown), grown, likeness: Plane::new() };
        sky.likeness = small.lab.iter().map(|&c| sky.like(c)).collect();
        sky
    }

    /// Likeness of a L*a*b* colour to the sky's, 0..1.
    pub fn like(&self, lab: [f32; 3]) -> f32 {
        let (l, a, b) = cell(lab);
        self.density.get((l * BINS + a) * BINS + b).map_or(0.0, |d| d / (d + 0.004))
    }

    /// The [`colour_table`] of the sky.
    pub fn colours(&self) -> Vec<bool> {
        colour_table(|lab| self.like(lab) > 0.5)
    }
}

/// For each sRGB colour of five bits a channel, what `is` says of its L*a*b*: index r·1024 + g·32 + b.
pub fn colour_table(is: impl Fn([f32; 3]) -> bool) -> Vec<bool> {
    let channel = |i: usize, shift: usize| ((i >> shift & 31) * 8 + 4) as f32;
    (0..1 << 15).map(|i| is(lab([channel(i, 10), channel(i, 5), channel(i, 0)]))).collect()
}

/// Whether a colour can be sky at all: not leaf green or earth (yellow and not bright), not dark.
fn possible([l, a, b]: [f32; 3]) -> bool {
    let blue = b < 2.0 && a < 25.0;
    l > 30.0 && (blue || l > 60.0 && b < 14.0 && a > -10.0 || l > 82.0 && b < 25.0 && a > -8.0)
}

fn grow(small: &Small, roughness: &[f32]) -> Vec<bool> {
    let (w, h) = (small.width, small.height);
    let mut grown = vec![false; small.count()];
    let mut queue: VecDeque<usize> = VecDeque::new();
    for i in 0..w * (h / 12).max(1) {
        if possible(small.lab[i]) && roughness[i] < 4.0 {
            grown[i] = true;
            queue.push_back(i);
        }
    }
    while let Some(i) = queue.pop_front() {
        let (x, y) = (i % w, i / w);
        let steps = [(x > 0, i.wrapping_sub(1)), (x + 1 < w, i + 1), (y > 0, i.wrapping_sub(w)), (y + 1 < h, i + w)];
        for (_, j) in steps.into_iter().filter(|s| s.0) {
            let step: f32 = (0..3).map(|c| (small.lab[i][c] - small.lab[j][c]).powi(2)).sum();
            if !grown[j] && possible(small.lab[j]) && step < 36.0 && roughness[j] < 9.0 {
                grown[j] = true;
                queue.push_back(j);
            }
        }
    }
    grown
}

/// Cells of the colour grid along each axis.
const BINS: usize = 24;

fn cell([l, a, b]: [f32; 3]) -> (usize, usize, usize) {
    let bin = |v: f32, low: f32, high: f32| (((v - low) / (high - low) * BINS as f32) as usize).min(BINS - 1);
    (bin(l, 0.0, 100.0), bin(a, -60.0, 60.0), bin(b, -60.0, 60.0))
}

/// The share of the grown sky in and around each cell of colour space.
fn density(small: &Small, grown: &[bool]) -> Vec<f32> {
    let total = grown.iter().filter(|&&g| g).count() as f32;
    if total < 0.004 * small.count() as f32 {
        return Vec::new();
    }
    let mut density = vec![0.0f32; BINS * BINS * BINS];
    for (c, _) in small.lab.iter().zip(grown).filter(|(_, g)| **g) {
        let (l, a, b) = cell(*c);
        // A tent of three cells a side: colours between the seen ones are sky too.
        for (dl, da, db) in (0..27).map(|i| (i / 9, i / 3 % 3, i % 3)) {
            let (Some(l), Some(a), Some(b)) = ((l + dl).checked_sub(1), (a + da).checked_sub(1), (b + db).checked_sub(1)) else {
                continue;
            };
            if l < BINS && a < BINS && b < BINS {
                const TENT: [f32; 3] = [0.5, 1.0, 0.5];
                density[(l * BINS + a) * BINS + b] += TENT[dl] * TENT[da] * TENT[db] / total;
            }
        }
    }
    density
}
