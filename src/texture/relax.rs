//! Relaxing the chart: polygons pull their corners towards their own flattened shape (as rigid as possible, Liu et al. 2008, "A
//! local/global approach to mesh parameterization", by averaging instead of a linear solve).
//!
//! The octahedral start shears along its creases and knows nothing of the crown's lobes; relaxing spreads the texels evenly.

use glam::Vec2;
use rayon::prelude::*;

use super::chart::{COPIES, INVERSE};
use super::flat::FlatMesh;
use crate::geom::PolyMesh;

/// Rounds of averaging; with momentum they carry across a medium crown.
const ROUNDS: usize = 120;
const MOMENTUM: f32 = 0.88;

/// Moves `places` (chart coordinates per vertex) in place. `copies` says at which copy of its vertex each polygon corner lies; vertices
/// in `pinned` stay. Relaxes less, or not at all, where that would turn polygons over that were not.
pub(super) fn relax(mesh: &PolyMesh, flat: &FlatMesh, places: &mut Vec<Vec2>, copies: &[[u8; 4]], pinned: &[usize]) {
    let scale = (4.0 / flat.area).sqrt() as f32;
    let start = places.clone();
    let mut previous = places.clone();
    for _ in 0..ROUNDS {
        let wishes: Vec<[Vec2; 4]> =
            (0..copies.len()).into_par_iter().with_min_len(256).map(|p| wish(mesh, flat, places, copies, p, scale)).collect();
        let mut sums = vec![(Vec2::ZERO, 0.0f32); places.len()];
        for (p, polygon) in mesh.polygons().enumerate() {
            let weight = flat.flats[p].area.max(1e-12);
            for (k, &v) in polygon.iter().enumerate() {
                let back = COPIES[INVERSE[usize::from(copies[p][k])]](wishes[p][k]);
                sums[v as usize].0 += weight * back;
                sums[v as usize].1 += weight;
            }
        }
        for (v, (sum, weight)) in sums.iter().enumerate().filter(|s| s.1.1 > 0.0) {
            if !pinned.contains(&v) {
                let next = *sum / *weight + MOMENTUM * (places[v] - previous[v]);
                previous[v] = places[v];
                places[v] = next;
            }
        }
    }
    // Back halfway, and again, while more polygons are turned over than at first.
    let allowed = turned(mesh, &start, copies);
    for _ in 0..4 {
        if places.iter().all(|p| p.is_finite()) && turned(mesh, places, copies) <= allowed {
            return;
        }
        places.iter_mut().zip(&start).for_each(|(p, s)| *p = if p.is_finite() { p.midpoint(*s) } else { *s });
    }
    *places = start;
}

/// Where a polygon would like its corners: its flattened shape, turned and moved onto where they are.
fn wish(mesh: &PolyMesh, flat: &FlatMesh, places: &[Vec2], copies: &[[u8; 4]], p: usize, scale: f32) -> [Vec2; 4] {
    let (polygon, shape) = (mesh.polygon(p), &flat.flats[p]);
    let n = polygon.len();
    let at = |k: usize| COPIES[usize::from(copies[p][k])](places[polygon[k] as usize]);
    let middle = (0..n).map(at).sum::<Vec2>() / n as f32;
    let rest = shape.middle();
    let turn = (0..n).map(|k| {
        let (a, b) = (shape.corners[k] - rest, at(k) - middle);
        Vec2::new(a.dot(b), a.perp_dot(b))
    });
    let turn = scale * turn.sum::<Vec2>().normalize_or(Vec2::X);
    std::array::from_fn(|k| middle + turn.rotate(shape.corners[k.min(n - 1)] - rest))
}

/// Polygons that the chart turns over.
pub(super) fn turned(mesh: &PolyMesh, places: &[Vec2], copies: &[[u8; 4]]) -> usize {
    let over = |(p, polygon): &(usize, &[u32])| {
        let at = |k: usize| COPIES[usize::from(copies[*p][k])](places[polygon[k] as usize]);
        (1..polygon.len() - 1).any(|k| (at(k) - at(0)).perp_dot(at(k + 1) - at(0)) <= 0.0)
    };
    mesh.polygons().enumerate().filter(over).count()
}
