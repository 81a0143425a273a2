//! One continuous chart per crown: the equal-area octahedral map about the front (Clarberg 2008, "Fast equal-area mapping of the
//! (hemi)sphere using SIMD"; She has no atlas, the choice is ours).
//!
//! The hemisphere towards the photographer fills the middle of the square in one piece; the four cuts lie on the back. Directions are
//! taken after scaling the crown to a ball, so texels are about equally large everywhere: on a round crown the front gets almost twice the
//! texels across that a cylindrical chart would give it. Chart coordinates run over −1..=1, x right, y up; what lies beyond an edge is the
//! square itself turned half round that edge's middle, so polygons that cross a cut run on into a gutter, and nothing needs to wrap.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

use super::flat::FlatMesh;
use super::relax::relax;
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::{Error, Result};

/// A place for every polygon's corners.
#[derive(Debug)]
pub(super) struct Chart {
    /// Chart coordinates per polygon; a triangle repeats its last corner.
    pub corners: Vec<[Vec2; 4]>,
    /// Chart coordinates that reach the border of the image: at least 1, so that what overhangs fits.
    pub extent: f32,
}

/// The nine ways in which the plane continues the square: itself, half turns about the edges' middles, shifts past the corners.
pub(super) const COPIES: [fn(Vec2) -> Vec2; 9] = [
    |p| p,
    |p| Vec2::new(2.0 - p.x, -p.y),
    |p| Vec2::new(-2.0 - p.x, -p.y),
    |p| Vec2::new(-p.x, 2.0 - p.y),
    |p| Vec2::new(-p.x, -2.0 - p.y),
    |p| p + Vec2::new(2.0, 2.0),
    |p| p + Vec2::new(2.0, -2.0),
    |p| p + Vec2::new(-2.0, 2.0),
    |p| p + Vec2::new(-2.0, -2.0),
];

/// Gutter beyond whatever overhangs, as a part of the image's side: four texels of 512 keep three mip levels clean.
const GUTTER: f32 = 4.0 / 512.0;

/// The part of the image's side that the square takes on a medium crown: the rest is gutter and what polygons across a cut overhang.
pub(super) const USUAL_PART: f64 = 1.0 - 2.0 * GUTTER as f64 - 0.035;

impl Chart {
    /// Lays out a crown that is star-shaped about `center`.
    ///
    /// # Errors
    /// [`Error::Untexturable`] when the crown has no extent in some direction.
    pub(super) fn of(mesh: &PolyMesh, flat: &FlatMesh, center: Vec3) -> Result<Self> {
        let half =
            mesh.bounds().map(|b: Bounds| (b.max - center).max(center - b.min)).filter(|h| h.is_finite() && h.min_element() > 0.0);
        let Some(half) = half else {
            return Err(Error::Untexturable { found: "a mesh that is flat or does not surround it".into() });
        };
        let mut directions: Vec<Vec3> = mesh.positions.iter().map(|p| ((*p - center) / half).normalize_or(Vec3::Z)).collect();
        let mut in_use = vec![false; directions.len()];
        mesh.polygons().flatten().for_each(|&v| in_use[v as usize] = true);
        let pinned: Vec<usize> =
            [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y].iter().filter_map(|&axis| snap(&mut directions, &in_use, axis)).collect();
        let mut places: Vec<Vec2> = directions.iter().map(|d| octahedral(*d)).collect();
        let copies: Vec<[u8; 4]> = mesh.polygons().map(|p| unfold(p, &places)).collect();
        relax(mesh, flat, &mut places, &copies, &pinned);
        let corners = mesh.polygons().zip(&copies).map(|(polygon, copies)| {
            std::array::from_fn(|k| {
                let k = k.min(polygon.len() - 1);
                COPIES[usize::from(copies[k])](places[polygon[k] as usize])
            })
        });
        let corners: Vec<[Vec2; 4]> = corners.collect();
        let reach = corners.iter().flatten().map(|c| c.abs().max_element()).fold(1.0, f32::max);
        Ok(Self { corners, extent: (reach / (1.0 - 2.0 * GUTTER)).max(1.0) })
    }

    /// Chart to texture coordinates: (0, 0) is the top left corner of the image.
    pub(super) fn uv(&self, p: Vec2) -> Vec2 {
        0.5 + 0.5 / self.extent * Vec2::new(p.x, -p.y)
    }

    /// The drawable surface: vertices stand double, with identical positions, where the chart is cut.
    pub(super) fn surface(&self, mesh: &PolyMesh) -> Surface {
        let normals = mesh.vertex_normals();
        let mut surface = Surface::default();
        let mut numbers: BTreeMap<(u32, u32, u32), u32> = BTreeMap::new();
        let mut number = |v: u32, p: Vec2, surface: &mut Surface| {
            let uv = self.uv(p);
            *numbers.entry((v, uv.x.to_bits(), uv.y.to_bits())).or_insert_with(|| {
                surface.mesh.positions.push(mesh.positions[v as usize]);
                surface.normals.push(normals[v as usize]);
                surface.uvs.push(uv);
                surface.uvs.len() as u32 - 1
            })
        };
        for (polygon, places) in mesh.polygons().zip(&self.corners) {
            let at: Vec<u32> = polygon.iter().zip(places).map(|(&v, &p)| number(v, p, &mut surface)).collect();
            match at[..] {
                [a, b, c] => surface.mesh.triangles.push([a, b, c]),
                [a, b, c, d] => surface.mesh.quads.push([a, b, c, d]),
                _ => unreachable!("polygons have three or four corners"),
            }
        }
        surface
    }
}

/// The four places where the square is folded to half a turn (±X, ±Y) must be vertices, or the polygon over one would be folded too:
/// the vertex nearest to `axis` moves there, and the directions around it with it, less and less.
fn snap(directions: &mut [Vec3], in_use: &[bool], axis: Vec3) -> Option<usize> {
    let used = (0..directions.len()).filter(|&v| in_use[v]);
    let nearest = used.max_by(|&a, &b| directions[a].dot(axis).total_cmp(&directions[b].dot(axis)).then(b.cmp(&a)))?;
    let from = directions[nearest];
    let shift = axis - from;
    let reach = (2.5 * shift.length()).max(0.45);
    for d in directions.iter_mut() {
        let w = (-(*d - from).length_squared() / (reach * reach)).exp();
        *d = (*d + w * shift).normalize_or(*d);
    }
    directions[nearest] = axis;
    Some(nearest)
}

/// Direction to chart.
fn octahedral(d: Vec3) -> Vec2 {
    let a = d.abs();
    // The plain √(1−z) loses digits at the front, where 1−z is small.
    let r = (a.x * a.x + a.y * a.y).sqrt() / (1.0 + a.z).sqrt();
    let v = if a.x + a.y > 0.0 { a.y.atan2(a.x) * std::f32::consts::FRAC_2_PI * r } else { 0.0 };
    let (u, v) = if d.z < 0.0 { (1.0 - v, 1.0 - (r - v)) } else { (r - v, v) };
    Vec2::new(u.copysign(d.x), v.copysign(d.y))
}

/// A polygon's corners in one piece: each corner at its copy nearest to a reference corner, the reference chosen so that the polygon is
/// compact and overhangs least. Gives the copies' numbers.
fn unfold(polygon: &[u32], places: &[Vec2]) -> [u8; 4] {
    let place = |k: usize| places[polygon[k] as usize];
    let nearest = |k: usize, reference: Vec2| {
        let distance = |c: &u8| COPIES[usize::from(*c)](place(k)).distance_squared(reference);
        (0..COPIES.len() as u8).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    let n = polygon.len();
    let options = (0..n).map(|r| std::array::from_fn(|k| if k < n { nearest(k, place(r)) } else { 0 }));
    let cost = |copies: &[u8; 4]| {
        let at = |k: usize| COPIES[usize::from(copies[k % n])](place(k % n));
        let span = (0..n).map(|k| at(k).distance(at(k + 1))).fold(0.0, f32::max);
        span + (0..n).map(|k| at(k).abs().max_element()).fold(1.0, f32::max)
    };
    options.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or([0; 4])
}
