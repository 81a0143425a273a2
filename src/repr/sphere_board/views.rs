//! The crowns of a true tree from afar: the same closed surfaces, coarse, wearing what is seen of the tree from where the viewer stands.
//!
//! Where a leaf is smaller than a pixel, what matters is whether a pixel is covered and how light it is, and of a heap of leaves that differs
//! from side to side: one texture for all sides has gaps and lights where none are. So each of some views, in rings from the level to
//! straight above, has a picture of the whole tree, and the surfaces carry the one that was taken nearest to the viewer. Ours; She's far trees
//! wear one texture, as do those made of photographs.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{RgbaImage, imageops};
use rayon::prelude::*;

use super::SphereBoardParams;
use super::reduced::reduced;
use super::relief::Relief;
use super::shade::Shade;
use crate::Result;
use crate::crown::{self, CrownParams, Hull};
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::Part;
use crate::raster::View;
use crate::repr::card::{self, Card, window_around};
use crate::repr::{BuiltPart, Facing, Job};

/// A ring of views: from which elevation its pictures are taken, and between which they are shown, degrees.
struct Ring {
    taken: f32,
    shown: [f32; 2],
}

const RINGS: [Ring; 3] = [
    Ring { taken: 12.0, shown: [-90.0, 30.0] },
    Ring { taken: 45.0, shown: [30.0, 57.0] },
    Ring { taken: 68.0, shown: [57.0, 79.0] },
];
/// How far a view shows beyond its own sector, where the next takes over.
const BLEND: f32 = 0.07;
/// A texel is the mean of so many pixels along each side.
const FINER: u32 = 3;
/// A texel of the normals has so many of the picture along each side. Shading by single leaves would be lighter the farther away they are, as
/// normals that point everywhere average to one that points up.
const NORMALS: u32 = 2;
/// How far the surfaces stand out beyond the clusters' outlines, of the tree's longest side or of so many times its width, if that is less:
/// pictures end at alpha, not at the surface. The one seen from above stands out farther, since clusters are found on what is seen from the
/// side.
const OUTSET: f64 = 0.06;
const OUTSET_ABOVE: f64 = 0.16;
const WIDTHS: f32 = 1.8;
/// Texels of the picture from above along each side of one of another picture: it serves for the largest share of what is seen by one who
/// looks down on a landscape, and costs little.
const FINER_ABOVE: f32 = 1.5;
/// Times the alpha that keeps the covered area at the alpha test. Seen between two sizes of a picture, and from between two views, less of it is
/// there; with this much, what is there is the true tree's within a few percent (`examples/sphere_score`).
const FULLER: f32 = 1.1;
/// Empty texels round each picture, and round the finer one from above: what lies beyond is not there.
const MARGIN: f32 = 3.0;
const MARGIN_ABOVE: f32 = 2.0;
/// What a side may have more than whole texels without getting another: rounding would decide.
const WHOLE: f32 = 1e-3;

/// The parts of the level; empty where nothing is seen of the tree.
pub(super) fn parts(
    job: &Job,
    hulls: &[Hull],
    wood: Option<&Part>,
    bounds: Bounds,
    params: &SphereBoardParams,
) -> Result<Vec<BuiltPart>> {
    let size = bounds.size();
    let longest_m = size.max_element();
    let broad_m = longest_m.min(WIDTHS * size.x.midpoint(size.z));
    let surface = |outset: f64| surface(job, hulls, wood, outset * f64::from(broad_m), params);
    let (aside, above) = rayon::join(|| surface(OUTSET), || surface(OUTSET_ABOVE));
    let (aside, above) = (aside?, above?);
    let (mut cards, mut facings) = (vec![], vec![]);
    for (axes, facing) in stands(params.looks) {
        let (finer, margin) = if is_above(axes) { (FINER_ABOVE, MARGIN_ABOVE) } else { (1.0, MARGIN) };
        let texel_m = longest_m / (finer * params.look_px as f32);
        let Some(window) = window_around(job.source.points(job.scope), axes) else { continue };
        let wide = Vec3::new(margin * texel_m, margin * texel_m, 0.0);
        let window = Bounds { min: window.min - wide, max: window.max + wide };
        let size_px = [window.size().x, window.size().y].map(|side| ((side / texel_m - WHOLE).ceil() as u32).max(4));
        cards.push(Card { name: format!("look_{}", cards.len()), axes, window, plane: 0.0, size_px });
        facings.push(facing);
    }
    let parts = job.source.parts(job.scope);
    let finer = |card: &Card| Card { size_px: card.size_px.map(|side| FINER * side), ..card.clone() }.view();
    let views: Vec<View> = cards.iter().map(finer).collect();
    let taken = job.capture.take(&parts, &views)?;
    let leaves = card::leaves(job.capture, &parts, &views, &taken)?;
    let shade = Shade { views: &views, taken: &taken, leaves: &leaves, bounds };
    let looks = cards.par_iter().zip(facings).enumerate();
    let worn = looks.filter_map(|(number, (card, facing))| {
        let (mut small, kinds) = reduced(&taken[number], &leaves[number], FINER);
        shade.cast_on(&mut small, number, FINER);
        let mut part = card::of_capture(card, &small, &kinds)?;
        let mesh = if is_above(card.axes) { &above } else { &aside };
        part.surface = wearing(Relief::of(&card.view(), &small).raised(mesh), card);
        part.material.two_sided = false;
        part.material.texture = part.material.texture.map(|picture| Arc::new(fuller(&picture)));
        part.material.normal_texture = part.material.normal_texture.map(|normals| {
            let [width, height] = card.size_px.map(|side| (side / NORMALS).max(1));
            Arc::new(imageops::resize(&*normals, width, height, imageops::FilterType::Triangle))
        });
        let mut part = BuiltPart::still(part);
        part.seen.facing = facing;
        Some(part)
    });
    Ok(worn.collect())
}

/// Whether a view looks straight down.
fn is_above(axes: [Vec3; 3]) -> bool {
    axes[2].y > 0.999
}

/// The closed surfaces that carry the pictures: crowns, and wood. A crown's normals are those of the ellipsoid in its box: which of two
/// diagonals parts a quad of it is up to rounding, and so would be normals that are taken from its triangles.
fn surface(job: &Job, hulls: &[Hull], wood: Option<&Part>, outset_m: f64, params: &SphereBoardParams) -> Result<Surface> {
    let outset = |mut hull: Hull| {
        hull.inset(-outset_m);
        hull
    };
    let hulls: Vec<Hull> = hulls.iter().cloned().map(outset).collect();
    let smooth = CrownParams { disturb: 0.0, ..CrownParams::default() };
    let crowns = crown::surfaces(&hulls, params.look_polygons as usize, &smooth, job.seed)?;
    let crowns =
        crowns.into_iter().map(|crown| Surface { normals: of_ellipsoid(&crown.mesh), mesh: crown.mesh, ..Surface::default() });
    let wood = wood.map(|wood| {
        let Surface { mesh, normals, .. } = &wood.surface;
        Surface { mesh: mesh.clone(), normals: normals.clone(), ..Surface::default() }
    });
    Ok(crowns.chain(wood).fold(Surface::default(), |mut all, surface| {
        all.append(surface);
        all
    }))
}

/// The normals that the ellipsoid in a mesh's box has where the vertices are, or would have if it were larger or smaller.
fn of_ellipsoid(mesh: &PolyMesh) -> Vec<Vec3> {
    let Some(bounds) = mesh.bounds() else { return vec![] };
    let half = (0.5 * bounds.size()).max(Vec3::splat(1e-4));
    mesh.positions.iter().map(|p| ((*p - bounds.center()) / (half * half)).normalize_or(Vec3::Y)).collect()
}

/// Somewhat more of it there.
fn fuller(picture: &RgbaImage) -> RgbaImage {
    let mut picture = picture.clone();
    picture.pixels_mut().for_each(|p| p.0[3] = (FULLER * f32::from(p.0[3])).min(255.0) as u8);
    picture
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
fn wearing(mesh: PolyMesh, card: &Card) -> Surface {
    let ([right, up, toward], low, size) = (card.axes, card.window.min, card.window.size());
    let uv = |p: &Vec3| Vec2::new((p.dot(right) - low.x) / size.x, 1.0 - (p.dot(up) - low.y) / size.y);
    let uvs = mesh.positions.iter().map(uv).collect();
    Surface { normals: vec![toward; mesh.positions.len()], uvs, mesh, ..Surface::default() }
}
