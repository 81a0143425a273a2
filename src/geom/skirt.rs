//! What goes on beyond the edge of ground: from there the land evens out and falls away to the horizon. Metres.

use glam::Vec3;

use super::{GroundMesh, HeightField};

/// How far the skirt reaches beyond the edge, metres: what is farther off is thinner than a pixel.
const REACH_M: f32 = 20_000.0;
/// How far it has fallen there, metres.
const FALL_M: f32 = 40.0;
/// Rings over which it evens out; beyond, each is this many times as far from the edge as the one before.
const EVENING_RINGS: usize = 6;
const FARTHER: f32 = 8.0;

/// A skirt around ground, with the ground's own points and normals along its edge, so that no seam is seen.
pub fn skirt(ground: &HeightField) -> GroundMesh {
    let mesh = ground.mesh();
    let edge: Vec<usize> = edge_of(ground.columns as usize, ground.rows as usize).collect();
    let height = |&at: &usize| mesh.positions[at].y;
    let mean = edge.iter().map(height).sum::<f32>() / edge.len() as f32;
    let unevenness = edge.iter().map(|at| (height(at) - mean).abs()).fold(0.0, f32::max);
    let half = 0.5 * ground.bounds().size();
    let even_m = (0.6 * half.x.max(half.z)).max(6.0 * unevenness);
    let away = away_m(even_m);
    let place = |from: Vec3, away_m: f32| {
        let center = ground.bounds().center();
        let wider = |at: f32, center: f32, half: f32| center + (at - center) * (1.0 + away_m / half);
        let left = 1.0 - smooth(away_m / even_m);
        let y = mean + left * (from.y - mean) - FALL_M * away_m / away[away.len() - 1];
        Vec3::new(wider(from.x, center.x, half.x), y, wider(from.z, center.z, half.z))
    };
    let around = edge.len();
    let positions: Vec<Vec3> = away
        .iter()
        .flat_map(|&away_m| edge.iter().map(move |&at| (at, away_m)))
        .map(|(at, m)| place(mesh.positions[at], m))
        .collect();
    let at = |ring: usize, i: usize| ring * around + i % around;
    let normal = |(ring, i): (usize, usize)| match ring {
        0 => mesh.normals[edge[i]],
        _ => {
            let out = positions[at((ring + 1).min(away.len() - 1), i)] - positions[at(ring - 1, i)];
            let on = positions[at(ring, i + 1)] - positions[at(ring, i + around - 1)];
            out.cross(on).normalize_or(Vec3::Y)
        }
    };
    let normals = (0..away.len()).flat_map(|ring| (0..around).map(move |i| (ring, i))).map(normal).collect();
    let quads = (0..away.len() - 1).flat_map(|ring| (0..around).map(move |i| (ring, i)));
    let corners = quads.map(|(ring, i)| [at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)].map(|at| at as u32));
    let indices = corners.flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).collect();
    GroundMesh { positions, normals, indices }
}

/// How far the rings lie from the edge, the edge first.
fn away_m(even_m: f32) -> Vec<f32> {
    let evening = (0..=EVENING_RINGS).map(|ring| even_m * ring as f32 / EVENING_RINGS as f32);
    let beyond = std::iter::successors(Some(FARTHER * even_m), |away_m| Some(FARTHER * away_m));
    let last = REACH_M.max(2.0 * even_m);
    evening.chain(beyond.take_while(|away_m| *away_m < last)).chain([last]).collect()
}

/// The points along the edge of a grid, row by row from the north-west corner, counter-clockwise seen from above.
fn edge_of(columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let at = move |column: usize, row: usize| row * columns + column;
    let (east, south) = (columns - 1, rows - 1);
    let west_side = (0..south).map(move |row| at(0, row));
    let south_side = (0..east).map(move |column| at(column, south));
    let east_side = (1..=south).rev().map(move |row| at(east, row));
    let north_side = (1..=east).rev().map(move |column| at(column, 0));
    west_side.chain(south_side).chain(east_side).chain(north_side)
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_skirt_begins_on_the_edge_lies_open_to_the_sky_and_reaches_the_horizon(
            columns in 2u32..9, rows in 2u32..9, step_m in 0.01f32..900.0, heights in prop::collection::vec(-50.0f32..50.0, 1..60),
        ) {
            let heights = (0..columns * rows).map(|i| heights[i as usize % heights.len()]).collect();
            let ground = HeightField::new(columns, rows, step_m, -30.0, 70.0, heights).unwrap();
            let (mesh, skirt) = (ground.mesh(), skirt(&ground));
            let around = 2 * (columns + rows) as usize - 4;
            prop_assert_eq!(skirt.positions.len() % around, 0);
            for (place, normal) in skirt.positions.iter().zip(&skirt.normals).take(around) {
                let same = mesh.positions.iter().position(|p| (*p - *place).length() < 1e-3 * (1.0 + step_m)).unwrap();
                prop_assert_eq!(mesh.normals[same], *normal);
            }
            for corners in skirt.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|i| skirt.positions[corners[i] as usize]);
                prop_assert!((b - a).cross(c - a).y > 0.0, "seen from above");
            }
            prop_assert!(skirt.normals.iter().all(|n| n.y > 0.0 && (n.length() - 1.0).abs() < 1e-4));
            let (bounds, all) = (ground.bounds(), crate::geom::Bounds::of(skirt.positions.iter().copied()).unwrap());
            prop_assert!(bounds.min.x - all.min.x > 0.99 * REACH_M && all.max.z - bounds.max.z > 0.99 * REACH_M);
        }
    }
}
