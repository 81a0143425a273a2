//! The default method: what the picture itself says about foliage, sky, ground and place, gathered in two looks, then one shape.

use super::features::Scene;
use super::small::Small;
use super::{Hints, hsv, shape, weights};
use crate::raster::{Mask, Rect};

/// Log-odds that overrule everything the picture says.
const CERTAIN: f32 = 12.0;

/// The crown in the reduced photograph.
pub struct Found {
    /// Pixels that look like crown on their own.
    pub evidence: Vec<bool>,
    /// The crown.
    pub crown: Vec<bool>,
}

/// Finds the crown in an analysed photograph; `full` is the photograph's size, in whose pixels the hints are.
pub fn find(scene: &Scene, hints: &Hints, opaque: Option<&Mask>, full: (u32, u32)) -> Found {
    let seeds = seeds(&scene.small, hints, opaque, full);
    let mut looks: Vec<Vec<f32>> = Vec::new();
    for look in [weights::FIRST_LOOK, weights::SECOND_LOOK] {
        let inputs = looks.last().map_or_else(|| scene.first(), |belief| scene.second(belief));
        let mut logits = look.judge(&inputs);
        apply(&scene.small, hints, &seeds, &mut logits);
        looks.push(logits);
    }
    let crown = shape::crown(scene, &looks);
    Found { evidence: looks.last().into_iter().flatten().map(|v| *v > 0.0).collect(), crown }
}

/// What the hints say about each reduced pixel: +1 crown, -1 not crown, 0 nothing.
fn seeds(small: &Small, hints: &Hints, opaque: Option<&Mask>, (width, height): (u32, u32)) -> Vec<i8> {
    let mut seeds = vec![0i8; small.count()];
    let (sx, sy) = (small.width as f32 / width as f32, small.height as f32 / height as f32);
    let place = |i: usize| ((i % small.width) as f32 + 0.5, (i / small.width) as f32 + 0.5);
    let within = |r: &Rect, (x, y): (f32, f32)| {
        let (x, y) = (x / sx, y / sy);
        x >= r.x as f32 && y >= r.y as f32 && x < (r.x + r.width) as f32 && y < (r.y + r.height) as f32
    };
    // A finger's width on a screen: a fiftieth of the picture.
    let radius = 0.02 * small.width.max(small.height) as f32;
    let near = |(px, py): (u32, u32), (x, y): (f32, f32)| ((px as f32 + 0.5) * sx - x).hypot((py as f32 + 0.5) * sy - y) <= radius;
    for (i, seed) in seeds.iter_mut().enumerate() {
        let p = place(i);
        if hints.include.iter().any(|&q| near(q, p)) {
            *seed = 1;
        }
        let transparent = opaque.is_some_and(|m| !m.get((p.0 / sx) as i64, (p.1 / sy) as i64));
        if transparent || hints.rect.as_ref().is_some_and(|r| !within(r, p)) || hints.exclude.iter().any(|&q| near(q, p)) {
            *seed = -1;
        }
    }
    seeds
}

/// Lets hints speak in the log-odds.
fn apply(small: &Small, hints: &Hints, seeds: &[i8], logits: &mut [f32]) {
    for (i, logit) in logits.iter_mut().enumerate() {
        if let Some(range) = hints.hue_deg {
            let hue = hsv::hue_deg(small.rgb[i].map(|v| v as u8));
            *logit += if hsv::in_range(hue, range) { 1.5 } else { -1.5 };
        }
        if seeds[i] != 0 {
            *logit = CERTAIN * f32::from(seeds[i]);
        }
    }
}
