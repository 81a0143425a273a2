//! What a built tree costs, counted from its data and never told by the method (DESIGN §4).

use std::sync::Arc;

use image::RgbaImage;
use serde::Serialize;

use super::{BuiltPart, BuiltTree, Drawn};

/// What one level of a built tree costs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Stats {
    /// Triangles, quads counted as two.
    pub triangles: usize,
    /// Polygons, as the papers count them.
    pub polygons: usize,
    /// Vertices.
    pub vertices: usize,
    /// Parts, each of which is drawn by one call for all instances.
    pub draw_calls: usize,
    /// Pictures, each counted once.
    pub textures: usize,
    /// What they take on the device, uncompressed, with all their smaller sizes.
    pub texture_bytes: usize,
    /// What vertices (position, normal, texture coordinates) and corners of triangles take on the device.
    pub geometry_bytes: usize,
}

/// Bytes of a vertex and of a triangle's corners on the device.
const VERTEX_BYTES: usize = 32;
const TRIANGLE_BYTES: usize = 12;

impl Stats {
    /// What is seen at a distance.
    pub fn at(built: &BuiltTree, distance: f32) -> Self {
        let mut stats = Self::of(built.parts_at(distance));
        for BuiltPart { part, drawn, .. } in built.parts_at(distance) {
            if let Drawn::Forest(forest) = drawn {
                // All levels lie on the device; one is drawn.
                let (all, shown) = (part.surface.mesh.polygon_count(), forest.leaves_at(distance));
                stats.polygons -= all - shown;
                stats.triangles -= (part.surface.mesh.triangulated().count()).min(2 * (all - shown));
            }
        }
        stats
    }

    /// Everything that the tree holds.
    pub fn of_all(built: &BuiltTree) -> Self {
        Self::of(&built.parts)
    }

    /// Each level by name.
    pub fn of_levels(built: &BuiltTree) -> Vec<(String, Self)> {
        built.levels.iter().map(|level| (level.name.clone(), Self::at(built, level.distance))).collect()
    }

    fn of<'a>(parts: impl IntoIterator<Item = &'a BuiltPart>) -> Self {
        let mut stats = Self::default();
        let mut pictures: Vec<&Arc<RgbaImage>> = vec![];
        for BuiltPart { part, drawn, .. } in parts {
            let mesh = &part.surface.mesh;
            let triangles = mesh.triangles.len() + 2 * mesh.quads.len();
            stats.triangles += triangles;
            stats.polygons += mesh.polygon_count();
            stats.vertices += mesh.positions.len();
            stats.draw_calls += 1;
            stats.geometry_bytes += match drawn {
                Drawn::Forest(forest) => forest.device_bytes(),
                _ => VERTEX_BYTES * mesh.positions.len() + TRIANGLE_BYTES * triangles,
            };
            for picture in [&part.material.texture, &part.material.normal_texture].into_iter().flatten() {
                if !pictures.iter().any(|known| Arc::ptr_eq(known, picture)) {
                    pictures.push(picture);
                }
            }
        }
        stats.textures = pictures.len();
        stats.texture_bytes = pictures.iter().map(|picture| bytes_with_mips(picture.dimensions())).sum();
        stats
    }
}

/// 4 bytes a texel, down to one texel.
fn bytes_with_mips((mut width, mut height): (u32, u32)) -> usize {
    let mut bytes = 0;
    loop {
        bytes += 4 * width as usize * height as usize;
        if width <= 1 && height <= 1 {
            return bytes;
        }
        (width, height) = ((width / 2).max(1), (height / 2).max(1));
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn mips_add_a_third() {
        assert_eq!(super::bytes_with_mips((4, 4)), 4 * (16 + 4 + 1));
        assert_eq!(super::bytes_with_mips((4, 1)), 4 * (4 + 2 + 1));
        assert_eq!(super::bytes_with_mips((0, 0)), 0);
    }
}
