//! Wood: generalised cones with half-spheres at their ends (Truelsen §3.2, fig. 10), metres.
//!
//! Truelsen draws every bone by itself; here the bones of one branch share their rings, so that bark runs on round a bend and no
//! vertex stands twice. Every branch is a closed surface of its own that starts inside the one it grows from.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec2, Vec3};

use super::limbs::{limbs, parent_of};
use crate::geom::Surface;
use crate::plant::Skeleton;
use crate::{Seed, params};

params! {
    /// How wood is meshed.
    pub struct WoodParams {
        /// Corners of a trunk 0.3 m in radius; others go with the square root of their radius, from 3 to 32 corners.
        bark_sides: u32 = 12, in 3..=32, unit "", source "ours: round from ten metres on";
        /// Length of bark that its texture shows, both ways.
        bark_tile_m: f64 = 0.7, in 0.01..=20.0, unit "m", source "ours: one texel is then about a millimetre";
        /// How much wider the trunk is at the ground than above its roots.
        root_flare: f64 = 0.5, in 0.0..=3.0, unit "", source "ours: park trees are about half as wide again at the ground";
    }
}

/// Corners of the thinnest and the thickest branch.
const SIDES: (u32, u32) = (3, 32);

/// Where a trunk gets rings for its root flare: heights in radii.
const FLARE_RINGS: [f32; 4] = [0.0, 0.6, 1.4, 2.6];

/// The height, in radii, over which the root flare dies away by e.
const FLARE_HEIGHT: f32 = 0.9;

/// Least radius of a ring, metres: thinner ones would vanish in rounding.
const THINNEST_M: f32 = 5e-4;

/// All wood of a skeleton as one surface: triangles at the ends of branches, quads along them.
///
/// Texture coordinates go round a branch a whole number of times, chosen at its base, and along it in step with its local girth, so that
/// the bark keeps its proportions on the way to a thin tip. They run on beyond 0..1: the texture repeats.
pub fn wood(skeleton: &Skeleton, params: &WoodParams, seed: Seed) -> Surface {
    wood_within(skeleton, params, seed, [0.0; 2])
}

/// The same with as few rings and corners as leave it within `error_m` of that. Branches no thicker than `thinnest_m` are left out, all but
/// the trunk; where a branch begins inside another, or ends in a point, it is left open. As many corners as are left are as wide on the average as the
/// round branch is.
pub fn wood_within(skeleton: &Skeleton, params: &WoodParams, seed: Seed, [error_m, thinnest_m]: [f32; 2]) -> Surface {
    let mut surface = Surface::default();
    for limb in limbs(skeleton) {
        let grounded = skeleton.bones[limb[0] as usize].parent.is_none();
        let rings = thinned(rings(skeleton, &limb, params, seed), 0.5 * error_m);
        if grounded || 2.0 * widest_m(&rings) > thinnest_m {
            let draw = seed.keyed("wood", u64::from(limb[0])).unit() as f32;
            Limb::new(&rings, grounded, params, draw, error_m).emit(&mut surface);
        }
    }
    surface
}

fn widest_m(rings: &[Ring]) -> f32 {
    rings.iter().map(Ring::girth).fold(0.0, f32::max)
}

/// The first ring, the last, and of those between as few as keep centres and radii within `error_m` (Douglas & Peucker 1973).
fn thinned(rings: Vec<Ring>, error_m: f32) -> Vec<Ring> {
    if error_m <= 0.0 || rings.len() < 3 {
        return rings;
    }
    let off = |ring: &Ring, [a, b]: [&Ring; 2]| {
        let way = b.center - a.center;
        let t = ((ring.center - a.center).dot(way) / way.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let girth = a.girth() + t * (b.girth() - a.girth());
        ring.center.distance(a.center + t * way) + (ring.girth() - girth).abs()
    };
    let mut kept = vec![false; rings.len()];
    let mut open = vec![(0, rings.len() - 1)];
    while let Some((first, last)) = open.pop() {
        (kept[first], kept[last]) = (true, true);
        let between = (first + 1..last).map(|i| (off(&rings[i], [&rings[first], &rings[last]]), i));
        let farthest = between.max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, middle)) = farthest.filter(|(off_m, _)| *off_m > error_m) {
            open.extend([(first, middle), (middle, last)]);
        }
    }
    rings.into_iter().zip(kept).filter_map(|(ring, kept)| kept.then_some(ring)).collect()
}

/// One cross-section of a branch.
#[derive(Clone, Copy)]
struct Ring {
    center: Vec3,
    /// Along the branch, unit.
    along: Vec3,
    /// Across it, unit: where corner 0 lies.
    side: Vec3,
    radius: f32,
    /// Root flare: how much wider it is here, and the phase of its lobes.
    flare: (f32, f32),
}

impl Ring {
    /// A corner; `wide`: times its radius.
    fn corner(&self, j: u32, sides: u32, wide: f32) -> Vec3 {
        let angle = TAU * (j % sides) as f32 / sides as f32;
        let (height, phase) = self.flare;
        let lobes = 0.75 + 0.3 * (5.0 * angle + phase).cos() + 0.2 * (3.0 * angle - 2.0 * phase).sin();
        self.center + wide * self.radius * (1.0 + height * lobes) * self.outward(j, sides)
    }

    fn outward(&self, j: u32, sides: u32) -> Vec3 {
        let (sin, cos) = (TAU * (j % sides) as f32 / sides as f32).sin_cos();
        cos * self.side + sin * self.along.cross(self.side)
    }

    /// Radius with the flare.
    fn girth(&self) -> f32 {
        self.radius * (1.0 + 0.75 * self.flare.0)
    }
}

/// The rings of a branch: one at every joint, turned half way, and more at the foot of a trunk.
fn rings(skeleton: &Skeleton, limb: &[u32], params: &WoodParams, seed: Seed) -> Vec<Ring> {
    let bones = &skeleton.bones;
    let bone = |i: usize| &bones[limb[i] as usize];
    let first = bone(0);
    let parent = parent_of(bones, first).map(|p| &bones[p]);
    let limit = parent.map_or(f32::INFINITY, |p| p.start_radius_m.max(p.end_radius_m)).max(THINNEST_M);
    let mut along = first.heading();
    let mut side = first.orientation * Vec3::X;
    let mut rings = Vec::with_capacity(limb.len() + 1);
    for joint in 0..=limb.len() {
        let before = (joint > 0).then(|| bone(joint - 1));
        let after = (joint < limb.len()).then(|| bone(joint));
        let (center, heading, radius) = match (before, after) {
            (Some(b), Some(a)) => {
                (a.start, (b.heading() + a.heading()).normalize_or(a.heading()), 0.5 * (b.end_radius_m + a.start_radius_m))
            }
            (None, Some(a)) => (a.start, a.heading(), a.start_radius_m.min(limit)),
            (Some(b), None) => (b.end(), b.heading(), b.end_radius_m),
            (None, None) => break,
        };
        // The frame turns no more than the branch does, so that bark does not wind round it.
        side = Quat::from_rotation_arc(along, heading) * side;
        side = (side - side.dot(heading) * heading).normalize_or(heading.any_orthonormal_vector());
        along = heading;
        rings.push(Ring { center, along, side, radius: radius.max(THINNEST_M), flare: (0.0, 0.0) });
    }
    if first.parent.is_none() && params.root_flare > 0.0 { flared(&rings, params, seed) } else { rings }
}

/// The trunk with its root flare: rings near the ground, wider and lobed towards it.
fn flared(rings: &[Ring], params: &WoodParams, seed: Seed) -> Vec<Ring> {
    let foot = rings[0];
    let phase = TAU * seed.keyed("root_flare", 0).unit() as f32;
    let height = |ring: &Ring| (ring.center - foot.center).dot(foot.along).max(0.0) / foot.radius;
    let first = height(&rings[1]);
    let between = FLARE_RINGS.iter().filter(|&&h| h < 0.9 * first).map(|h| {
        let t = h / first;
        Ring { center: foot.center.lerp(rings[1].center, t), radius: foot.radius + t * (rings[1].radius - foot.radius), ..foot }
    });
    let flare = |ring: Ring| {
        let fades = (-height(&ring) / FLARE_HEIGHT).exp();
        Ring { flare: (if fades > 1e-3 { params.root_flare as f32 * fades } else { 0.0 }, phase), ..ring }
    };
    between.chain(rings[1..].iter().copied()).map(flare).collect()
}

/// A branch about to be written.
struct Limb<'a> {
    rings: &'a [Ring],
    /// It stands on the ground: its foot is flat.
    grounded: bool,
    sides: u32,
    /// How often the texture goes round.
    turns: f32,
    /// Where on the texture it starts.
    start: Vec2,
    /// Times the radius are its corners from its middle.
    wide: f32,
    /// Ends no wider than that are left open, and where it starts too; 0 for none.
    open_m: f32,
}

impl<'a> Limb<'a> {
    fn new(rings: &'a [Ring], grounded: bool, params: &WoodParams, draw: f32, error_m: f32) -> Self {
        let radius = rings[0].radius;
        // The flare's lobes need corners to show.
        let finer = if grounded && params.root_flare > 0.0 { 1.5 } else { 1.0 };
        let round = ((finer * params.bark_sides as f32 * (radius / 0.3).sqrt()).round() as u32).clamp(SIDES.0, SIDES.1);
        let (sides, wide) = enough_sides(round, widest_m(rings), 0.5 * error_m);
        Self {
            rings,
            grounded,
            sides,
            wide,
            open_m: error_m,
            turns: (TAU * radius / params.bark_tile_m as f32).round().clamp(1.0, 64.0),
            start: Vec2::new(draw, (7.0 * draw).fract()),
        }
    }

    /// Writes the closed surface: base, cone, tip.
    fn emit(&self, surface: &mut Surface) {
        let (foot, tip) = (self.rings[0], self.rings[self.rings.len() - 1]);
        // Half-spheres have more latitudes the rounder the branch is.
        let latitudes = if self.open_m > 0.0 { 0 } else { (self.sides / 6).min(3) };
        let mut v = self.start.y;
        let depth = if self.grounded { 0.0 } else { foot.radius };
        let base = (self.open_m <= 0.0).then(|| self.pole(surface, foot.center - depth * foot.along, -foot.along, v));
        let mut last = None;
        let mut ring_at = |surface: &mut Surface, ring: &Ring, tilt: f32, v: f32| {
            let now = self.ring(surface, ring, tilt, v);
            match (last, base) {
                (None, Some(base)) => self.fan(surface, now, base, true),
                (None, None) => {}
                (Some(last), _) => self.belt(surface, last, now),
            }
            last = Some(now);
        };
        if self.grounded {
            v -= self.climb(foot.radius, foot.radius);
        } else {
            for step in 1..=latitudes {
                let angle = FRAC_PI_2 * step as f32 / (latitudes + 1) as f32;
                let ring = dome_ring(&foot, -1.0, angle);
                v -= self.climb(FRAC_PI_2 / (latitudes + 1) as f32 * foot.radius, foot.radius);
                ring_at(surface, &ring, -angle.cos(), v);
            }
            v -= self.climb(FRAC_PI_2 / (latitudes + 1) as f32 * foot.radius, foot.radius);
        }
        for (i, ring) in self.rings.iter().enumerate() {
            if i > 0 {
                let before = &self.rings[i - 1];
                v -= self.climb(ring.center.distance(before.center), log_mean(ring.girth(), before.girth()));
            }
            ring_at(surface, ring, self.slope(i), v);
        }
        for step in (1..=latitudes).rev() {
            let angle = FRAC_PI_2 * step as f32 / (latitudes + 1) as f32;
            v -= self.climb(FRAC_PI_2 / (latitudes + 1) as f32 * tip.radius, tip.radius);
            ring_at(surface, &dome_ring(&tip, 1.0, angle), angle.cos(), v);
        }
        if tip.radius <= self.open_m {
            return;
        }
        v -= self.climb(FRAC_PI_2 / (latitudes + 1) as f32 * tip.radius, tip.radius);
        let end = self.pole(surface, tip.center + tip.radius * tip.along, tip.along, v);
        if let Some(last) = last {
            self.fan(surface, last, end, false);
        }
    }

    /// How far the texture runs over a length of bark, given the radius there: as far as it does round the branch.
    fn climb(&self, length: f32, radius: f32) -> f32 {
        self.turns * length / (TAU * radius)
    }

    /// How far the normals at a ring lean forward, as the sine of the angle: cones narrow.
    fn slope(&self, i: usize) -> f32 {
        let (a, b) = (&self.rings[i.saturating_sub(1)], &self.rings[(i + 1).min(self.rings.len() - 1)]);
        let (fall, run) = (a.girth() - b.girth(), a.center.distance(b.center));
        if run > 0.0 { fall / fall.hypot(run) } else { 0.0 }
    }

    /// The vertices of a ring, its first corner twice. Returns the number of the first.
    fn ring(&self, surface: &mut Surface, ring: &Ring, tilt: f32, v: f32) -> u32 {
        let first = surface.mesh.positions.len() as u32;
        for j in 0..=self.sides {
            surface.mesh.positions.push(ring.corner(j, self.sides, self.wide));
            let outward = (1.0 - tilt * tilt).max(0.0).sqrt() * ring.outward(j, self.sides) + tilt * ring.along;
            surface.normals.push(outward.normalize_or(ring.along));
            surface.uvs.push(Vec2::new(self.start.x + self.turns * j as f32 / self.sides as f32, v));
        }
        first
    }

    /// The end of a half-sphere: one vertex for each of its triangles, each with the texture's middle there.
    fn pole(&self, surface: &mut Surface, at: Vec3, normal: Vec3, v: f32) -> u32 {
        let first = surface.mesh.positions.len() as u32;
        for j in 0..self.sides {
            surface.mesh.positions.push(at);
            surface.normals.push(normal);
            surface.uvs.push(Vec2::new(self.start.x + self.turns * (j as f32 + 0.5) / self.sides as f32, v));
        }
        first
    }

    fn belt(&self, surface: &mut Surface, below: u32, above: u32) {
        surface.mesh.quads.extend((0..self.sides).map(|j| [below + j, below + j + 1, above + j + 1, above + j]));
    }

    fn fan(&self, surface: &mut Surface, ring: u32, pole: u32, below: bool) {
        let corners = |j| if below { [ring + j + 1, ring + j, pole + j] } else { [ring + j, ring + j + 1, pole + j] };
        surface.mesh.triangles.extend((0..self.sides).map(corners));
    }
}

/// The fewest corners, but no more than `round`, whose sides lie within `error_m` of a circle, and how much farther out than it they lie so
/// that they are as wide as it on the average, whichever way they are seen from.
fn enough_sides(round: u32, radius_m: f32, error_m: f32) -> (u32, f32) {
    let half_turn = |sides: u32| 0.5 * TAU / sides as f32;
    let inside = |sides: u32| radius_m * (1.0 - half_turn(sides) / half_turn(sides).tan());
    match (SIDES.0..round).find(|sides| inside(*sides) <= error_m) {
        Some(sides) => (sides, half_turn(sides) / half_turn(sides).sin()),
        None => (round, 1.0),
    }
}

/// The radius that stands for a cone's where its inverse is integrated: (a − b) / ln(a / b).
fn log_mean(a: f32, b: f32) -> f32 {
    let ratio = (a / b).ln();
    if ratio.abs() < 1e-3 { 0.5 * (a + b) } else { (a - b) / ratio }
}

/// A ring of the half-sphere at an end of a branch, `angle` away from its pole.
fn dome_ring(end: &Ring, toward: f32, angle: f32) -> Ring {
    Ring { center: end.center + toward * angle.cos() * end.radius * end.along, radius: angle.sin() * end.radius, ..*end }
}
