//! What counts as a leaf: every polygon of a foliage surface, first its triangles, then its quads, in their order. A triangle is a leaf
//! whose last corner stands twice. A bent or crossed leaf of several polygons counts as several.

use glam::{Vec2, Vec3};

use super::LeafId;
use super::forest::{Forest, LeafShape};
use super::resolution::Resolution;
use super::simplify::Blade;
use crate::geom::{PolyMesh, Surface};

/// Vertex numbers of a leaf.
pub fn corners(mesh: &PolyMesh, leaf: u32) -> [u32; 4] {
    match (leaf as usize).checked_sub(mesh.triangles.len()) {
        Some(quad) => mesh.quads[quad],
        None => {
            let [a, b, c] = mesh.triangles[leaf as usize];
            [a, b, c, c]
        }
    }
}

/// Places of a leaf's corners, metres.
pub fn places(mesh: &PolyMesh, leaf: u32) -> [Vec3; 4] {
    corners(mesh, leaf).map(|v| mesh.positions[v as usize])
}

/// All leaves of a surface.
pub fn blades(surface: &Surface) -> Vec<Blade> {
    let blade = |leaf| {
        let corners = corners(&surface.mesh, leaf);
        let place = |v: u32| surface.mesh.positions[v as usize];
        let normal = |v: u32| surface.normals.get(v as usize).copied().unwrap_or(Vec3::Y);
        Blade { corners: corners.map(place), normals: corners.map(normal) }
    };
    (0..surface.mesh.polygon_count() as u32).map(blade).collect()
}

/// A corner of a leaf as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnCorner {
    /// Object space, metres.
    pub position: Vec3,
    /// Unit length.
    pub normal: Vec3,
    /// Of the picture that it wears.
    pub uv: Vec2,
    /// Multiplies the material's.
    pub color: [f32; 4],
}

/// The corners of a leaf: places and normals of its own, picture and colour of the original that it wears.
pub fn drawn(surface: &Surface, shape: &LeafShape) -> [DrawnCorner; 4] {
    let worn = corners(&surface.mesh, shape.wears);
    std::array::from_fn(|k| {
        let at = shape.corners[k];
        let own = corners(&surface.mesh, at.leaf)[usize::from(at.corner)] as usize;
        let normal = surface.normals.get(own).copied().unwrap_or(Vec3::Y);
        DrawnCorner {
            position: surface.mesh.positions[own],
            normal: if at.turned { -normal } else { normal },
            uv: surface.uvs.get(worn[k] as usize).copied().unwrap_or_default(),
            color: surface.colors.get(worn[k] as usize).copied().unwrap_or([1.0; 4]),
        }
    })
}

/// The foliage at a level of detail as a plain surface. The original comes back as it was; else every leaf that stands for several has four
/// vertices of its own, behind those of the originals that are still there.
pub fn surface_at(surface: &Surface, forest: &Forest, resolution: &Resolution) -> Surface {
    if resolution.shown() == forest.leaves() {
        return surface.clone();
    }
    let mut made = vec![];
    let mut kept = vec![];
    for cluster in 0..forest.clusters() as u32 {
        for number in forest.shown(cluster, resolution.collapsed(cluster)) {
            let shape = forest.shape(LeafId { cluster, number });
            if usize::from(number) < forest.size(cluster) { kept.push(shape.wears) } else { made.push(shape) }
        }
    }
    kept.sort_unstable();
    let mut out = Surface::default();
    let mut number_of = vec![u32::MAX; surface.mesh.positions.len()];
    let mut vertex = |out: &mut Surface, v: u32| {
        let number = &mut number_of[v as usize];
        if *number == u32::MAX {
            *number = out.mesh.positions.len() as u32;
            out.mesh.positions.push(surface.mesh.positions[v as usize]);
            out.normals.extend(surface.normals.get(v as usize));
            out.uvs.extend(surface.uvs.get(v as usize));
            out.colors.extend(surface.colors.get(v as usize));
        }
        *number
    };
    for leaf in kept {
        match (leaf as usize).checked_sub(surface.mesh.triangles.len()) {
            Some(quad) => {
                let quad = surface.mesh.quads[quad].map(|v| vertex(&mut out, v));
                out.mesh.quads.push(quad);
            }
            None => {
                let triangle = surface.mesh.triangles[leaf as usize].map(|v| vertex(&mut out, v));
                out.mesh.triangles.push(triangle);
            }
        }
    }
    for shape in made {
        let first = out.mesh.positions.len() as u32;
        for corner in drawn(surface, &shape) {
            out.mesh.positions.push(corner.position);
            out.normals.push(corner.normal);
            if !surface.uvs.is_empty() {
                out.uvs.push(corner.uv);
            }
            if !surface.colors.is_empty() {
                out.colors.push(corner.color);
            }
        }
        out.mesh.quads.push([first, first + 1, first + 2, first + 3]);
    }
    out
}

/// Foliage of that many leaves for measurements and tests: quads of a hand's size all over an egg-shaped crown 10 m high, denser
/// outside, turned any way.
pub fn synthetic(leaves: usize, seed: crate::Seed) -> Surface {
    let mut surface = Surface::default();
    // As many leaves as there are, so large that the crown is as dense.
    let side = 3.0 * (leaves.max(1) as f32).powf(-1.0 / 3.0);
    for leaf in 0..leaves {
        let mut draws = seed.keyed("synthetic-foliage", leaf as u64);
        let mut direction =
            || Vec3::from([draws.signed() as f32, draws.signed() as f32, draws.signed() as f32]).normalize_or(Vec3::Y);
        let (out, along, face) = (direction(), direction(), direction());
        let radius = (draws.unit() as f32).powf(0.25);
        let center = Vec3::new(0.0, 6.0, 0.0) + radius * out * Vec3::new(3.0, 4.0, 3.0);
        let right = along.cross(face).normalize_or(Vec3::X);
        let normal = right.cross(along);
        let first = surface.mesh.positions.len() as u32;
        for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            surface.mesh.positions.push(center + side * 0.5 * (x * right + y * along));
            surface.normals.push(normal);
            surface.uvs.push(Vec2::new(0.5 + x, 0.5 - y));
        }
        surface.mesh.quads.push([first, first + 1, first + 2, first + 3]);
    }
    surface
}
