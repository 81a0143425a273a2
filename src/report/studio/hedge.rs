//! A clipped hedge across the picture behind the tree: a dark body in a coat of leaf quads, metres.

use std::sync::Arc;

use glam::{Mat3, Quat, Vec2, Vec3};

use super::Sitting;
use crate::geom::{Bounds, Surface};
use crate::model::{Material, Part, Wrap};
use crate::plant::mesh::{LeafKind, foliage};
use crate::raster::{ALPHA_CUTOFF, to_linear};
use crate::render::{Camera, Projection};
use crate::seed::Draws;

/// Depth of the hedge, metres.
const DEEP_M: f32 = 1.4;
/// Side of a twig, metres.
const TWIG_M: f32 = 0.28;
/// Twigs on a square metre of its face.
const PER_M2: f32 = 130.0;
/// Most twigs: a very wide hedge seen from afar needs them no denser.
const MOST_TWIGS: f32 = 120_000.0;
/// How far the top waves, metres, and over which length.
const WAVE_M: f32 = 0.16;
const WAVE_LONG_M: f32 = 5.3;
/// Colour of the shade inside, sRGB.
const SHADE: [u8; 3] = [40, 58, 24];

/// The hedge for that camera, across all of its picture and behind all of the tree.
pub fn hedge(tree: Bounds, camera: &Camera, sitting: &Sitting) -> Vec<Part> {
    let [right, _, backward] = camera.axes;
    let away = Vec3::new(backward.x, 0.0, backward.z).normalize_or(Vec3::Z);
    // Far enough that the tree's shadow mostly stays on the lawn.
    let behind_m = 0.5 * tree.size().length() + 6.0;
    let foot = Vec3::new(tree.center().x, 0.0, tree.center().z) - behind_m * away;
    let distance_m = (foot - camera.eye).dot(-away).max(1.0);
    let [width, height] = sitting.size_px.map(|side| side.max(1) as f32);
    let slope = match camera.projection {
        Projection::Perspective { fov_y_rad, .. } => (0.5 * fov_y_rad).tan() * width / height,
        Projection::Orthographic { half_height_m, .. } => half_height_m / distance_m * width / height,
    };
    let run = Run {
        turn: Mat3::from_cols(right, Vec3::Y, away),
        foot,
        half_m: 1.15 * slope * (distance_m + DEEP_M) + 1.0,
        high_m: sitting.params.hedge_m as f32,
    };
    let mut draws = sitting.seed.keyed("hedge", 0);
    let leaf = Material {
        name: "hedge".to_owned(),
        factor: [0.66, 0.74, 0.70, 1.0],
        texture: Some(Arc::new(foliage::picture(LeafKind::Oval, sitting.seed))),
        wrap: Wrap::Clamp,
        alpha_cutoff: Some(ALPHA_CUTOFF),
        two_sided: true,
        ..Material::default()
    };
    let [r, g, b] = SHADE.map(to_linear);
    let shade = Material { name: "shade".to_owned(), factor: [r, g, b, 1.0], two_sided: true, ..Material::default() };
    let part = |name: &str, surface, material| Part { name: name.to_owned(), surface, material, crown_center: None };
    vec![part("hedge", run.twigs(&mut draws), leaf), part("shade", run.body(), shade)]
}

/// A straight hedge.
struct Run {
    /// Along it, up, and towards the viewer.
    turn: Mat3,
    /// The middle of its foot.
    foot: Vec3,
    /// Half its length.
    half_m: f32,
    high_m: f32,
}

impl Run {
    fn at(&self, along: f32, up: f32, toward: f32) -> Vec3 {
        self.foot + self.turn * Vec3::new(along, up, toward)
    }

    /// Height at a place along it: nobody clips quite straight.
    fn top_m(&self, along: f32) -> f32 {
        let wave = (along / WAVE_LONG_M).sin() + 0.6 * (along / (0.37 * WAVE_LONG_M) + 1.3).sin();
        (self.high_m + WAVE_M * wave).max(0.2)
    }

    /// Its front and top, as strips a little inside the coat.
    fn body(&self) -> Surface {
        const PIECES: u32 = 160;
        let mut surface = Surface::default();
        for piece in 0..=PIECES {
            let along = self.half_m * (2.0 * piece as f32 / PIECES as f32 - 1.0);
            let top = self.top_m(along) - 0.5 * TWIG_M;
            let half = 0.5 * DEEP_M - 0.4 * TWIG_M;
            for (up, toward) in [(0.0, half), (top, half), (top, -half), (0.0, -half)] {
                surface.mesh.positions.push(self.at(along, up, toward));
                surface.normals.push(self.turn * Vec3::new(0.0, up, toward).normalize());
            }
        }
        for first in (0..4 * PIECES).step_by(4) {
            surface.mesh.quads.extend((0..3).map(|side| [first + side, first + side + 4, first + side + 5, first + side + 1]));
        }
        surface
    }

    /// Its coat: twigs on the front and the top, pointing outward and up.
    fn twigs(&self, draws: &mut Draws) -> Surface {
        let area_m2 = 2.0 * self.half_m * (self.high_m + DEEP_M);
        let count = (PER_M2 * area_m2).min(MOST_TWIGS) as u32;
        let mut surface = Surface::default();
        for _ in 0..count {
            let along = self.half_m * draws.signed() as f32;
            let top = self.top_m(along);
            let way = draws.unit() as f32 * (top + DEEP_M);
            // Up the front, then back over the top, round at the edge.
            let (place, face) = if way < top {
                (Vec3::new(along, way, 0.5 * DEEP_M), Vec3::Z)
            } else {
                (Vec3::new(along, top, 0.5 * DEEP_M - (way - top)), Vec3::Y)
            };
            let rim = (1.0 - (top - way).abs() / 0.35).max(0.0);
            let normal = face.lerp(Vec3::new(0.0, 0.7, 0.7), rim).normalize_or(face);
            let place = place - normal * (0.5 * draws.unit() as f32 + 0.2 * rim) * TWIG_M;
            self.twig(&mut surface, place, normal, draws);
        }
        surface
    }

    fn twig(&self, surface: &mut Surface, place: Vec3, normal: Vec3, draws: &mut Draws) {
        let mut signed = || draws.signed() as f32;
        let scatter = Vec3::new(signed(), signed(), signed());
        let along = (0.5 * normal + 0.4 * Vec3::Y + 0.8 * scatter).normalize_or(Vec3::Y);
        let across = along.any_orthonormal_vector();
        let turn = Quat::from_axis_angle(along, std::f32::consts::PI * signed());
        let across = turn * across;
        let shown = (normal + 0.6 * Vec3::new(signed(), signed(), signed())).normalize_or(normal);
        let size = TWIG_M * (1.0 + 0.3 * signed());
        // Deep in and low down the leaves of the shade.
        let row = if place.y < 0.35 * self.high_m * (1.0 + signed()) { 0.5 } else { 0.0 };
        let column = if signed() < 0.0 { 0.0 } else { 0.5 };
        let first = surface.mesh.positions.len() as u32;
        for (x, y) in [(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)] {
            let p = place + size * (x * across + (y - 0.3) * along);
            surface.mesh.positions.push(self.at(p.x, p.y.max(0.0), p.z));
            surface.normals.push(self.turn * shown);
            surface.uvs.push(Vec2::new(column + 0.5 * (x + 0.5), row + 0.5 * (1.0 - y)));
        }
        surface.mesh.quads.push([first, first + 1, first + 2, first + 3]);
    }
}
