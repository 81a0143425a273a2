//! Edge adjacency of a polygon mesh, and whether it is closed, manifold, oriented and of genus 0.

use std::collections::BTreeMap;

use super::PolyMesh;

/// For every undirected edge `(low, high)`, the polygons on it and the direction each walks it (`true`: low → high).
#[derive(Debug, Clone)]
pub struct Edges {
    /// Sorted, so that walking it is deterministic.
    pub polygons: BTreeMap<(u32, u32), Vec<(usize, bool)>>,
}

impl Edges {
    /// Collects the edges of `mesh`.
    pub fn of(mesh: &PolyMesh) -> Self {
        let mut polygons: BTreeMap<(u32, u32), Vec<(usize, bool)>> = BTreeMap::new();
        for (index, polygon) in mesh.polygons().enumerate() {
            for (k, &a) in polygon.iter().enumerate() {
                let b = polygon[(k + 1) % polygon.len()];
                polygons.entry((a.min(b), a.max(b))).or_default().push((index, a < b));
            }
        }
        Self { polygons }
    }

    /// The polygon across the edge `a`–`b` from `polygon`; `None` at a border or where more than two meet.
    pub fn across(&self, a: u32, b: u32, polygon: usize) -> Option<usize> {
        match self.polygons.get(&(a.min(b), a.max(b)))?.as_slice() {
            [(p, _), (q, _)] if *p == polygon => Some(*q),
            [(p, _), (q, _)] if *q == polygon => Some(*p),
            _ => None,
        }
    }
}

/// What the polygons say about the surface, whatever its shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topology {
    /// Every edge has exactly two polygons.
    pub closed: bool,
    /// No edge has more than two polygons, and the polygons round every vertex form one fan.
    pub manifold: bool,
    /// The two polygons of every edge walk it in opposite directions.
    pub oriented: bool,
    /// Vertices − edges + polygons; 2 for a sphere.
    pub euler: i64,
}

impl Topology {
    /// Measures `mesh`. Vertices that no polygon uses count into `euler`, so a stray vertex shows.
    pub fn of(mesh: &PolyMesh) -> Self {
        let edges = Edges::of(mesh);
        let on_edge = || edges.polygons.values();
        Self {
            closed: on_edge().all(|p| p.len() == 2),
            manifold: on_edge().all(|p| p.len() <= 2) && one_fan_per_vertex(mesh, &edges),
            oriented: on_edge().all(|p| p.len() != 2 || p[0].1 != p[1].1),
            euler: mesh.positions.len() as i64 - edges.polygons.len() as i64 + mesh.polygon_count() as i64,
        }
    }

    /// Closed, manifold, oriented and without handles: what a crown must be.
    pub fn is_sphere(&self) -> bool {
        self.closed && self.manifold && self.oriented && self.euler == 2
    }
}

/// Whether the polygons around every vertex are connected through edges at that vertex.
fn one_fan_per_vertex(mesh: &PolyMesh, edges: &Edges) -> bool {
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); mesh.positions.len()];
    for (index, polygon) in mesh.polygons().enumerate() {
        polygon.iter().for_each(|&v| around[v as usize].push(index));
    }
    around.iter().enumerate().filter(|(_, polygons)| !polygons.is_empty()).all(|(vertex, polygons)| {
        let mut reached = vec![polygons[0]];
        let mut next = 0;
        while let Some(&polygon) = reached.get(next) {
            next += 1;
            let corners = mesh.polygon(polygon);
            let k = corners.iter().position(|&v| v as usize == vertex).expect("the polygon was listed for this vertex");
            for other in [corners[(k + 1) % corners.len()], corners[(k + corners.len() - 1) % corners.len()]] {
                if let Some(q) = edges.across(vertex as u32, other, polygon)
                    && !reached.contains(&q)
                {
                    reached.push(q);
                }
            }
        }
        reached.len() == polygons.len()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cube() -> PolyMesh {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        PolyMesh {
            positions: (0..8).map(corner).collect(),
            triangles: vec![],
            quads: vec![[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
        }
    }

    #[test]
    fn a_cube_is_a_sphere_and_faces_outward() {
        assert!(Topology::of(&cube()).is_sphere());
        assert!((cube().signed_volume() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn faults_are_noticed() {
        let mut open = cube();
        open.quads.pop();
        assert!(!Topology::of(&open).closed);
        let mut flipped = cube();
        flipped.quads[0].reverse();
        assert!(!Topology::of(&flipped).oriented);
        let mut twice = cube();
        twice.quads.push(twice.quads[0]);
        assert!(!Topology::of(&twice).manifold);
        let mut stray = cube();
        stray.positions.push(Vec3::ZERO);
        assert!(!Topology::of(&stray).is_sphere());
    }
}
