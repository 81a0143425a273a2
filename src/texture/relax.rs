//! Relaxing the chart: polygons pull their corners towards their own flattened shape (as rigid as possible, Liu et al. 2008, "A
//! local/global approach to mesh parameterization", by averaging instead of a linear solve).
//!
//! The octahedral start shears along its creases and knows nothing of the crown's lobes; relaxing spreads the texels evenly.

use glam::Vec2;
use rayon::prelude::*;

use super::chart::COPIES;
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
    let plates: Vec<Plate> = (0..copies.len()).map(|p| Plate::of(mesh, flat, copies, p, scale)).collect();
    let mut weights = vec![0.0f32; places.len()];
    plates.iter().for_each(|plate| plate.corners().iter().for_each(|c| weights[c.vertex] += plate.weight));
    pinned.iter().for_each(|&v| weights[v] = 0.0);
    // Inside the pool from the start: over a hundred short rounds must not each wake it.
    rayon::scope(|_| {
        let mut previous = places.clone();
        let mut wishes = vec![[Vec2::ZERO; 4]; plates.len()];
        let mut sums = vec![Vec2::ZERO; places.len()];
        for _ in 0..ROUNDS {
            plates.par_iter().zip(&mut wishes).with_min_len(256).for_each(|(plate, wish)| *wish = plate.wish(places));
            sums.fill(Vec2::ZERO);
            for (plate, wish) in plates.iter().zip(&wishes) {
                plate.corners().iter().zip(wish).for_each(|(c, w)| sums[c.vertex] += plate.weight * *w);
            }
            for v in (0..places.len()).filter(|&v| weights[v] > 0.0) {
                let next = sums[v] / weights[v] + MOMENTUM * (places[v] - previous[v]);
                previous[v] = std::mem::replace(&mut places[v], next);
            }
        }
    });
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

/// A polygon's flattened shape at the chart's scale, and how its corners hang on the vertices.
struct Plate {
    corners: [Corner; 4],
    count: usize,
    weight: f32,
}

#[derive(Clone, Copy)]
struct Corner {
    vertex: usize,
    /// The copy of the vertex that it lies at is `sign` × its place + `shift`.
    sign: f32,
    shift: Vec2,
    /// From the middle of the shape.
    rest: Vec2,
}

impl Plate {
    fn of(mesh: &PolyMesh, flat: &FlatMesh, copies: &[[u8; 4]], p: usize, scale: f32) -> Self {
        let (polygon, shape) = (mesh.polygon(p), &flat.flats[p]);
        let corners = std::array::from_fn(|k| {
            let k = k.min(polygon.len() - 1);
            let copy = COPIES[usize::from(copies[p][k])];
            let shift = copy(Vec2::ZERO);
            let rest = scale * (shape.corners[k] - shape.middle());
            Corner { vertex: polygon[k] as usize, sign: (copy(Vec2::X) - shift).x, shift, rest }
        });
        Self { corners, count: polygon.len(), weight: shape.area.max(1e-12) }
    }

    fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    /// Where the polygon would like its vertices: its shape, turned and moved onto where they are.
    fn wish(&self, places: &[Vec2]) -> [Vec2; 4] {
        let at = self.corners.map(|c| c.sign * places[c.vertex] + c.shift);
        let middle = at[..self.count].iter().sum::<Vec2>() / self.count as f32;
        let turn = self.corners().iter().zip(at).map(|(c, at)| Vec2::new(c.rest.dot(at - middle), c.rest.perp_dot(at - middle)));
        let turn = turn.sum::<Vec2>().normalize_or(Vec2::X);
        self.corners.map(|c| c.sign * (middle + turn.rotate(c.rest) - c.shift))
    }
}

/// Polygons that the chart turns over.
pub(super) fn turned(mesh: &PolyMesh, places: &[Vec2], copies: &[[u8; 4]]) -> usize {
    let over = |(p, polygon): &(usize, &[u32])| {
        let at = |k: usize| COPIES[usize::from(copies[*p][k])](places[polygon[k] as usize]);
        (1..polygon.len() - 1).any(|k| (at(k) - at(0)).perp_dot(at(k + 1) - at(0)) <= 0.0)
    };
    mesh.polygons().enumerate().filter(over).count()
}
