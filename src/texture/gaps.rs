//! Gap fraction becomes alpha: as much sky shows through the grown texture as through the crown in the photograph.
//!
//! Ours (She's crowns have no holes). Where the photograph itself is the texture, its gaps are where they were. The exemplar is chosen for
//! its foliage and has fewer, so that the grown part is opened where its foliage is darkest against its surroundings: there one looks
//! deepest into the crown, and leaves keep their edges.

use glam::Vec4;

use super::measure::Shaded;
use crate::raster::{ALPHA_CUTOFF, Layer};

/// Radii of the low-passes whose difference tells how dark a place is against its surroundings, texels: gaps are blobs of the smaller size.
const BLOB: usize = 1;
const SURROUNDINGS: usize = 40;

/// The part of the covered texels that are gaps.
pub(super) fn share(shaded: &[Option<Shaded>]) -> f64 {
    let open = shaded.iter().flatten().filter(|s| s.color.w < ALPHA_CUTOFF).count();
    open as f64 / shaded.iter().flatten().count().max(1) as f64
}

/// Scales alpha so that blending does not change how much the alpha test removes.
pub(super) fn keep_share(shaded: &mut [Option<Shaded>]) {
    let open = shaded.iter().flatten().filter(|s| s.own.w < ALPHA_CUTOFF).count();
    if open == 0 {
        return;
    }
    let mut alphas: Vec<f32> = shaded.iter().flatten().map(|s| s.color.w).collect();
    let last = alphas.len() - 1;
    let (_, &mut threshold, _) = alphas.select_nth_unstable_by(open.min(last), f32::total_cmp);
    let scale = ALPHA_CUTOFF / threshold.clamp(0.1, 0.9);
    shaded.iter_mut().flatten().for_each(|s| s.color.w = (s.color.w * scale).clamp(0.0, 1.0));
}

/// Opens gaps in an atlas of `size` texels a side until they are the part `target` of those texels for which `grown` holds.
pub(super) fn open(shaded: &mut [Option<Shaded>], size: usize, grown: impl Fn(&Shaded) -> bool, target: f64) {
    let candidates =
        || (0..shaded.len()).filter_map(|i| shaded[i].as_ref().filter(|s| grown(s)).map(|s| (i, s.color.w < ALPHA_CUTOFF)));
    let wanted = (target * candidates().count() as f64).round() as usize;
    let missing = wanted.saturating_sub(candidates().filter(|c| c.1).count());
    let mut closed: Vec<usize> = if missing == 0 { Vec::new() } else { candidates().filter(|c| !c.1).map(|c| c.0).collect() };
    if closed.is_empty() || size == 0 {
        return;
    }
    let brightness = Layer::from_fn(size, shaded.len() / size, |x, y| {
        let s = shaded[y * size + x].as_ref();
        s.map_or(Vec4::ZERO, |s| Vec4::new(s.color.x + 2.0 * s.color.y + s.color.z, 0.0, 0.0, 1.0))
    });
    let (near, far) = (brightness.low_pass(BLOB), brightness.low_pass(SURROUNDINGS));
    let mean = |layer: &Layer, i: usize| layer.texels[i].x / layer.texels[i].w.max(1e-3);
    let darkness = |i: usize| mean(&far, i) - mean(&near, i);
    // Ties go to the lower index, so that the choice depends on nothing but the texels.
    let order = |a: &usize, b: &usize| darkness(*b).total_cmp(&darkness(*a)).then(a.cmp(b));
    let last = missing.min(closed.len()) - 1;
    closed.select_nth_unstable_by(last, order);
    for &i in &closed[..=last] {
        if let Some(s) = &mut shaded[i] {
            s.color.w = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 64;

    /// Stripes of dark and bright foliage; the left half is the photograph's.
    fn stripes() -> Vec<Option<Shaded>> {
        let texel = |i: usize| {
            let color = Vec4::new(40.0, if i / SIZE % 16 < 4 { 30.0 } else { 120.0 }, 20.0, 1.0);
            Shaded { polygon: 0, label: u32::from(i % SIZE >= SIZE / 2), own: color, color, ..Shaded::default() }
        };
        (0..SIZE * SIZE).map(|i| Some(texel(i))).collect()
    }

    #[test]
    fn the_grown_part_opens_in_the_dark_and_the_photograph_stays() {
        let mut shaded = stripes();
        open(&mut shaded, SIZE, |s| s.label == 1, 0.1);
        let opened: Vec<&Shaded> = shaded.iter().flatten().filter(|s| s.color.w < ALPHA_CUTOFF).collect();
        assert_eq!(opened.len(), (0.1 * (SIZE * SIZE / 2) as f64).round() as usize);
        assert!(opened.iter().all(|s| s.label == 1 && s.color.y < 50.0));
        assert!((share(&shaded) - 0.05).abs() < 1e-3);
    }

    #[test]
    fn gaps_that_are_there_already_count() {
        let mut shaded = stripes();
        shaded.iter_mut().flatten().filter(|s| s.label == 1).step_by(5).for_each(|s| s.color.w = 0.0);
        let before = share(&shaded);
        open(&mut shaded, SIZE, |s| s.label == 1, 0.1);
        assert_eq!(share(&shaded), before);
        open(&mut [], 0, |_| true, 0.5);
    }
}
