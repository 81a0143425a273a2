//! How visible seams are and how much grain is left: mean colour steps between neighbouring texels.
//!
//! Ours (She §3.2 only asks that seams be "eliminated"). Like is measured with like: texels grown from the exemplar against the exemplar,
//! texels of the photograph against the photograph at the atlas's density.

use glam::{Vec2, Vec4};
use rayon::prelude::*;

use crate::raster::ALPHA_CUTOFF;

/// One covered texel of the atlas.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shaded {
    /// The polygon it lies on.
    pub polygon: u32,
    /// The polygon whose block it shows most of.
    pub label: u32,
    /// Metres on the surface to the next texel along x and y.
    pub surface_m: Vec2,
    /// The same as the photographer saw it.
    pub seen_m: Vec2,
    /// Its own polygon's block alone: encoded sRGB 0..=255, alpha 0..=1.
    pub own: Vec4,
    /// What it shows.
    pub color: Vec4,
}

/// Mean colour steps in the atlas ÷ the mean steps in the pictures that the texels were taken from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// Across polygon borders before blending.
    pub border_before: f64,
    /// Across polygon borders and cuts after it.
    pub border_after: f64,
    /// Inside polygons before blending.
    pub inside_before: f64,
    /// Everywhere else after it.
    pub inside_after: f64,
}

/// Steps that were found and those that their sources would lead one to expect.
#[derive(Default)]
struct Ratio {
    found: f64,
    expected: f64,
}

impl Ratio {
    fn add(&mut self, a: Vec4, b: Vec4, expected: f64) {
        if let Some(step) = step(a, b) {
            self.found += step;
            self.expected += expected;
        }
    }

    fn value(&self) -> f64 {
        if self.expected > 0.0 { self.found / self.expected } else { 0.0 }
    }
}

/// A step into a hole is not a step of colour.
pub(super) fn step(a: Vec4, b: Vec4) -> Option<f64> {
    (a.w >= ALPHA_CUTOFF && b.w >= ALPHA_CUTOFF).then(|| f64::from((a - b).truncate().length()))
}

/// The steps of a finished atlas of `size` × `size` texels; `expected(texel, polygon, axis)` is the mean step in the picture
/// that the polygon's block is from, between places as far apart as the texel and the next one along x (0) or y (1).
pub(super) fn steps(shaded: &[Option<Shaded>], size: usize, expected: impl Fn(&Shaded, u32, usize) -> f64 + Sync) -> Steps {
    let row = |y: usize| {
        let mut ratios: [Ratio; 4] = Default::default();
        for i in y * size..((y + 1) * size).min(shaded.len()) {
            let right = if (i + 1) % size != 0 { shaded.get(i + 1) } else { None };
            for (axis, t) in [right, shaded.get(i + size)].into_iter().enumerate() {
                let (Some(s), Some(Some(t))) = (&shaded[i], t) else { continue };
                let both = |a: u32, b: u32| 0.5 * (expected(s, a, axis) + expected(t, b, axis));
                let same = s.polygon == t.polygon;
                let before = both(s.polygon, t.polygon);
                ratios[if same { INSIDE } else { BORDER }].add(s.own, t.own, before);
                let alike = (s.label, t.label) == (s.polygon, t.polygon);
                let after = if alike { before } else { both(s.label, t.label) };
                let inside = same && s.label == t.label;
                ratios[2 + if inside { INSIDE } else { BORDER }].add(s.color, t.color, after);
            }
        }
        ratios
    };
    // Added up in order, whatever the number of threads.
    let rows: Vec<[Ratio; 4]> = (0..shaded.len().div_ceil(size.max(1))).into_par_iter().map(row).collect();
    let [border_before, inside_before, border_after, inside_after] = std::array::from_fn(|k| {
        let sum = |part: fn(&Ratio) -> f64| rows.iter().map(|r| part(&r[k])).sum();
        Ratio { found: sum(|r| r.found), expected: sum(|r| r.expected) }.value()
    });
    Steps { border_before, border_after, inside_before, inside_after }
}

/// Where a row keeps its steps across borders and inside polygons, before blending; two further on after it.
const BORDER: usize = 0;
const INSIDE: usize = 1;
