//! One primitive of a mesh (glTF 2.0, 3.7.2) to a surface: lists, strips and fans to triangles, in the place that its node gives it.

use glam::{Affine2, DMat3, DMat4, DVec3, Vec2, Vec3};

use super::bytes::Elements;
use super::schema::{Document, Primitive};
use super::{Bytes, Spent, broken};
use crate::Result;
use crate::geom::{PolyMesh, Surface};
use crate::model::import::Warnings;

/// What a primitive costs beside its vertices, in vertices.
const PRIMITIVE_COST: usize = 32;

const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// A primitive and where to read it from.
pub struct Geometry<'a> {
    pub document: &'a Document,
    pub bytes: &'a Bytes<'a>,
    pub primitive: &'a Primitive,
}

impl Geometry<'_> {
    /// The surface in world space, with the texture coordinates that `placement` asks for; `None` for points and lines, and where
    /// every triangle is a line.
    pub fn surface(
        &self,
        world: DMat4,
        placement: Option<(u32, Affine2)>,
        spent: &mut Spent,
        warnings: &mut Warnings,
    ) -> Result<Option<Surface>> {
        // However small, it takes its time.
        spent.vertices(PRIMITIVE_COST)?;
        let mode = self.primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=FAN).contains(&mode) {
            warnings.add("not-triangles", "points or lines in the file are left out".to_owned());
            return Ok(None);
        }
        let Some(positions) = self.attribute("POSITION", spent)? else {
            warnings.add("no-positions", "a mesh without positions is left out".to_owned());
            return Ok(None);
        };
        let corners = self.corners(positions.len(), spent)?;
        let mut triangles = triangles(&corners, mode);
        let all = triangles.len();
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        if mode == TRIANGLES && triangles.len() < all {
            let lost = all - triangles.len();
            warnings.add("degenerate-triangles", format!("{lost} triangles with two equal corners are left out"));
        }
        if triangles.is_empty() {
            return Ok(None);
        }
        let used = renumber(&mut triangles, positions.len());
        spent.vertices(used.len())?;
        if world.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let place = |&vertex: &u32| {
            world.transform_point3(DVec3::from_array(positions.vector::<3>(vertex as usize, 0.0).map(f64::from))).as_vec3()
        };
        let mesh = PolyMesh { positions: used.iter().map(place).collect(), triangles, quads: Vec::new() };
        if !mesh.positions.iter().all(|p| p.is_finite()) {
            return Err(broken("a position is not a finite number"));
        }
        let normals = self.normals(&mesh, &used, world, spent)?;
        let uvs = placement.map_or(Ok(Vec::new()), |(set, transform)| self.uvs(&used, set, transform, spent, warnings))?;
        let colors = self.colors(&used, spent)?;
        Ok(Some(Surface { mesh, normals, uvs, colors }))
    }

    fn attribute(&self, name: &str, spent: &mut Spent) -> Result<Option<Elements<'_>>> {
        self.primitive.attributes.get(name).map(|&accessor| spent.elements(self.bytes, self.document, accessor)).transpose()
    }

    /// An attribute beside the positions, which must reach as far as they do.
    fn beside(&self, name: &str, used: &[u32], spent: &mut Spent) -> Result<Option<Elements<'_>>> {
        let attribute = self.attribute(name, spent)?;
        let last = used.iter().max().map_or(0, |&last| last as usize);
        match attribute {
            Some(elements) if elements.len() <= last => Err(broken(format!("a mesh has fewer {name} than vertices"))),
            found => Ok(found),
        }
    }

    /// The vertices in the order of the primitive; every one exists.
    fn corners(&self, vertices: usize, spent: &mut Spent) -> Result<Vec<u32>> {
        let Some(accessor) = self.primitive.indices else {
            spent.vertices(vertices)?;
            let vertices = u32::try_from(vertices).map_err(|_| broken("a mesh has more vertices than can be numbered"))?;
            return Ok((0..vertices).collect());
        };
        let indices = spent.elements(self.bytes, self.document, accessor)?;
        if !indices.are_indices() {
            return Err(broken("the indices of a mesh are not whole numbers"));
        }
        spent.vertices(indices.len())?;
        let corners: Vec<u32> = (0..indices.len()).map(|k| indices.index(k)).collect();
        match corners.iter().find(|&&corner| corner as usize >= vertices) {
            Some(corner) => Err(broken(format!("a mesh has {vertices} vertices, but a triangle names vertex {corner}"))),
            None => Ok(corners),
        }
    }

    /// Unit normals: the file's where they are any, else those of the shape.
    fn normals(&self, mesh: &PolyMesh, used: &[u32], world: DMat4, spent: &mut Spent) -> Result<Vec<Vec3>> {
        let Some(normals) = self.beside("NORMAL", used, spent)? else { return Ok(shape_normals(mesh)) };
        let turn = normal_matrix(world);
        let place = |&vertex: &u32| {
            let normal = turn * DVec3::from_array(normals.vector::<3>(vertex as usize, 0.0).map(f64::from));
            // Of the shortest numbers, the first step gives only nearly unit length.
            normal.normalize_or_zero().normalize_or_zero().as_vec3()
        };
        let mut placed: Vec<Vec3> = used.iter().map(place).collect();
        if placed.contains(&Vec3::ZERO) {
            let shape = shape_normals(mesh);
            placed.iter_mut().zip(shape).filter(|(n, _)| **n == Vec3::ZERO).for_each(|(n, own)| *n = own);
        }
        Ok(placed)
    }

    fn uvs(&self, used: &[u32], set: u32, transform: Affine2, spent: &mut Spent, warnings: &mut Warnings) -> Result<Vec<Vec2>> {
        let Some(uvs) = self.beside(&format!("TEXCOORD_{set}"), used, spent)? else {
            warnings.add(
                "no-texture-coordinates",
                "a textured mesh has no texture coordinates and is drawn without its texture".to_owned(),
            );
            return Ok(Vec::new());
        };
        let place = |&vertex: &u32| transform.transform_point2(Vec2::from(uvs.vector::<2>(vertex as usize, 0.0)));
        let placed: Vec<Vec2> = used.iter().map(place).collect();
        if placed.iter().all(|uv| uv.is_finite()) { Ok(placed) } else { Err(broken("a texture coordinate is not a finite number")) }
    }

    /// Vertex colours, unless all of them are white.
    fn colors(&self, used: &[u32], spent: &mut Spent) -> Result<Vec<[f32; 4]>> {
        let Some(colors) = self.beside("COLOR_0", used, spent)? else { return Ok(Vec::new()) };
        let clean = |value: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { 1.0 };
        let colors: Vec<[f32; 4]> = used.iter().map(|&v| colors.vector::<4>(v as usize, 1.0).map(clean)).collect();
        Ok(if colors.iter().all(|c| *c == [1.0; 4]) { Vec::new() } else { colors })
    }
}

/// The mesh's own normals. Those of the smallest shapes are of unit length only after a second step.
fn shape_normals(mesh: &PolyMesh) -> Vec<Vec3> {
    mesh.vertex_normals().into_iter().map(|normal| normal.normalize_or(Vec3::Y)).collect()
}

fn triangles(corners: &[u32], mode: u64) -> Vec<[u32; 3]> {
    match mode {
        STRIP => {
            let turned = |(k, c): (usize, &[u32])| if k % 2 == 0 { [c[0], c[1], c[2]] } else { [c[0], c[2], c[1]] };
            corners.windows(3).enumerate().map(turned).collect()
        }
        FAN => corners.get(1..).unwrap_or_default().windows(2).map(|c| [c[0], c[1], corners[0]]).collect(),
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// Renumbers the vertices so that only those in use remain, in their order, and returns their old numbers: many primitives may share
/// one long list of vertices, and each is to cost what it uses.
fn renumber(triangles: &mut [[u32; 3]], vertices: usize) -> Vec<u32> {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    if vertices > 4 * used.len() {
        used.sort_unstable();
        used.dedup();
        let number = |vertex: u32| used.binary_search(&vertex).expect("the vertex is in use") as u32;
        triangles.iter_mut().for_each(|t| *t = t.map(number));
        return used;
    }
    let mut numbers = vec![u32::MAX; vertices];
    used.iter().for_each(|&vertex| numbers[vertex as usize] = 0);
    used = (0..vertices as u32).filter(|&vertex| numbers[vertex as usize] == 0).collect();
    used.iter().zip(0..).for_each(|(&vertex, number)| numbers[vertex as usize] = number);
    triangles.iter_mut().for_each(|t| *t = t.map(|vertex| numbers[vertex as usize]));
    used
}

/// What turns normals: the cofactors of the matrix, which unlike its inverse exist for flattened shapes too.
fn normal_matrix(world: DMat4) -> DMat3 {
    let m = DMat3::from_mat4(world);
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}
