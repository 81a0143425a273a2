//! Leaves and needles, sorted from far to near.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use sphereboard::Seed;
use sphereboard::seed::Draws;

use super::LIGHT;
use super::canvas::{Colour, Leaf, clouds, rgb, smoothstep};

/// Middle and half-axes of the oak's crown, units; z is towards the viewer.
const OAK_MIDDLE: DVec2 = DVec2::new(298.0, 330.0);
const OAK_HALF: DVec3 = DVec3::new(190.0, 200.0, 170.0);

/// A clump of leaves: a ball in the crown.
struct Clump {
    /// From the crown's middle, in half-axes.
    place: DVec3,
    radius: f64,
    /// Yellower above 0, bluer below.
    warmth: f64,
}

/// A broad crown: clumps of leaves over a dark inside, with a few gaps.
pub fn oak(seed: Seed) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    let mut number = 0u64;
    for clump in clumps(seed) {
        for _ in 0..(0.25 * clump.radius * clump.radius) as u64 {
            number += 1;
            leaves.extend(oak_leaf(seed, &clump, seed.keyed("oak-leaves", number)));
        }
    }
    sorted(leaves)
}

fn clumps(seed: Seed) -> Vec<Clump> {
    let outer = (0..150u64).map(|item| {
        let mut draws = seed.keyed("clumps", item);
        // Evenly over the sphere (golden spiral), then shaken.
        let (y, turn) = (1.0 - 2.0 * (item as f64 + 0.5) / 150.0, item as f64 * 2.399_963);
        let around = (1.0 - y * y).sqrt();
        let shake = 0.22 * DVec3::new(draws.signed(), draws.signed(), draws.signed());
        let mut place = (DVec3::new(around * turn.sin(), y, around * turn.cos()) + shake) * (0.80 + 0.20 * draws.unit());
        // The crown is flat below and its lowest boughs reach outwards.
        place.y = if place.y > 0.0 { 0.80 * place.y } else { place.y };
        Clump { place, radius: 30.0 + 22.0 * draws.unit(), warmth: draws.signed() }
    });
    let inner = (0..40u64).map(|item| {
        let mut draws = seed.keyed("inner-clumps", item);
        let place = 0.55 * DVec3::new(draws.signed(), 0.9 * draws.signed(), draws.signed());
        Clump { place, radius: 60.0, warmth: -0.5 }
    });
    outer.chain(inner).collect()
}

/// One leaf on the near side of a clump; `None` in a gap of the crown.
fn oak_leaf(seed: Seed, clump: &Clump, mut draws: Draws) -> Option<Leaf> {
    let (height, turn) = (draws.signed(), TAU * draws.unit());
    let around = (1.0 - height * height).sqrt();
    let normal = DVec3::new(around * turn.sin(), height, (around * turn.cos()).abs() - 0.15);
    let off = clump.radius * (0.72 + 0.42 * draws.unit() * draws.unit()) * normal;
    let middle = clump.place * OAK_HALF;
    let place = middle + off;
    let at = OAK_MIDDLE + DVec2::new(place.x, place.y);
    if porous(seed, at) > 0.985 * draws.unit().powf(0.12) {
        return None;
    }
    let outward = (place / OAK_HALF).normalize_or_zero();
    let depth_in_crown = (place / OAK_HALF).length();
    let facing = 0.62 * normal.normalize_or_zero().dot(LIGHT) + 0.38 * outward.dot(LIGHT);
    let open = smoothstep(0.45, 1.05, depth_in_crown);
    let light = (0.16 + 0.80 * facing.max(0.0) + 0.17 * draws.signed()) * (0.45 + 0.55 * open) - 0.10 * outward.y.max(0.0);
    let colour = tint(&OAK_TINTS, light, 0.07 * clump.warmth + 0.09 * draws.signed());
    let angle = turn + 0.9 * draws.signed();
    let size = 0.75 + 0.55 * draws.unit();
    Some(Leaf { at, depth: place.z, angle, length: 5.8 * size, width: 3.2 * size, colour })
}

/// How likely a leaf is missing: 0 almost everywhere, 1 in the gaps through which one sees the sky.
fn porous(seed: Seed, at: DVec2) -> f64 {
    let out = ((at - OAK_MIDDLE) / DVec2::new(OAK_HALF.x, OAK_HALF.y)).length();
    let hole = smoothstep(0.665, 0.70, clouds(seed, "gaps", at / 30.0, 3));
    hole * smoothstep(0.15, 0.5, out)
}

/// A cone of drooping branches in whorls.
pub fn spruce(seed: Seed) -> Vec<Leaf> {
    const WHORLS: u64 = 44;
    const BRANCHES: u64 = 17;
    let mut leaves = Vec::new();
    for (whorl, number) in (0..WHORLS).flat_map(|w| (0..BRANCHES).map(move |n| (w, n))) {
        let key = whorl * BRANCHES + number;
        let mut draws = seed.keyed("branches", key);
        let up = ((whorl as f64 + 0.7 * draws.unit()) / WHORLS as f64).min(1.0);
        let reach = (6.0 + 158.0 * (1.0 - up).powf(0.88)) * (0.74 + 0.34 * draws.unit());
        let azimuth = TAU * (number as f64 + draws.unit()) / BRANCHES as f64;
        let base = DVec2::new(300.0, 78.0 + 560.0 * (1.0 - up));
        let twigs = (6.0 + reach * 0.55) as u64;
        leaves.extend(
            (0..twigs).flat_map(|twig| needles(seed, key * 1000 + twig, base, reach, azimuth, (twig as f64 + 0.5) / twigs as f64)),
        );
    }
    sorted(leaves)
}

/// The needles of one twig, `out` of the way from the stem to the tip of a branch.
fn needles(seed: Seed, key: u64, base: DVec2, reach: f64, azimuth: f64, out: f64) -> Vec<Leaf> {
    let mut draws = seed.keyed("needles", key);
    let side = DVec2::from_angle(azimuth);
    // Branches sink and lift their tips.
    let sink = reach * (0.10 + 0.62 * out - 0.30 * out * out);
    let spread = (2.0 + 0.13 * reach) * (1.0 - 0.55 * out);
    (0..7)
        .map(|_| {
            let aside = spread * draws.signed();
            let across = side * reach * out + side.perp() * aside;
            let at = base + DVec2::new(across.y, sink + 3.5 * draws.unit() + 0.25 * aside.abs());
            let normal = DVec3::new(0.75 * side.y, -0.45 + 0.5 * draws.signed(), 0.75 * side.x).normalize_or_zero();
            let light = (0.10 + 0.78 * normal.dot(LIGHT).max(0.0) + 0.09 * draws.signed()) * (0.16 + 0.84 * out.powf(1.4));
            let colour = tint(&SPRUCE_TINTS, light, 0.10 * draws.signed());
            // Needles point outwards and hang.
            let angle = (0.85 + 0.3 * draws.signed()).atan2(side.y + 0.5 * draws.signed());
            let size = 0.8 + 0.5 * draws.unit();
            Leaf { at, depth: across.x - 0.04 * sink, angle, length: 9.0 * size, width: 2.3 * size, colour }
        })
        .collect()
}

/// Colours of foliage from deep shade to full light.
type Tints = [Colour; 4];
const OAK_TINTS: Tints = [
    Colour::new(24.0, 38.0, 20.0),
    Colour::new(58.0, 88.0, 34.0),
    Colour::new(112.0, 142.0, 54.0),
    Colour::new(188.0, 202.0, 108.0),
];
const SPRUCE_TINTS: Tints = [
    Colour::new(12.0, 26.0, 20.0),
    Colour::new(32.0, 60.0, 36.0),
    Colour::new(70.0, 104.0, 56.0),
    Colour::new(146.0, 172.0, 108.0),
];

/// The tint at `light` (0 to 1), shifted to yellow or to blue.
fn tint(tints: &Tints, light: f64, warmth: f64) -> Colour {
    let step = light.clamp(0.0, 1.0) * (tints.len() - 1) as f64;
    let below = (step as usize).min(tints.len() - 2);
    let plain = tints[below].lerp(tints[below + 1], step - below as f64);
    plain + warmth * plain.y * rgb(1, 0, 0) * 0.9 - warmth * plain.z * rgb(0, 0, 1) * 0.7
}

fn sorted(mut leaves: Vec<Leaf>) -> Vec<Leaf> {
    leaves.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    leaves
}
