//! A drawable surface: vertices with normal and texture coordinate, split where the chart is cut.

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
}
