//! What stands round the tree: sky, hedge, lawn and shadow.

use glam::DVec2;
use sphereboard::Seed;

use super::Species;
use super::canvas::{Canvas, clouds, noise, rgb, smoothstep};

/// Where the lawn begins, units.
const HORIZON: f64 = 652.0;

/// Blue above, pale at the horizon, with soft clouds that flatten with distance.
pub fn sky(canvas: &mut Canvas, seed: Seed) {
    canvas.wash(-1.0..HORIZON + 2.0, |at| {
        let down = (at.y / HORIZON).clamp(0.0, 1.0);
        let blue = rgb(92, 146, 212).lerp(rgb(206, 224, 236), down.powf(0.9));
        let stretch = 1.0 / (1.15 - down);
        let place = DVec2::new(at.x / 210.0 * stretch.sqrt(), at.y / 120.0 * stretch);
        let cloud = smoothstep(0.46, 0.72, clouds(seed, "clouds", place, 6));
        let lit = clouds(seed, "clouds", place + DVec2::new(0.05, 0.12), 3);
        let white = rgb(248, 248, 246).lerp(rgb(206, 213, 224), smoothstep(0.4, 0.75, lit));
        (blue.lerp(white, 0.85 * cloud * (1.0 - 0.5 * down)), 1.0)
    });
}

/// A hazy wood and a nearer hedge, both of dabs.
pub fn hedge(canvas: &mut Canvas, seed: Seed) {
    let (left, right) = canvas.edges();
    let rows = [("wood", 40.0, rgb(140, 164, 158), 5.0, 70.0), ("hedge", 19.0, rgb(78, 104, 60), 3.2, 38.0)];
    for (stage, tall, colour, dab, feature) in rows {
        let top = |x: f64| HORIZON - tall * (0.55 + 0.75 * clouds(seed, stage, DVec2::new(x / feature + 900.0, 0.0), 3));
        canvas.wash(HORIZON - 2.0 * tall..HORIZON + 3.0, |at| (colour * 0.82, smoothstep(top(at.x) - 1.0, top(at.x) + 1.0, at.y)));
        let count = ((right - left) * tall / (0.35 * dab * dab)) as u64;
        for item in 0..count {
            let mut draws = seed.keyed(stage, item + 1_000_000);
            let x = left + (right - left) * draws.unit();
            let high = draws.unit();
            let at = DVec2::new(x, HORIZON + (top(x) - HORIZON) * (1.06 * high));
            let light = 0.72 + 0.36 * high + 0.14 * draws.signed();
            canvas.stroke(at, draws.signed(), dab * (0.7 + draws.unit()), dab * 0.8, colour * light, 0.75);
        }
    }
}

/// Mown grass: paler far away, mottled, of blades that grow towards the viewer.
pub fn lawn(canvas: &mut Canvas, seed: Seed) {
    canvas.wash(HORIZON..801.0, |at| {
        let near = (at.y - HORIZON) / (800.0 - HORIZON);
        let far_away = 1.0 / (near + 0.12);
        let mottled = clouds(seed, "lawn", DVec2::new((at.x - 300.0) / 130.0 * far_away.sqrt(), 2.2 * far_away), 4);
        let green = rgb(136, 156, 82).lerp(rgb(92, 128, 50), near.sqrt());
        (green * (0.80 + 0.40 * mottled), 1.0)
    });
    let (left, right) = canvas.edges();
    for item in 0..(26.0 * (right - left)) as u64 {
        let mut draws = seed.keyed("blades", item);
        // The blades are painted from far to near.
        let near = (item as f64 / (26.0 * (right - left))).powf(0.8);
        let at = DVec2::new(left + (right - left) * draws.unit(), HORIZON + 2.0 + near * (800.0 - HORIZON));
        let green = rgb(126, 146, 70).lerp(rgb(88, 126, 46), near);
        let light = 0.74 + 0.52 * draws.unit();
        let angle = 1.5 + 0.5 * draws.signed();
        canvas.stroke(at, angle, 1.5 + 6.0 * near, 0.5 + 0.9 * near, green * light, 0.55);
        if draws.unit() < 0.0025 {
            canvas.stroke(at, 0.0, 0.8 + 2.4 * near, 0.7 + 1.6 * near, rgb(240, 238, 226), 0.9);
        }
    }
}

/// The tree's shadow on the lawn, to the right and a little towards the viewer.
pub fn cast_shadow(canvas: &mut Canvas, seed: Seed, species: Species) {
    let (middle, half) = match species {
        Species::Oak => (DVec2::new(345.0, 734.0), DVec2::new(235.0, 30.0)),
        Species::Spruce => (DVec2::new(352.0, 736.0), DVec2::new(170.0, 22.0)),
    };
    canvas.wash(HORIZON..801.0, |at| {
        let ragged = 0.35 * (clouds(seed, "shadow", DVec2::new(at.x / 22.0, at.y / 6.0), 3) - 0.5);
        let inside = 1.0 - smoothstep(0.72, 1.08, ((at - middle) / half).length() + ragged);
        let dapple = noise(seed, "dapple", DVec2::new(at.x / 9.0, at.y / 2.6));
        (rgb(40, 62, 34), inside * (0.62 - 0.25 * smoothstep(0.68, 0.85, dapple)))
    });
}

/// Blades that hide where the trunk meets the ground.
pub fn grass_at_the_foot(canvas: &mut Canvas, seed: Seed, species: Species) {
    let foot = super::wood::foot(species);
    for item in 0..260 {
        let mut draws = seed.keyed("foot", item);
        let at = foot + DVec2::new(36.0 * draws.signed(), 4.0 * draws.unit());
        let green = rgb(62, 92, 42) * (0.6 + 0.45 * draws.unit());
        canvas.stroke(at, 1.55 + 0.4 * draws.signed(), 5.0 + 4.0 * draws.unit(), 1.3, green, 0.8);
    }
}
