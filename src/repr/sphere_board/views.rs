//! The crowns of a true tree from afar: the same closed surfaces, coarse, wearing what is seen of the tree from where the viewer stands.
//!
//! Where a leaf is smaller than a pixel, what matters is whether a pixel is covered and how light it is, and of a heap of leaves that differs
//! from side to side: one texture for all sides has gaps and lights where none are. So each of some views, in three rings from the level to
//! straight above, has a picture of the whole tree, and the surfaces carry the one that was taken nearest to the viewer. Ours; She's far trees
//! wear one texture, as do those made of photographs.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use image::imageops;
use rayon::prelude::*;

use super::SphereBoardParams;
use super::picture::Scale;
use super::subject::Cluster;
use super::tone::{GROUND, SKY, SUN, THROUGH, WRAP};
use crate::Result;
use crate::crown::{self, CrownParams, Hull};
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::Part;
use crate::raster::{self, Layer, View};
use crate::repr::card::{self, Card, window_around};
use crate::repr::{BuiltPart, Facing, Job, Scope};

/// A ring of views: from which elevation its pictures are taken, and between which they are shown, degrees.
struct Ring {
    taken: f32,
    shown: [f32; 2],
}

const RINGS: [Ring; 2] = [Ring { taken: 12.0, shown: [-90.0, 30.0] }, Ring { taken: 52.0, shown: [30.0, 70.0] }];
const THREE: [Ring; 3] = [
    Ring { taken: 12.0, shown: [-90.0, 30.0] },
    Ring { taken: 45.0, shown: [30.0, 57.0] },
    Ring { taken: 68.0, shown: [57.0, 79.0] },
];
/// How far a view shows beyond its own sector, where the next takes over.
const BLEND: f32 = 0.07;
/// Empty texels round each picture: what lies beyond it is not there.
const MARGIN: f32 = 2.0;

/// The parts of the level; empty where nothing is seen of the tree.
pub(super) fn parts(job: &Job, hulls: &[Hull], bounds: Bounds, params: &SphereBoardParams) -> Result<Vec<BuiltPart>> {
    let longest_m = bounds.size().max_element();
    let mesh = surface(job, hulls, longest_m, params)?;
    let texel_m = longest_m / params.look_px as f32;
    let (mut cards, mut sectors) = (vec![], vec![]);
    for (axes, facing) in stands(params) {
        let Some(window) = window_around(job.source.points(job.scope), axes) else { continue };
        let wide = Vec3::new(MARGIN * texel_m, MARGIN * texel_m, 0.0);
        let window = Bounds { min: window.min - wide, max: window.max + wide };
        let size_px = [window.size().x, window.size().y].map(|side| ((side / texel_m).ceil() as u32).max(4));
        cards.push(Card { name: format!("far_view_{}", cards.len()), axes, window, plane: 0.0, size_px });
        sectors.push(facing);
    }
    let parts = job.source.parts(job.scope);
    let views: Vec<View> = cards.iter().map(Card::view).collect();
    let taken = job.capture.take(&parts, &views)?;
    let leaves = card::leaves(job.capture, &parts, &views, &taken)?;
    let reliefs: Vec<Relief> = views.iter().zip(&taken).map(|(view, taken)| Relief::of(view, taken)).collect();
    let looks = cards.par_iter().zip(&taken).zip(&leaves).zip(&reliefs).zip(sectors);
    let worn = looks.filter_map(|((((card, taken), leaves), relief), facing)| {
        let mut part = card::of_capture(card, taken, leaves)?;
        part.surface = wearing(&relief.raised(&mesh, params.x_relief as f32), card);
        part.material.two_sided = false;
        part.material.normal_texture = part.material.normal_texture.map(|normals| {
            let [width, height] = card.size_px.map(|side| (side / params.x_normals).max(1));
            Arc::new(imageops::resize(&*normals, width, height, imageops::FilterType::Triangle))
        });
        let tone =
            if params.x_tone > 0.0 { tone(relief, &reliefs, bounds, params.x_normals) } else { 1.0f32 }.powf(params.x_tone as f32);
        part.material.factor = [tone, tone, tone, 1.0];
        let mut part = BuiltPart::still(part);
        part.seen.facing = facing;
        Some(part)
    });
    Ok(worn.collect())
}

/// The closed surfaces that carry the pictures.
fn surface(job: &Job, hulls: &[Hull], longest_m: f32, params: &SphereBoardParams) -> Result<PolyMesh> {
    let whole;
    let hulls = if params.x_whole > 0 {
        let foliage: Vec<Part> = job.source.parts(Scope::Foliage).into_iter().cloned().collect();
        let scale = Scale { metres_per_px: longest_m / 128.0, longest_px: 128 };
        whole = [Cluster::of(job, &foliage, 1, params, scale)?.hull];
        &whole[..]
    } else {
        hulls
    };
    let outset = |mut hull: Hull| {
        hull.inset(-params.x_outset * f64::from(longest_m));
        hull
    };
    let hulls: Vec<Hull> = hulls.iter().cloned().map(outset).collect();
    let smooth = CrownParams { disturb: 0.0, ..CrownParams::default() };
    let crowns = crown::surfaces(&hulls, params.polygons_far as usize, &smooth, job.seed)?;
    let all = crowns.into_iter().fold(Surface::default(), |mut all, crown| {
        all.append(Surface { mesh: crown.mesh, ..Surface::default() });
        all
    });
    Ok(all.mesh)
}

/// Where in depth what a card shows lies, and which way it is turned.
struct Relief<'a> {
    view: &'a View,
    taken: &'a raster::Capture,
    /// Metres towards the viewer from the origin, smoothed and everywhere.
    depth: Layer,
}

/// Half the width of what is averaged of depths, texels.
const SMOOTHED: usize = 4;

impl<'a> Relief<'a> {
    fn of(view: &'a View, taken: &'a raster::Capture) -> Self {
        let middle = view.center.dot(view.axes[2]);
        let width = view.width_px as usize;
        let seen = Layer::from_fn(width, view.height_px as usize, |x, y| {
            let at = y * width + x;
            let (depth, covered) = (taken.depth_m[at], covered(taken, at));
            if depth.is_finite() { Vec4::new(covered * (middle + depth), 0.0, 0.0, covered) } else { Vec4::ZERO }
        });
        let mut depth = seen.low_pass(SMOOTHED);
        depth.texels.iter_mut().for_each(|t| *t = Vec4::new(t.x / t.w.max(1e-6), 0.0, 0.0, (20.0 * t.w).min(1.0)));
        depth.bleed();
        Self { view, taken, depth }
    }

    /// The surface with the side that the viewer sees brought to where the leaves are that he sees: nothing moves in the picture, but seen
    /// somewhat from aside leaves stay together.
    fn raised(&self, mesh: &PolyMesh, share: f32) -> PolyMesh {
        let View { axes: [right, up, toward], center, half_size_m, width_px, height_px, .. } = *self.view;
        let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
        for corners in mesh.triangulated() {
            let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
            corners.iter().for_each(|&v| normals[v as usize] += (b - a).cross(c - a));
        }
        let moved = |(p, n): (&Vec3, &Vec3)| {
            let faces = (n.normalize_or(Vec3::ZERO).dot(toward) / 0.3).clamp(0.0, 1.0);
            let aside = *p - center;
            let x = (0.5 + 0.5 * aside.dot(right) / half_size_m.x) * width_px as f32;
            let y = (0.5 - 0.5 * aside.dot(up) / half_size_m.y) * height_px as f32;
            let depth = self.depth.bilinear(x.clamp(0.5, width_px as f32 - 0.5), y.clamp(0.5, height_px as f32 - 0.5)).x;
            *p + share * faces * (depth - p.dot(toward)) * toward
        };
        PolyMesh { positions: mesh.positions.iter().zip(&normals).map(moved).collect(), ..mesh.clone() }
    }
}

/// Covered part of a pixel.
fn covered(taken: &raster::Capture, at: usize) -> f32 {
    f32::from(taken.coverage.as_raw()[at]) / 255.0
}

/// The light that a view's leaves get over the light in which a renderer shows their picture (shaders/shared/shade.wgsl, `sun_at_leaves` and
/// `sun_at_card`), whose normals are averaged over so many texels; suns stand where the other views are taken from.
fn tone(relief: &Relief, suns: &[Relief], bounds: Bounds, averaged: u32) -> f32 {
    let View { axes: [right, up, toward], center, half_size_m, width_px, height_px, .. } = *relief.view;
    let (width, height) = (width_px as usize, height_px as usize);
    let covered = |at: usize| covered(relief.taken, at);
    let normals = Layer::from_fn(width, height, |x, y| {
        let at = y * width + x;
        (covered(at) * relief.taken.normal[at]).extend(covered(at))
    });
    let smooth = normals.low_pass((averaged / 2) as usize);
    let (half, middle) = ((0.5 * bounds.size()).max(Vec3::splat(1e-3)), bounds.center());
    let wide = 0.5 * (half.x + half.z);
    let half = Vec3::new(wide, half.y, wide);
    let height_m = bounds.size().y.max(1e-3);
    let (mut leaves, mut card) = (0.0, 0.0);
    for lit in suns.iter().filter(|sun| sun.view.axes[2].dot(toward).abs() < 0.95 && sun.view.axes[2].y > 0.3) {
        let sun = lit.view.axes[2];
        let light = |n: Vec3, through: f32| {
            let ambient = 0.75 * (GROUND + (SKY - GROUND) * (0.5 + 0.5 * n.y));
            ambient + SUN * through * (((n.dot(sun) + WRAP) / (1.0 + WRAP)).max(0.0) + THROUGH)
        };
        for at in (0..width * height).filter(|&at| relief.taken.depth_m[at].is_finite()) {
            let part = |i: usize, n: usize| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
            let aside = part(at % width, width) * half_size_m.x * right - part(at / width, height) * half_size_m.y * up;
            let p = center + aside + relief.taken.depth_m[at] * toward;
            let before = depth_at(lit.view, &lit.taken.depth_m, p) - (p - lit.view.center).dot(sun);
            leaves += covered(at) * light(relief.taken.normal[at], (-before.max(0.0) / (0.03 * height_m)).exp());
            let place = (p - middle) / half;
            let behind = way_out(place, toward / half).max(0.0) - 0.14 * height_m;
            let way_m = way_out(place + behind * toward / half, sun / half).max(0.0);
            let n = smooth.texels[at].truncate().normalize_or(toward);
            card += covered(at) * light(n, (-way_m / (0.3 * height_m)).exp());
        }
    }
    if card > 0.0 { (leaves / card).clamp(0.5, 1.5) } else { 1.0 }
}

/// How near to a view the first thing before or behind a place is, metres from its middle.
fn depth_at(view: &View, depths: &[f32], place: Vec3) -> f32 {
    let d = place - view.center;
    let index = |along: f32, half: f32, n: u32| ((0.5 + 0.5 * along / half) * n as f32).floor().clamp(0.0, n as f32 - 1.0) as usize;
    let x = index(d.dot(view.axes[0]), view.half_size_m.x, view.width_px);
    let y = index(-d.dot(view.axes[1]), view.half_size_m.y, view.height_px);
    depths[y * view.width_px as usize + x]
}

/// How far a ray goes on in the unit ball, in its own lengths; where it misses, to where it is nearest to the middle.
fn way_out(start: Vec3, along: Vec3) -> f32 {
    let (a, b) = (along.dot(along), start.dot(along));
    ((b * b - a * (start.dot(start) - 1.0)).max(0.0).sqrt() - b) / a
}

/// From where pictures are taken, and from where each is seen.
fn stands(params: &SphereBoardParams) -> Vec<([Vec3; 3], Facing)> {
    let looks = params.looks;
    let rings = if params.x_rings > 2 { &THREE[..] } else { &RINGS[..] };
    let half = PI / looks as f32;
    let cosines = if looks > 1 { [(half + BLEND).min(PI).cos(), half.cos()] } else { [-2.0; 2] };
    let ring = |ring: &Ring| {
        let [low, high] = ring.shown.map(f32::to_radians);
        let rises = if low > -FRAC_PI_2 { [(low - BLEND).sin(), low.sin()] } else { [-2.0; 2] };
        let (sinks, taken) = ([high.sin(), (high + BLEND).sin()], ring.taken.to_radians());
        let view = move |k: u32| {
            let azimuth = k as f32 * TAU / looks as f32;
            let axis = Vec3::new(azimuth.sin(), 0.0, azimuth.cos());
            (View::axes_from(azimuth, taken), Facing::Sector { axis, cosines, rises, sinks })
        };
        (0..looks).map(view)
    };
    let high = rings[rings.len() - 1].shown[1].to_radians();
    let above = Facing::Toward { axis: Vec3::Y, cosines: [(high - BLEND).sin(), high.sin()], level: false, both_sides: false };
    rings.iter().flat_map(ring).chain([(View::axes_from(0.0, FRAC_PI_2), above)]).collect()
}

/// The surface with the card's picture thrown onto it. Its normals are the card's: those of the picture are told in its frame.
fn wearing(mesh: &PolyMesh, card: &Card) -> Surface {
    let ([right, up, toward], low, size) = (card.axes, card.window.min, card.window.size());
    let uv = |p: &Vec3| Vec2::new((p.dot(right) - low.x) / size.x, 1.0 - (p.dot(up) - low.y) / size.y);
    let uvs = mesh.positions.iter().map(uv).collect();
    Surface { normals: vec![toward; mesh.positions.len()], uvs, mesh: mesh.clone(), ..Surface::default() }
}
