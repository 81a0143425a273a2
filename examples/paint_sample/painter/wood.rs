//! Trunk and limbs: tapered round strokes with bark.

use glam::{DVec2, DVec3};
use sphereboard::Seed;

use super::canvas::{Canvas, Colour, noise, rgb};
use super::{LIGHT, Species};

/// Where the middle of the trunk meets the ground, units.
pub fn foot(species: Species) -> DVec2 {
    match species {
        Species::Oak => DVec2::new(304.0, 728.0),
        Species::Spruce => DVec2::new(300.0, 730.0),
    }
}

/// Paints the trunk and the limbs.
pub fn paint(canvas: &mut Canvas, seed: Seed, species: Species) {
    let foot = foot(species);
    match species {
        Species::Oak => {
            oak_limbs(canvas, seed);
            let trunk = [
                (0.0, 0.0, 28.0),
                (0.0, -7.0, 23.5),
                (0.0, -17.0, 20.5),
                (0.0, -36.0, 18.5),
                (-2.0, -90.0, 16.5),
                (-7.0, -150.0, 15.5),
                (-6.0, -215.0, 12.0),
                (-4.0, -330.0, 7.0),
            ];
            chain(canvas, seed, foot, &trunk, rgb(134, 116, 96));
        }
        Species::Spruce => {
            let trunk = [(0.0, 0.0, 15.0), (0.0, -10.0, 11.5), (0.0, -80.0, 10.0), (0.0, -350.0, 6.0), (0.0, -630.0, 1.5)];
            chain(canvas, seed, foot, &trunk, rgb(126, 102, 84));
        }
    }
}

/// Limbs that fork from the oak's trunk into the crown.
fn oak_limbs(canvas: &mut Canvas, seed: Seed) {
    let limbs = [
        (-80.0, -0.95, 10.0),
        (-175.0, 0.85, 9.5),
        (-195.0, -0.55, 9.0),
        (-225.0, 0.45, 8.0),
        (-205.0, -1.25, 7.0),
        (-200.0, 1.3, 7.0),
        (-270.0, -0.2, 6.0),
    ];
    for (number, (height, lean, radius)) in limbs.into_iter().enumerate() {
        // The lowest one is a stub that lies in the crown as well.
        let start = foot(Species::Oak) + DVec2::new(-5.0, f64::min(height, -165.0));
        branch(canvas, seed, number as u64 + 1, start, lean, radius, 3);
    }
}

/// A limb that winds, thins and forks. `lean` is from upright, radians, positive to the right.
fn branch(canvas: &mut Canvas, seed: Seed, key: u64, start: DVec2, lean: f64, radius: f64, forks: u32) {
    let mut draws = seed.keyed("limbs", key);
    let (mut at, mut lean, mut radius) = (start, lean, radius);
    for _ in 0..4 {
        lean += 0.22 * draws.signed() - 0.04 * lean;
        let next = at + 24.0 * (0.38 + 0.06 * radius) * DVec2::new(lean.sin(), -lean.cos());
        let thinner = radius * 0.86;
        canvas.limb((at, radius), (next, thinner), f64::INFINITY, |across, along| {
            bark(seed, key, rgb(112, 98, 82), at, lean, across, along, radius)
        });
        (at, radius) = (next, thinner);
    }
    if forks > 0 {
        branch(canvas, seed, 7 * key + 1, at, lean + 0.4 + 0.2 * draws.unit(), 0.7 * radius, forks - 1);
        branch(canvas, seed, 7 * key + 2, at, lean - 0.4 - 0.2 * draws.unit(), 0.75 * radius, forks - 1);
    }
}

/// A trunk through `knots`: offset from `foot` and radius.
fn chain(canvas: &mut Canvas, seed: Seed, foot: DVec2, knots: &[(f64, f64, f64)], colour: Colour) {
    for pair in knots.windows(2).rev() {
        let [a, b] = [pair[0], pair[1]].map(|(x, y, radius)| (foot + DVec2::new(x, y), radius));
        canvas.limb(a, b, foot.y + 3.0, |across, along| bark(seed, 0, colour, DVec2::new(0.0, a.0.y), 0.0, across, along, a.1));
    }
}

/// Bark: a lit cylinder with furrows along it.
#[allow(clippy::too_many_arguments)] // A place on a limb takes that many numbers.
fn bark(seed: Seed, key: u64, colour: Colour, start: DVec2, lean: f64, across: f64, along: f64, radius: f64) -> Colour {
    let (sin, cos) = lean.sin_cos();
    let normal = DVec3::new(across * cos, across * sin, (1.0 - across * across).sqrt());
    let light = 0.30 + 0.85 * normal.dot(LIGHT).max(0.0);
    let girth = across.asin() * radius;
    let run = start.y - along;
    let furrows = noise(seed, "furrows", DVec2::new(girth / 2.6 + 40.0 * key as f64, run / 17.0));
    let flakes = noise(seed, "flakes", DVec2::new(girth / 4.0 + 90.0, run / 6.0));
    colour * light * (0.62 + 0.45 * furrows + 0.25 * flakes)
}
