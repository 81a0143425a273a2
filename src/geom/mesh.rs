//! A surface of triangles and quads that share vertices. She §3.2 uses both "with the intent of eliminating redundant vertices".

use glam::Vec3;

/// An axis-aligned box, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Bounds {
    /// The box around `points`, `None` when there are none.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        points.into_iter().fold(None, |b: Option<Self>, p| {
            Some(b.map_or(Self { min: p, max: p }, |b| Self { min: b.min.min(p), max: b.max.max(p) }))
        })
    }

    /// Edge lengths.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// At what height a tree with this box stands, metres. Trees stand at the origin, though a root may dip under it and a crown without its
    /// trunk hang over it; one that lies elsewhere, as files have it that centre theirs, stands on the lowest that there is of it.
    pub fn foot_y(&self) -> f32 {
        let high = self.size().y;
        if (-0.1 * high..=high).contains(&self.min.y) { 0.0 } else { self.min.y }
    }

    /// Height of a tree with this box above where it stands, metres, never 0: what distances and wind are measured in.
    pub fn height_m(&self) -> f32 {
        (self.max.y - self.foot_y()).max(1e-3)
    }

    /// Middle.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }
}

/// Vertices and the polygons over them, counter-clockwise seen from outside. Polygons are numbered triangles first, then quads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolyMesh {
    /// Vertex positions, metres, +Y up, +Z towards the photographer.
    pub positions: Vec<Vec3>,
    /// Triangles as vertex numbers.
    pub triangles: Vec<[u32; 3]>,
    /// Quads as vertex numbers; the diagonal between corners 0 and 2 splits them.
    pub quads: Vec<[u32; 4]>,
}

impl PolyMesh {
    /// Triangles and quads together.
    pub fn polygon_count(&self) -> usize {
        self.triangles.len() + self.quads.len()
    }

    /// The corners of one polygon: triangles are numbered first.
    pub fn polygon(&self, index: usize) -> &[u32] {
        match index.checked_sub(self.triangles.len()) {
            None => &self.triangles[index],
            Some(quad) => &self.quads[quad],
        }
    }

    /// All polygons in order.
    pub fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        self.triangles.iter().map(|t| &t[..]).chain(self.quads.iter().map(|q| &q[..]))
    }

    /// Every polygon as triangles: quads split along corners 0–2.
    pub fn triangulated(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().copied().chain(self.quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]))
    }

    /// The box around the vertices, `None` for an empty mesh.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of(self.positions.iter().copied())
    }

    /// Enclosed volume in m³, positive when the polygons face outward (divergence theorem).
    pub fn signed_volume(&self) -> f64 {
        let p = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangulated().map(|[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0).sum()
    }

    /// One unit normal per vertex: the sum of the incident triangles' normals, weighted by area.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        for t in self.triangulated() {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let area_normal = (b - a).cross(c - a);
            t.iter().for_each(|&i| normals[i as usize] += area_normal);
        }
        normals.iter().map(|n| n.normalize_or(Vec3::Y)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_as_high_as_it_stands_over_its_foot() {
        let height = |low: f32, high: f32| Bounds { min: Vec3::new(-1.0, low, -1.0), max: Vec3::new(1.0, high, 1.0) }.height_m();
        // At the origin: exactly, with a root under it, without its trunk.
        assert_eq!((height(0.0, 10.0), height(-0.3, 10.0), height(4.0, 10.0)), (10.0, 10.0, 10.0));
        assert_eq!((height(-50.0, -40.0), height(100.0, 110.0), height(-5.0, 5.0)), (10.0, 10.0, 10.0));
        assert!(height(0.0, 0.0) > 0.0 && height(-7.0, -7.0) > 0.0);
    }
}
