//! A drawable surface: vertices with normal and texture coordinate, split where the chart is cut.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

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
