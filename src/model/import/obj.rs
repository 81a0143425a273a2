//! OBJ (Wavefront, Advanced Visualizer appendix B1) with MTL: one [`Part`] per material. Quads stay quads.
//!
//! Read are `v` (with colours), `vt`, `vn`, `f`, `usemtl` and `mtllib`; objects, groups and smoothing change nothing here, and curves,
//! lines and points are left out. Faces have two sides, since OBJ does not say which one is meant.

use std::collections::{BTreeMap, HashMap};

use glam::{Vec2, Vec3};

use super::folder::{Folder, shortened};
use super::mtl::{self, Look};
use super::{Warnings, broken_in, text};
use crate::Result;
use crate::geom::{PolyMesh, Surface};
use crate::model::Part;
use crate::raster::to_linear;

/// Reads the text of an OBJ file; its material libraries and textures lie in `folder`.
///
/// # Errors
/// [`crate::Error::BrokenModel`] with the line.
pub fn parts(bytes: &[u8], folder: &Folder, warnings: &mut Warnings) -> Result<Vec<Part>> {
    let mut file = Obj::default();
    for (number, line) in text::logical_lines(bytes) {
        file.line(&line).map_err(|what| broken_in("OBJ", format!("in line {number} {what}")))?;
    }
    if file.skipped > 0 {
        let message = format!("{} faces with fewer than three different corners are left out", file.skipped);
        warnings.add("degenerate-triangles", message);
    }
    let names: Vec<&str> = file.groups.iter().map(|group| group.material.as_str()).collect();
    let looks = mtl::looks(&file.libraries, &names, folder, warnings);
    let smooth = file.smooth_normals();
    let groups = file.groups.iter().filter(|group| group.mesh.polygon_count() > 0);
    Ok(groups.map(|group| file.part(group, looks.get(group.material.as_str()), &smooth)).collect())
}

/// One corner of a face: position, texture coordinate, normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// What has been read so far.
#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    /// As long as `positions` when any vertex has a colour.
    colors: Vec<[f32; 4]>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    libraries: Vec<String>,
    groups: Vec<Group>,
    /// The group of each material.
    by_material: BTreeMap<String, usize>,
    current: Option<usize>,
    skipped: usize,
}

/// The faces of one material; its mesh has no positions yet, only corners in their place.
#[derive(Default)]
struct Group {
    material: String,
    mesh: PolyMesh,
    corners: Vec<Corner>,
    numbers: HashMap<Corner, u32>,
}

impl Obj {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let (keyword, rest) = text::keyword(line);
        match keyword {
            "v" => self.vertex(rest),
            "vt" => {
                let (numbers, count) = text::numbers::<3>(rest)?;
                if count == 0 {
                    return Err("a texture coordinate has no numbers".to_owned());
                }
                // OBJ counts v upwards.
                self.uvs.push(Vec2::new(numbers[0], 1.0 - numbers[1]));
                Ok(())
            }
            "vn" => {
                let (numbers, _) = text::numbers::<3>(rest)?;
                self.normals.push(unit(Vec3::from(numbers)).unwrap_or(Vec3::ZERO));
                Ok(())
            }
            "f" | "fo" => self.face(rest),
            "usemtl" => {
                self.switch(rest);
                Ok(())
            }
            "mtllib" => {
                self.libraries.push(rest.to_owned());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn vertex(&mut self, rest: &str) -> Result<(), String> {
        let (n, count) = text::numbers::<7>(rest)?;
        let color = match count {
            0..3 => return Err("a vertex has fewer than three coordinates".to_owned()),
            6 => Some([n[3], n[4], n[5]]),
            7 => Some([n[4], n[5], n[6]]),
            _ => None,
        };
        if color.is_some() && self.colors.is_empty() {
            self.colors = vec![[1.0; 4]; self.positions.len()];
        }
        if color.is_some() || !self.colors.is_empty() {
            // Those who write them write what the screen shows, 0..1.
            let [r, g, b] = color.unwrap_or([1.0; 3]).map(|c| to_linear((255.0 * c.clamp(0.0, 1.0)).round() as u8));
            self.colors.push([r, g, b, 1.0]);
        }
        self.positions.push(Vec3::new(n[0], n[1], n[2]));
        Ok(())
    }

    fn switch(&mut self, material: &str) {
        let next = self.groups.len();
        let group = *self.by_material.entry(material.to_owned()).or_insert(next);
        if group == next {
            self.groups.push(Group { material: material.to_owned(), ..Group::default() });
        }
        self.current = Some(group);
    }

    fn face(&mut self, rest: &str) -> Result<(), String> {
        let corners = rest.split_whitespace().map(|corner| self.corner(corner)).collect::<Result<Vec<Corner>, String>>()?;
        let polygon = self.without_repetition(&corners);
        if polygon.len() < 3 {
            self.skipped += 1;
            return Ok(());
        }
        if self.current.is_none() {
            self.switch("");
        }
        let place = |corner: &Corner| self.positions[corner.0 as usize];
        let pieces = pieces(&polygon.iter().map(place).collect::<Vec<_>>());
        let group = &mut self.groups[self.current.expect("it was just set")];
        for piece in pieces {
            match piece[..] {
                [a, b, c, d] => {
                    let quad = [a, b, c, d].map(|k| group.number(polygon[k]));
                    group.mesh.quads.push(quad);
                }
                [a, b, c] => {
                    let triangle = [a, b, c].map(|k| group.number(polygon[k]));
                    group.mesh.triangles.push(triangle);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or from the last one backwards.
    fn corner(&self, text: &str) -> Result<Corner, String> {
        let mut fields = text.split('/');
        let mut index = |count: usize, what: &str| -> Result<Option<u32>, String> {
            let Some(field) = fields.next().filter(|field| !field.is_empty()) else { return Ok(None) };
            let wrong = || format!("a face names {what} {}, but there are {count} so far", shortened(field));
            let number: i64 = field.parse().map_err(|_| wrong())?;
            let from_zero = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
            let found = from_zero.and_then(|k| usize::try_from(k).ok()).filter(|k| *k < count).ok_or_else(wrong)?;
            Ok(Some(u32::try_from(found).map_err(|_| wrong())?))
        };
        let position = index(self.positions.len(), "vertex")?.ok_or_else(|| "a corner of a face has no vertex".to_owned())?;
        let uv = index(self.uvs.len(), "texture coordinate")?;
        let normal = index(self.normals.len(), "normal")?;
        Ok((position, uv, normal))
    }

    /// The corners without those that stand where the one before stands.
    fn without_repetition(&self, corners: &[Corner]) -> Vec<Corner> {
        let mut kept: Vec<Corner> = Vec::with_capacity(corners.len());
        for &corner in corners {
            if kept.last().is_none_or(|last| last.0 != corner.0) {
                kept.push(corner);
            }
        }
        if kept.len() > 1 && kept[0].0 == kept[kept.len() - 1].0 {
            kept.pop();
        }
        kept
    }

    /// Normals for corners that have none: of all faces round a position, weighted by area.
    fn smooth_normals(&self) -> Vec<Vec3> {
        if self.groups.iter().flat_map(|group| &group.corners).all(|corner| self.normal(*corner).is_some()) {
            return Vec::new();
        }
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for group in &self.groups {
            for triangle in group.mesh.triangulated() {
                let at = triangle.map(|k| group.corners[k as usize].0 as usize);
                let [a, b, c] = at.map(|k| self.positions[k]);
                at.iter().for_each(|&k| sums[k] += (b - a).cross(c - a));
            }
        }
        sums.iter().map(|sum| unit(*sum).unwrap_or(Vec3::Y)).collect()
    }

    fn normal(&self, corner: Corner) -> Option<Vec3> {
        corner.2.map(|k| self.normals[k as usize]).filter(|normal| *normal != Vec3::ZERO)
    }

    fn part(&self, group: &Group, look: Option<&Look>, smooth: &[Vec3]) -> Part {
        let corners = &group.corners;
        let mut material = look.map_or_else(mtl::plain, |look| look.material.clone());
        material.name.clone_from(&group.material);
        let place = |uv: Option<u32>| uv.map_or(Vec2::ZERO, |k| self.uvs[k as usize]);
        let mut uvs = Vec::new();
        if material.texture.is_some() {
            uvs = corners.iter().map(|corner| look.map_or(place(corner.1), |look| look.placed(place(corner.1)))).collect();
        }
        let surface = Surface {
            mesh: PolyMesh { positions: corners.iter().map(|c| self.positions[c.0 as usize]).collect(), ..group.mesh.clone() },
            normals: corners.iter().map(|&c| self.normal(c).unwrap_or_else(|| smooth[c.0 as usize])).collect(),
            uvs,
            colors: if self.colors.is_empty() { vec![] } else { corners.iter().map(|c| self.colors[c.0 as usize]).collect() },
        };
        let name = if group.material.is_empty() { "mesh".to_owned() } else { shortened(&group.material) };
        Part { name, surface, material, crown_center: None }
    }
}

impl Group {
    /// The vertex of a corner; equal corners share one.
    fn number(&mut self, corner: Corner) -> u32 {
        *self.numbers.entry(corner).or_insert_with(|| {
            self.corners.push(corner);
            self.corners.len() as u32 - 1
        })
    }
}

/// The vector's direction, exact for the shortest too.
fn unit(vector: Vec3) -> Option<Vec3> {
    vector.as_dvec3().try_normalize().map(|direction| direction.as_vec3())
}

/// A polygon as triangles and quads, by numbers of its corners: a quad stays one, cut along the diagonal that lies inside; of anything
/// larger, ears are cut.
fn pieces(polygon: &[Vec3]) -> Vec<Vec<usize>> {
    match polygon.len() {
        0..3 => return Vec::new(),
        3 => return vec![vec![0, 1, 2]],
        4 => {
            let at = |k: usize| polygon[k % 4];
            let turn = |a: usize, b: usize, c: usize| (at(b) - at(a)).cross(at(c) - at(a));
            let inside = turn(0, 1, 2).dot(turn(0, 2, 3)) >= 0.0;
            return vec![if inside { vec![0, 1, 2, 3] } else { vec![1, 2, 3, 0] }];
        }
        _ => {}
    }
    let normal: Vec3 = (0..polygon.len()).map(|k| polygon[k].cross(polygon[(k + 1) % polygon.len()])).sum();
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut triangles = Vec::new();
    // Cutting ears takes the cube of the corners; a face of very many is nearly always a flat round cap, and any fan will do.
    while left.len() > 3 && polygon.len() <= 64 {
        let ear = (0..left.len()).find(|&k| is_ear(polygon, &left, k, normal)).unwrap_or(0);
        triangles.push([left[(ear + left.len() - 1) % left.len()], left[ear], left[(ear + 1) % left.len()]].to_vec());
        left.remove(ear);
    }
    triangles.extend(left[1..].windows(2).map(|pair| vec![left[0], pair[0], pair[1]]));
    triangles
}

/// Whether the corner bends outward and no other corner lies in its triangle.
fn is_ear(polygon: &[Vec3], left: &[usize], k: usize, normal: Vec3) -> bool {
    let [before, here, after] = [left[(k + left.len() - 1) % left.len()], left[k], left[(k + 1) % left.len()]];
    let [a, b, c] = [before, here, after].map(|k| polygon[k]);
    let side = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - p).dot(normal);
    let inside = |p: Vec3| side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0;
    let others = left.iter().filter(|&&other| ![before, here, after].contains(&other));
    side(a, b, c) > 0.0 && !others.into_iter().any(|&other| inside(polygon[other]))
}
