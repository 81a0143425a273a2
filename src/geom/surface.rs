//! A drawable surface: vertices with normal and texture coordinate, split where the chart is cut.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3, Vec4};

use super::PolyMesh;

/// A polygon mesh as a renderer or a file takes it. Vertices that share a place but not a texture coordinate stand side by side with
/// bit-identical positions, so that merging equal positions gives the closed mesh back.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Polygons over `positions` (metres).
    pub mesh: PolyMesh,
    /// Unit normals, one per vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex, glTF convention: (0, 0) is the top left corner of the image. Empty when untextured.
    pub uvs: Vec<Vec2>,
    /// Colours that multiply the material's, one per vertex: linear light, straight alpha. Empty when the material says it all.
    pub colors: Vec<[f32; 4]>,
}

impl Surface {
    /// Adds the polygons of `other`, which has texture coordinates if this one has, with its vertices behind the others. Missing colours
    /// become white.
    ///
    /// # Panics
    /// When the vertices together are too many to be numbered by 32 bits.
    pub fn append(&mut self, other: Self) {
        let (count, more) = (self.mesh.positions.len(), other.mesh.positions.len());
        let first =
            u32::try_from(count).ok().filter(|_| u32::try_from(count + more).is_ok()).expect("vertices numbered by 32 bits");
        self.mesh.triangles.extend(other.mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        self.mesh.quads.extend(other.mesh.quads.iter().map(|q| q.map(|v| v + first)));
        self.mesh.positions.extend(other.mesh.positions);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        if !self.colors.is_empty() || !other.colors.is_empty() {
            self.colors.resize(count, [1.0; 4]);
            self.colors.extend(other.colors);
            self.colors.resize(count + more, [1.0; 4]);
        }
    }

    /// Unit tangents as glTF has them, one per vertex: along growing u, and in `w` the sign that gives the bitangent, sign · normal × tangent,
    /// along falling v (glTF's v points down). After Lengyel 2001, weighted by area. Where a chart says nothing, any direction across the
    /// normal; empty when untextured.
    ///
    /// # Panics
    /// When a polygon names a vertex that is not there.
    pub fn tangents(&self) -> Vec<Vec4> {
        if self.uvs.len() != self.mesh.positions.len() || self.normals.len() != self.uvs.len() {
            return Vec::new();
        }
        let mut along = vec![(Vec3::ZERO, Vec3::ZERO); self.uvs.len()];
        for corners in self.mesh.triangulated() {
            let [a, b, c] = corners.map(|v| (self.mesh.positions[v as usize], self.uvs[v as usize]));
            let ((p, q), (s, t)) = ((b.0 - a.0, c.0 - a.0), (b.1 - a.1, c.1 - a.1));
            // Of length area, whatever the chart's scale: a stretched texel has no more say.
            let turn = s.perp_dot(t).signum() * p.cross(q).length();
            let (u, v) = ((p * t.y - q * s.y).normalize_or_zero(), (q * s.x - p * t.x).normalize_or_zero());
            for corner in corners {
                let (sum_u, sum_v) = &mut along[corner as usize];
                *sum_u += turn * u;
                *sum_v += turn * v;
            }
        }
        let tangent = |(&(u, v), &normal): (&(Vec3, Vec3), &Vec3)| {
            let across = (u - u.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
            let sign = if normal.cross(across).dot(v) > 0.0 { -1.0 } else { 1.0 };
            across.extend(sign)
        };
        along.iter().zip(&self.normals).map(tangent).collect()
    }

    /// The mesh with vertices of bit-identical position merged: the cuts of the chart closed again.
    ///
    /// # Panics
    /// When a polygon names a vertex that is not there.
    pub fn welded(&self) -> PolyMesh {
        let mut numbers = BTreeMap::new();
        let mut positions = Vec::new();
        let mut number = |v: u32| {
            let p = self.mesh.positions[v as usize];
            *numbers.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        };
        let triangles = self.mesh.triangles.iter().map(|t| t.map(&mut number)).collect();
        let quads = self.mesh.quads.iter().map(|q| q.map(&mut number)).collect();
        PolyMesh { triangles, quads, positions }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A card whose picture stands upright on it, and the same mirrored.
    fn card(mirrored: bool) -> Surface {
        let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, 3.0), (-1.0, 3.0)];
        let u = |x: f32| if mirrored { 0.5 - 0.5 * x } else { 0.5 + 0.5 * x };
        Surface {
            mesh: PolyMesh {
                positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
                quads: vec![[0, 1, 2, 3]],
                ..PolyMesh::default()
            },
            normals: vec![Vec3::Z; 4],
            uvs: corners.map(|(x, y)| Vec2::new(u(x), 1.0 - y / 3.0)).to_vec(),
            ..Surface::default()
        }
    }

    #[test]
    fn tangents_follow_u_and_their_sign_gives_the_pictures_upright() {
        for (mirrored, right) in [(false, Vec3::X), (true, Vec3::NEG_X)] {
            let surface = card(mirrored);
            for tangent in surface.tangents() {
                assert!((tangent.truncate() - right).length() < 1e-6, "{tangent}");
                let bitangent = tangent.w * Vec3::Z.cross(tangent.truncate());
                assert!((bitangent - Vec3::Y).length() < 1e-6, "the picture stands upright: {bitangent}");
            }
        }
    }

    #[test]
    fn tangents_are_of_unit_length_even_where_the_chart_says_nothing() {
        let mut surface = card(false);
        surface.uvs = vec![Vec2::ZERO; 4];
        assert!(surface.tangents().iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-6 && t.w.abs() == 1.0));
        surface.uvs.clear();
        assert!(surface.tangents().is_empty());
    }
}
