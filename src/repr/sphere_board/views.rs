//! The crowns of a true tree from afar: the same closed surfaces, coarse, wearing what is seen of the tree from where the viewer stands.
//!
//! Where a leaf is smaller than a pixel, what matters is whether a pixel is covered and how light it is, and of a heap of leaves that differs
//! from side to side: one texture for all sides has gaps and lights where none are. So each of some views, in three rings from the level to
//! straight above, has a picture of the whole tree, and the surfaces carry the one that was taken nearest to the viewer. Ours; She's far trees
//! wear one texture, as do those made of photographs.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::imageops;

use super::SphereBoardParams;
use crate::Result;
use crate::crown::{self, CrownParams, Hull};
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::raster::View;
use crate::repr::card::{self, Card, window_around};
use crate::repr::{BuiltPart, Facing, Job};

/// A ring of views: from which elevation its pictures are taken, and between which they are shown, degrees.
struct Ring {
    taken: f32,
    shown: [f32; 2],
}

const RINGS: [Ring; 2] = [Ring { taken: 12.0, shown: [-90.0, 30.0] }, Ring { taken: 52.0, shown: [30.0, 70.0] }];
/// How far a view shows beyond its own sector, where the next takes over.
const BLEND: f32 = 0.07;
/// How far the surfaces stand out beyond the clusters' outlines, of the tree's longest side: pictures end at alpha, never at the surface.
const OUTSET: f64 = 0.02;
/// Empty texels round each picture: what lies beyond it is not there.
const MARGIN: f32 = 2.0;

/// The parts of the level; empty where nothing is seen of the tree.
pub(super) fn parts(job: &Job, hulls: &[Hull], bounds: Bounds, params: &SphereBoardParams) -> Result<Vec<BuiltPart>> {
    let longest_m = f64::from(bounds.size().max_element());
    let hulls: Vec<Hull> = hulls
        .iter()
        .cloned()
        .map(|mut hull| {
            hull.inset(-OUTSET * longest_m);
            hull
        })
        .collect();
    let smooth = CrownParams { disturb: 0.0, ..CrownParams::default() };
    let crowns = crown::surfaces(&hulls, params.polygons_far as usize, &smooth, job.seed)?;
    let mesh = crowns.into_iter().fold(Surface::default(), |mut all, crown| {
        all.append(Surface { mesh: crown.mesh, ..Surface::default() });
        all
    });
    let texel_m = bounds.size().max_element() / params.look_px as f32;
    let (mut cards, mut sectors) = (vec![], vec![]);
    for (axes, facing) in stands(params.looks) {
        let Some(window) = window_around(job.source.points(job.scope), axes) else { continue };
        let wide = Vec3::new(MARGIN * texel_m, MARGIN * texel_m, 0.0);
        let window = Bounds { min: window.min - wide, max: window.max + wide };
        let size_px = [window.size().x, window.size().y].map(|side| ((side / texel_m).ceil() as u32).max(4));
        cards.push(Card { name: format!("far_view_{}", cards.len()), axes, window, plane: 0.0, size_px });
        sectors.push(facing);
    }
    let taken = card::captured(job.capture, &job.source.parts(job.scope), &cards)?;
    let worn = taken.into_iter().zip(&cards).zip(sectors).filter_map(|((part, card), facing)| {
        let mut part = part?;
        part.surface = wearing(&mesh.mesh, card);
        part.material.two_sided = false;
        part.material.normal_texture = part.material.normal_texture.map(|normals| {
            let [width, height] = card.size_px.map(|side| (side / 2).max(1));
            Arc::new(imageops::resize(&*normals, width, height, imageops::FilterType::Triangle))
        });
        let mut part = BuiltPart::still(part);
        part.seen.facing = facing;
        Some(part)
    });
    Ok(worn.collect())
}

/// From where pictures are taken, and from where each is seen.
fn stands(looks: u32) -> Vec<([Vec3; 3], Facing)> {
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
    let high = RINGS[RINGS.len() - 1].shown[1].to_radians();
    let above = Facing::Toward { axis: Vec3::Y, cosines: [(high - BLEND).sin(), high.sin()], level: false, both_sides: false };
    RINGS.iter().flat_map(ring).chain([(View::axes_from(0.0, FRAC_PI_2), above)]).collect()
}

/// The surface with the card's picture thrown onto it. Its normals are the card's: those of the picture are told in its frame.
fn wearing(mesh: &PolyMesh, card: &Card) -> Surface {
    let ([right, up, toward], low, size) = (card.axes, card.window.min, card.window.size());
    let uv = |p: &Vec3| Vec2::new((p.dot(right) - low.x) / size.x, 1.0 - (p.dot(up) - low.y) / size.y);
    let uvs = mesh.positions.iter().map(uv).collect();
    Surface { normals: vec![toward; mesh.positions.len()], uvs, mesh: mesh.clone(), ..Surface::default() }
}
