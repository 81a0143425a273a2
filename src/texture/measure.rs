//! How visible seams are and how much grain is left: mean colour steps between neighbouring texels.
//!
//! Ours (She §3.2 only asks that seams be "eliminated"). Like is measured with like: texels grown from the exemplar against the exemplar,
//! texels of the photograph against the photograph at the atlas's density.

use glam::Vec4;

use crate::raster::{ALPHA_CUTOFF, Layer};

/// One covered texel of the atlas.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shaded {
    /// The polygon it lies on.
    pub polygon: u32,
    /// The polygon whose block it shows most of.
    pub label: u32,
    /// Whether it shows one block only.
    pub pure: bool,
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
    /// Inside blocks after it, away from borders and cuts.
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
fn step(a: Vec4, b: Vec4) -> Option<f64> {
    (a.w >= ALPHA_CUTOFF && b.w >= ALPHA_CUTOFF).then(|| f64::from((a - b).truncate().length()))
}

/// Mean step between a picture's neighbouring texels, or between places `spacing` texels apart where the atlas is much finer or
/// coarser than the picture; at least a thousandth, so that ratios exist.
pub(super) fn mean_step(layer: &Layer, spacing: f32) -> f64 {
    let spacing = if (0.8..1.25).contains(&spacing) { 1.0 } else { spacing.clamp(0.01, layer.width as f32) };
    let (mut sum, mut count) = (0.0, 0);
    for (i, &t) in layer.texels.iter().enumerate().filter(|t| t.1.w >= ALPHA_CUTOFF) {
        let (x, y) = ((i % layer.width) as f32 + 0.5, (i / layer.width) as f32 + 0.5);
        for (x, y) in [(x + spacing, y), (x, y + spacing)] {
            if x < layer.width as f32
                && y < layer.height as f32
                && let Some(step) = step(t, layer.sharp(x, y))
            {
                sum += step;
                count += 1;
            }
        }
    }
    (sum / f64::from(count.max(1))).max(1e-3)
}

/// The steps of a finished atlas of `size` × `size` texels; `expected(polygon)` is the mean step of the picture that its block is from.
pub(super) fn steps(shaded: &[Option<Shaded>], size: usize, expected: impl Fn(u32) -> f64) -> Steps {
    let [mut border_before, mut border_after, mut inside_before, mut inside_after]: [Ratio; 4] = Default::default();
    let both = |a: u32, b: u32| 0.5 * (expected(a) + expected(b));
    for (i, s) in shaded.iter().enumerate() {
        let right = if (i + 1) % size != 0 { shaded.get(i + 1) } else { None };
        for t in [right, shaded.get(i + size)].into_iter().flatten() {
            let (Some(s), Some(t)) = (s, t) else { continue };
            let before = if s.polygon == t.polygon { &mut inside_before } else { &mut border_before };
            before.add(s.own, t.own, both(s.polygon, t.polygon));
            if s.polygon != t.polygon || s.label != t.label {
                border_after.add(s.color, t.color, both(s.label, t.label));
            } else if s.pure && t.pure {
                inside_after.add(s.color, t.color, expected(s.label));
            }
        }
    }
    Steps {
        border_before: border_before.value(),
        border_after: border_after.value(),
        inside_before: inside_before.value(),
        inside_after: inside_after.value(),
    }
}
