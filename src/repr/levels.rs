//! Levels of detail that relieve each other: from the error of each, in metres, to the distances at which they take turns, in heights of
//! the tree. An error may be as large as so many pixels of the picture of [`REFERENCE_FOCAL_PX`] rows at one metre.

use glam::Vec3;

use super::{BuiltPart, Level, REFERENCE_FOCAL_PX, Seen};
use crate::model::Part;

/// Over which share of a switch distance two levels fade into each other.
pub const BAND: f32 = 0.15;

/// Each switch distance is at least so many times the one before, so that every level is somewhere seen by itself.
const LEAST_STEP: f32 = 1.5;

/// The nearest switch distance, in heights of the tree: nearer, the eye is in the crown.
const NEAREST: f32 = 0.1;

/// The distance, in heights of the tree, from which an error of `error_m` metres is at most `pixels` high.
pub fn hiding_distance(error_m: f32, pixels: f32, height_m: f32) -> f32 {
    let heights = error_m.max(0.0) * REFERENCE_FOCAL_PX / (pixels.max(1e-3) * height_m.max(1e-3));
    if heights.is_finite() { heights } else { f32::MAX.sqrt() }
}

/// The error of a foliage that has lost `lost_m2` of leaf area and has `left` leaves: the side of the square of it that each of these would
/// have to cover. Gaps smaller than a pixel do not show as gaps.
pub fn gap_m(lost_m2: f32, left: usize) -> f32 {
    (lost_m2.max(0.0) / left.max(1) as f32).sqrt()
}

/// Where each level takes over from the finer one before it, in heights of the tree: rising, 0 for the first. `errors_m` are those of the
/// levels, finest first.
pub fn switches(errors_m: &[f32], pixels: f32, height_m: f32) -> Vec<f32> {
    let mut last = 0.0;
    let next = |(number, error_m): (usize, &f32)| {
        if number > 0 {
            last = hiding_distance(*error_m, pixels, height_m).max(LEAST_STEP * last).max(NEAREST);
        }
        last
    };
    errors_m.iter().enumerate().map(next).collect()
}

/// A distance for each level at which it is all there and no other is, given where they take over.
pub fn middles(switches: &[f32]) -> Vec<f32> {
    let middle = |(number, &near): (usize, &f32)| match switches.get(number + 1) {
        None if number == 0 => 1.0,
        None => LEAST_STEP * near,
        Some(far) if number == 0 => 0.5 * far,
        Some(far) => (near * (1.0 + BAND) * far * (1.0 - BAND)).sqrt(),
    };
    switches.iter().enumerate().map(middle).collect()
}

/// One level as a method has made it.
#[derive(Debug, Clone)]
pub struct Rung {
    /// What it is called.
    pub name: String,
    /// How far it is from the tree, metres.
    pub error_m: f32,
    /// All that is seen of it.
    pub parts: Vec<Part>,
}

/// Levels, finest first, that take turns: each is seen from where its error is at most `pixels` high to where the next takes over.
/// Distances are measured from `anchor`.
pub fn relieving(rungs: Vec<Rung>, anchor: Vec3, pixels: f32, height_m: f32) -> (Vec<BuiltPart>, Vec<Level>) {
    let errors_m: Vec<f32> = rungs.iter().map(|rung| rung.error_m).collect();
    let switches = switches(&errors_m, pixels, height_m);
    let distances = middles(&switches);
    let (mut parts, mut levels) = (vec![], vec![]);
    for (number, rung) in rungs.into_iter().enumerate() {
        let far = switches.get(number + 1).copied().unwrap_or(f32::MAX);
        let seen = Seen::between(anchor, switches[number], far, BAND);
        parts.extend(rung.parts.into_iter().map(|part| BuiltPart::still(part).seen(seen)));
        levels.push(Level { name: rung.name, distance: distances[number] });
    }
    (parts, levels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_hides_where_it_is_a_pixel_high() {
        // 1 m is REFERENCE_FOCAL_PX pixels at 1 m: one pixel at REFERENCE_FOCAL_PX metres, a tenth of that in heights of 10 m.
        assert!((hiding_distance(1.0, 1.0, 10.0) - 0.1 * REFERENCE_FOCAL_PX).abs() < 1e-3);
        assert!((hiding_distance(1.0, 4.0, 10.0) - 0.025 * REFERENCE_FOCAL_PX).abs() < 1e-3);
        assert!(hiding_distance(f32::INFINITY, 1.0, 1.0).is_finite() && hiding_distance(f32::NAN, 1.0, 1.0) == 0.0);
    }

    #[test]
    fn at_its_distance_a_level_is_alone() {
        for errors in [&[0.0, 0.0, 0.0, 0.0][..], &[0.0, 0.1, 0.1001, 5.0], &[0.0], &[0.3, 0.2]] {
            let rung = |error_m: &f32| Rung {
                name: String::new(),
                error_m: *error_m,
                parts: vec![Part {
                    name: String::new(),
                    surface: Default::default(),
                    material: Default::default(),
                    crown_center: None,
                }],
            };
            let (parts, levels) = relieving(errors.iter().map(rung).collect(), Vec3::ZERO, 1.0, 10.0);
            for (i, level) in levels.iter().enumerate() {
                for (j, part) in parts.iter().enumerate() {
                    assert_eq!(part.seen.share_at(level.distance), f32::from(u8::from(i == j)), "{errors:?}: {j} at level {i}");
                }
            }
        }
    }
}
