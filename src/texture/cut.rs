//! Minimum-error cuts between the blocks of neighbouring polygons (Efros & Freeman 2001 §2.1, along an edge of the mesh).
//!
//! She §3.2 asks that "the visual seams … must be eliminated". Averaging would blur, so each shared edge becomes the path, in a strip
//! round it, along which the two blocks differ least; the path is pinned at the edge's ends, so paths never cross.

use glam::Vec4;

/// A cut along one edge: how far into the polygon (positive) or beyond the edge (negative) it runs, texels, at even steps.
#[derive(Debug, Clone)]
pub(super) struct Cut {
    /// From the edge's first corner to its second.
    pub depth: Vec<f32>,
}

impl Cut {
    /// The cheapest path through a strip. `difference(column, row)` compares the two blocks at `columns` steps along the edge and rows
    /// −`reach`..=`reach` beside it.
    pub(super) fn cheapest(columns: usize, reach: i32, difference: impl Fn(usize, i32) -> f32) -> Self {
        let rows = (2 * reach + 1) as usize;
        let allowed = |c: usize, r: i32| r.unsigned_abs() as usize <= c.min(columns - 1 - c);
        let mut cost = vec![f32::INFINITY; rows];
        let mut from = vec![0i32; rows * columns];
        for c in 0..columns {
            let mut next = vec![f32::INFINITY; rows];
            for r in (-reach..=reach).filter(|&r| allowed(c, r)) {
                let i = (r + reach) as usize;
                let steps = [0, -1, 1].into_iter().filter(|s| (-reach..=reach).contains(&(r + s)));
                let (best, step) = steps
                    .map(|s| (if c == 0 { 0.0 } else { cost[(r + s + reach) as usize] }, s))
                    .fold((f32::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
                next[i] = best + difference(c, r);
                from[c * rows + i] = step;
            }
            cost = next;
        }
        let mut depth = vec![0.0; columns];
        let mut r = 0i32;
        for c in (0..columns).rev() {
            depth[c] = r as f32;
            r += from[c * rows + (r + reach) as usize];
        }
        Self { depth }
    }

    /// The same cut as the neighbour sees it.
    pub(super) fn reversed(&self) -> Self {
        Self { depth: self.depth.iter().rev().map(|d| -d).collect() }
    }

    /// Depth at a part 0..=1 of the edge.
    pub(super) fn at(&self, part: f32) -> f32 {
        let x = (part * self.depth.len() as f32 - 0.5).clamp(0.0, (self.depth.len() - 1) as f32);
        let i = x as usize;
        let next = self.depth[(i + 1).min(self.depth.len() - 1)];
        self.depth[i] + (x - i as f32) * (next - self.depth[i])
    }
}

/// Blends what several blocks show so that the result varies as much as they do: weights shift the mean linearly, the deviations from it
/// are divided by the spread that averaging would lose (Heitz & Neyret 2018 §3, with the blocks' own correlation).
pub(super) fn blend(parts: &[(f32, Vec4)], mean: Vec4, variance: f32) -> Vec4 {
    let total: f32 = parts.iter().map(|p| p.0).sum();
    let [first, rest @ ..] = parts else { return mean };
    if rest.is_empty() || total <= 0.0 {
        return first.1;
    }
    let (mut sum, mut spread) = (Vec4::ZERO, 0.0);
    for &(w, c) in parts {
        sum += w / total * (c - mean);
        for &(w2, c2) in parts {
            let alike = 1.0 - 0.5 * (c - c2).truncate().length_squared() / variance.max(1.0);
            spread += w / total * w2 / total * alike.clamp(0.0, 1.0);
        }
    }
    let straight = sum + mean;
    let kept = sum / spread.max(0.2).sqrt() + mean;
    kept.truncate().extend(straight.w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_cut_follows_the_valley_and_is_pinned_at_its_ends() {
        let cut = Cut::cheapest(20, 4, |_, r| if r == 3 { 0.0 } else { 1.0 });
        assert_eq!((cut.depth[0], cut.depth[19]), (0.0, 0.0));
        assert!(cut.depth[4..16].iter().all(|&d| d == 3.0), "{:?}", cut.depth);
        assert!(cut.depth.windows(2).all(|w| (w[0] - w[1]).abs() <= 1.0));
        assert_eq!(cut.reversed().depth[6], -3.0);
    }

    #[test]
    fn short_edges_are_cut_straight() {
        for columns in 1..3 {
            assert!(Cut::cheapest(columns, 4, |_, _| 1.0).depth.iter().all(|&d| d == 0.0));
        }
    }

    #[test]
    fn blending_keeps_variance_of_unlike_parts_and_leaves_like_parts_alone() {
        let mean = Vec4::splat(100.0);
        let (a, b) = (Vec3::new(110.0, 100.0, 100.0).extend(1.0), Vec3::new(100.0, 110.0, 100.0).extend(1.0));
        let unlike = blend(&[(0.5, a), (0.5, b)], mean, 100.0);
        assert!((unlike.x - (100.0 + 5.0 * 2f32.sqrt())).abs() < 1e-3);
        assert!((blend(&[(0.5, a), (0.5, a)], mean, 100.0) - a).length() < 1e-4);
        assert_eq!(blend(&[(1.0, a)], mean, 100.0), a);
    }
}
