//! The crown row by row, as the first look believes it: where it is widest, how far below its top and its widest row each row lies,
//! and whether a trunk shows. These tell the crown's base from a hedge behind it.

use super::small::{Plane, Small};
use super::trunk::ridge;

/// Numbers per row.
pub const PROFILE: usize = 6;

/// Describes every row for the crown whose axis stands at `axis` and whose half width is `half_width`, in reduced pixels.
pub fn profile(small: &Small, belief: &[f32], axis: f32, half_width: f32) -> Vec<[f32; PROFILE]> {
    let (w, h) = (small.width, small.height);
    let reach =
        |f: f32| (((axis - f * half_width).max(0.0)) as usize).min(w - 1)..((axis + f * half_width) as usize + 1).clamp(1, w);
    let count = |y: usize, columns: std::ops::Range<usize>| columns.filter(|x| belief[y * w + x] > 0.5).count() as f32;
    let widths = smooth(&(0..h).map(|y| count(y, reach(1.6))).collect::<Vec<_>>(), 3);
    let margin = (w / 16).max(1);
    let aside =
        smooth(&(0..h).map(|y| (count(y, 0..margin) + count(y, w - margin..w)) / (2 * margin) as f32).collect::<Vec<_>>(), 3);
    let trunk = trunks(small, reach(0.35));
    let (mut top, mut widest, mut most, mut seen) = (None, 0, 1.0f32, 0.0f32);
    (0..h)
        .map(|y| {
            if widths[y] > 4.0 && top.is_none() {
                top = Some(y);
            }
            if widths[y] > most {
                (most, widest) = (widths[y], y);
            }
            let below = |from: usize| ((y - from.min(y)) as f32 / most).min(4.0);
            let top = top.unwrap_or(y);
            // A trunk also shows through the crown; only what follows the widest row speaks of its base.
            seen = if widest == y { 0.0 } else { seen.max(trunk[y]) };
            [below(top) - 1.0, 2.0 * below(widest) - 0.5, 2.0 * widths[y] / most - 1.0, 2.0 * aside[y] - 0.5, trunk[y], seen]
        })
        .collect()
}

/// How clearly a narrow upright column stands out in each row near the axis, 0 nothing, 1 a colour difference of 20.
fn trunks(small: &Small, columns: std::ops::Range<usize>) -> Vec<f32> {
    let mut clearest = vec![0.0f32; small.height];
    for half in [1, 2, 4] {
        for x in columns.clone() {
            let along: Vec<f32> = (0..small.height).map(|y| ridge(small, x, y, half)).collect();
            clearest.iter_mut().zip(smooth(&along, 5)).for_each(|(c, v)| *c = c.max(v / 20.0));
        }
    }
    clearest
}

/// Means over 2 `radius` + 1 neighbours.
fn smooth(values: &[f32], radius: usize) -> Plane {
    let n = values.len();
    let window = |i: usize| &values[i.saturating_sub(radius)..(i + radius + 1).min(n)];
    (0..n).map(|i| window(i).iter().sum::<f32>() / window(i).len() as f32).collect()
}
