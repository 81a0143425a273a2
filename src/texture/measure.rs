//! How visible seams are and how much grain is left: mean colour steps between neighbouring texels (the figures issue 2 asks for).

use glam::Vec4;

use crate::raster::Layer;

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

/// Mean colour steps, in encoded sRGB units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// Across polygon borders before blending.
    pub border_before: f64,
    /// Across polygon borders and cuts after it.
    pub border_after: f64,
    /// Inside blocks, away from borders and cuts.
    pub inside: f64,
}

#[derive(Default)]
struct Mean(f64, usize);

impl Mean {
    fn add(&mut self, a: Vec4, b: Vec4) {
        // A step into a hole is not a step of colour.
        if a.w >= 0.5 && b.w >= 0.5 {
            self.0 += f64::from((a - b).truncate().length());
            self.1 += 1;
        }
    }

    fn value(&self) -> f64 {
        if self.1 > 0 { self.0 / self.1 as f64 } else { 0.0 }
    }
}

/// Mean step between the exemplar's neighbouring texels, or between places `spacing` texels apart where the atlas is much finer or
/// coarser than the exemplar; at least a thousandth, so that ratios exist.
pub(super) fn exemplar_step(layer: &Layer, spacing: f32) -> f64 {
    let spacing = if (0.8..1.25).contains(&spacing) { 1.0 } else { spacing.clamp(0.01, layer.width as f32) };
    let mut mean = Mean::default();
    for (i, &t) in layer.texels.iter().enumerate() {
        let (x, y) = ((i % layer.width) as f32 + 0.5, (i / layer.width) as f32 + 0.5);
        for (x, y) in [(x + spacing, y), (x, y + spacing)] {
            if x < layer.width as f32 && y < layer.height as f32 {
                mean.add(t, layer.sharp(x, y));
            }
        }
    }
    mean.value().max(1e-3)
}

/// The steps of a finished atlas of `size` × `size` texels.
pub(super) fn steps(shaded: &[Option<Shaded>], size: usize) -> Steps {
    let (mut before, mut after, mut inside) = (Mean::default(), Mean::default(), Mean::default());
    for (i, s) in shaded.iter().enumerate() {
        let right = if (i + 1) % size != 0 { shaded.get(i + 1) } else { None };
        for t in [right, shaded.get(i + size)].into_iter().flatten() {
            let (Some(s), Some(t)) = (s, t) else { continue };
            if s.polygon != t.polygon {
                before.add(s.own, t.own);
            }
            if s.polygon != t.polygon || s.label != t.label {
                after.add(s.color, t.color);
            } else if s.pure && t.pure {
                inside.add(s.color, t.color);
            }
        }
    }
    Steps { border_before: before.value(), border_after: after.value(), inside: inside.value() }
}
