//! From evidence per pixel to one crown: what both looks say, a gentle ellipse, one connected region without holes.

use super::bits::Bits;
use super::ellipse::Ellipse;
use super::features::Scene;
use super::small::{Plane, Small};

/// Log-odds beyond this count as this much: no single pixel decides.
const SURE: f32 = 4.0;
/// Share of the first look in the evidence. The second sees more and errs more boldly.
const FIRST_SHARE: f32 = 0.5;

/// The crown in the reduced photograph, from the looks' log-odds.
pub fn crown(scene: &Scene, looks: &[Vec<f32>]) -> Vec<bool> {
    let small = &scene.small;
    let evidence: Plane =
        looks[0].iter().zip(&looks[1]).map(|(a, b)| FIRST_SHARE * soft(*a) + (1.0 - FIRST_SHARE) * soft(*b)).collect();
    let ellipse = Ellipse::fit(small, &evidence.iter().map(|v| v.clamp(-2.0, 2.0)).collect::<Plane>());
    let smooth = small.mean(&evidence, 1);
    let shaped: Plane = smooth
        .iter()
        .enumerate()
        .map(|(i, v)| {
            let level = ellipse.level((i % small.width) as f32 + 0.5, (i / small.width) as f32 + 0.5);
            v + (2.0 * (1.0 - level)).clamp(-2.0, 1.0)
        })
        .collect();
    one_region(small, &shaped.iter().map(|v| *v > 0.0).collect::<Vec<_>>())
}

/// Log-odds within limits; certainties (hints) stay.
fn soft(v: f32) -> f32 {
    if v.abs() > 10.0 { v } else { v.clamp(-SURE, SURE) }
}

/// The largest connected part, holes filled.
fn one_region(small: &Small, set: &[bool]) -> Vec<bool> {
    let bits = Bits::from_rows(small.width, small.height, |y, row| {
        for (x, _) in set[y * small.width..(y + 1) * small.width].iter().enumerate().filter(|(_, s)| **s) {
            row[x / 64] |= 1 << (x % 64);
        }
    });
    bits.largest_component().fill_holes().to_mask().as_raw().iter().map(|&v| v != 0).collect()
}
