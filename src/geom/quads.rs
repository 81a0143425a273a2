//! Merging triangle pairs into quads, "with the intent of eliminating redundant vertices" (She §3.2; table 1: 56 triangles and
//! 2,124 quads). Greedy: the flattest and squarest pair first, ties by edge number, so the result depends on nothing else.

use glam::Vec3;

use super::{Edges, PolyMesh};

/// Which pairs may become a quad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadRules {
    /// Largest angle between the normals of the two triangles, radians.
    pub fold_rad: f64,
    /// Largest corner of the quad, radians; below π it is convex.
    pub corner_rad: f64,
}

/// Replaces triangle pairs of `mesh` by quads. The shared edge becomes the diagonal between corners 0 and 2, so that
/// [`PolyMesh::triangulated`] gives the same surface as before. Existing quads are kept.
///
/// `shapes` are one or more sets of positions for the same polygons: the first ranks the pairs, and all must satisfy the rules.
pub fn pair_into_quads(mesh: &PolyMesh, shapes: &[&[Vec3]], rules: QuadRules) -> PolyMesh {
    let edges = Edges::of(mesh);
    let triangle_count = mesh.triangles.len();
    let mut pairs: Vec<(f64, [usize; 2], [u32; 4])> = Vec::new();
    for (&(low, high), sides) in &edges.polygons {
        let [(p, _), (q, _)] = sides[..] else { continue };
        if p >= triangle_count || q >= triangle_count {
            continue;
        }
        let quad = joined(mesh.triangles[p], mesh.triangles[q], low, high);
        let costs: Option<Vec<f64>> = shapes.iter().map(|positions| cost(positions, quad, rules)).collect();
        if let Some(&first) = costs.as_ref().and_then(|c| c.first()) {
            pairs.push((first, [p, q], quad));
        }
    }
    // A stable sort over edges in order: equal costs are settled by edge number.
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = vec![false; triangle_count];
    let mut quads = mesh.quads.clone();
    for (_, [p, q], quad) in pairs {
        if !taken[p] && !taken[q] {
            (taken[p], taken[q]) = (true, true);
            quads.push(quad);
        }
    }
    let triangles = mesh.triangles.iter().zip(&taken).filter(|(_, taken)| !**taken).map(|(t, _)| *t).collect();
    PolyMesh { positions: mesh.positions.clone(), triangles, quads }
}

/// The quad of two triangles over the edge `low`–`high`: corners 0 and 2 are the edge's ends, and it starts where `p` walks the edge.
fn joined(p: [u32; 3], q: [u32; 3], low: u32, high: u32) -> [u32; 4] {
    let apex = |t: [u32; 3]| t.into_iter().find(|&v| v != low && v != high).expect("a triangle has a corner off its edge");
    let k = p.iter().position(|&v| v == apex(p)).expect("the apex is a corner");
    [p[(k + 1) % 3], apex(q), p[(k + 2) % 3], apex(p)]
}

/// How far the quad is from a flat square: 0 is perfect, `None` is against the rules.
fn cost(positions: &[Vec3], quad: [u32; 4], rules: QuadRules) -> Option<f64> {
    let [a, b, c, d] = quad.map(|i| positions[i as usize].as_dvec3());
    let (one, two) = ((b - a).cross(c - a), (c - a).cross(d - a));
    let fold = one.angle_between(two);
    let around = [d, a, b, c, d, a];
    // In a folded quad the angle beyond π hides; the normals of a corner against the mean normal show it.
    let normal = one.normalize_or_zero() + two.normalize_or_zero();
    let corner = |k: usize| {
        let (before, here, after) = (around[k - 1] - around[k], around[k], around[k + 1]);
        let angle = before.angle_between(after - here);
        if (after - here).cross(before).dot(normal) > 0.0 { angle } else { std::f64::consts::TAU - angle }
    };
    let corners = [corner(1), corner(2), corner(3), corner(4)];
    let widest = corners.iter().fold(0.0f64, |m, &c| m.max(c));
    let skew = corners.iter().fold(0.0f64, |m, &c| m.max((c - std::f64::consts::FRAC_PI_2).abs()));
    (fold <= rules.fold_rad && widest <= rules.corner_rad).then_some(fold + skew)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Topology;

    const RULES: QuadRules = QuadRules { fold_rad: 0.5, corner_rad: 2.8 };

    fn cube_of_triangles() -> PolyMesh {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mesh = PolyMesh { positions: (0..8).map(corner).collect(), triangles: vec![], quads: faces.to_vec() };
        PolyMesh { triangles: mesh.triangulated().collect(), quads: vec![], ..mesh }
    }

    #[test]
    fn a_triangulated_cube_becomes_six_quads_of_the_same_volume() {
        let cube = cube_of_triangles();
        let merged = pair_into_quads(&cube, &[&cube.positions], RULES);
        assert_eq!((merged.triangles.len(), merged.quads.len()), (0, 6));
        assert!(Topology::of(&merged).is_sphere());
        assert!((merged.signed_volume() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_split_quads_are_the_old_triangles() {
        let cube = cube_of_triangles();
        let merged = pair_into_quads(&cube, &[&cube.positions], RULES);
        let canonical = |m: &PolyMesh| {
            let mut all: Vec<[u32; 3]> = m.triangulated().collect();
            all.iter_mut().for_each(|t| {
                let least = (0..3).min_by_key(|&k| t[k]).unwrap();
                t.rotate_left(least);
            });
            all.sort_unstable();
            all
        };
        assert_eq!(canonical(&cube), canonical(&merged));
    }

    #[test]
    fn a_dart_is_not_a_quad() {
        let positions = [(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec();
        let mesh = PolyMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], quads: vec![] };
        assert_eq!(pair_into_quads(&mesh, &[&mesh.positions], RULES).quads.len(), 0);
    }
}
