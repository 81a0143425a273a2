//! Small trees to try methods on.

use glam::{Quat, Vec3};

use super::{BuiltTree, Order, Settings, SoftwareCapture, TreeSource, build};
use crate::geom::{PolyMesh, Surface};
use crate::model::reference::{Asked, ReferenceTree};
use crate::model::{Material, Part};
use crate::raster::{self, View};
use crate::{Result, Seed};

/// 4 m high and uneven: 600 leaves on the upper side of an ellipsoid at 2.6 m, its widest, and in a lobe on the right (+X); a trunk of 1.6 m.
pub fn tree() -> TreeSource {
    source(vec![trunk(), leaves(600)])
}

/// The same, its foot elsewhere.
pub fn tree_at(foot: Vec3) -> TreeSource {
    let mut parts = vec![trunk(), leaves(600)];
    parts.iter_mut().flat_map(|part| &mut part.surface.mesh.positions).for_each(|p| *p += foot);
    source(parts)
}

/// Only the trunk.
pub fn bare() -> TreeSource {
    source(vec![trunk()])
}

/// Only one leaf, upright, facing +Z.
pub fn one_leaf() -> TreeSource {
    source(vec![part("leaf", [0.2, 0.6, 0.1, 1.0], true, quad(Vec3::new(0.0, 0.5, 0.0), Vec3::Z, 0.2))])
}

/// A closed box 2 m wide, 3 m high, 1 m deep on the ground: everything about it is known. Its normals are those of its faces.
pub fn block() -> TreeSource {
    let mut surface = Surface::default();
    let (half, center) = (Vec3::new(1.0, 1.5, 0.5), Vec3::new(0.0, 1.5, 0.0));
    for axis in Vec3::AXES.iter().flat_map(|axis| [*axis, -*axis]) {
        let (u, v) = axis.any_orthonormal_pair();
        let corner = |s: f32, t: f32| center + half * (axis + s * u + t * v);
        let positions = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let mesh = PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] };
        surface.append(Surface { mesh, normals: vec![axis; 4], ..Surface::default() });
    }
    source(vec![part("block", [0.3, 0.5, 0.1, 1.0], false, surface)])
}

/// A source of no extent.
pub fn point() -> TreeSource {
    source(vec![part("leaf", [1.0; 4], true, quad(Vec3::ONE, Vec3::Z, 0.0))])
}

/// What a method makes of `source` with these settings.
pub fn built(method: &str, settings: &[&str], source: &TreeSource) -> Result<BuiltTree> {
    let settings = Settings::parse(settings.iter().copied())?;
    build(&Order { method, trunk: None, settings: &settings, seed: Seed(1) }, source, &SoftwareCapture::new())
}

/// Which pixels of a view are covered by half or more.
pub fn mask<'a>(parts: impl IntoIterator<Item = &'a Part>, view: &View) -> Vec<bool> {
    let surfaces: Vec<_> = parts.into_iter().map(|part| (&part.surface, part.material.raster())).collect();
    raster::render(&surfaces, view, None).unwrap().coverage.as_raw().iter().map(|c| *c >= 128).collect()
}

/// Pixels in both masks over pixels in either.
pub fn overlap(a: &[bool], b: &[bool]) -> f64 {
    let count = |f: fn(bool, bool) -> bool| a.iter().zip(b).filter(|(a, b)| f(**a, **b)).count() as f64;
    count(|a, b| a && b) / count(|a, b| a || b).max(1.0)
}

fn source(parts: Vec<Part>) -> TreeSource {
    let named = |wood: bool| {
        let names = parts.iter().map(|part| part.material.name.clone());
        names.filter(|name| (name == "bark") == wood).collect()
    };
    let asked = Asked { leaves: named(false), wood: named(true) };
    TreeSource::reference(ReferenceTree::new("trial".to_owned(), parts, &asked).unwrap())
}

fn part(name: &str, factor: [f32; 4], two_sided: bool, surface: Surface) -> Part {
    let material = Material { name: name.to_owned(), factor, two_sided, ..Material::default() };
    Part { name: name.to_owned(), surface, material, crown_center: None }
}

fn quad(at: Vec3, normal: Vec3, half_m: f32) -> Surface {
    let turn = Quat::from_rotation_arc(Vec3::Z, normal);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let positions = corners.map(|(x, y)| at + half_m * (turn * Vec3::new(x, y, 0.0))).to_vec();
    let mesh = PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] };
    Surface { mesh, normals: vec![normal; 4], ..Surface::default() }
}

fn trunk() -> Part {
    let mut surface = Surface::default();
    for k in 0..4 {
        let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2 * k as f32);
        let mut side = quad(Vec3::new(0.0, 0.8, 0.1), Vec3::Z, 1.0);
        for p in &mut side.mesh.positions {
            *p = turn * Vec3::new(0.1 * p.x, 0.8 + 0.8 * (p.y - 0.8), p.z);
        }
        side.normals = vec![turn * Vec3::Z; 4];
        surface.append(side);
    }
    part("bark", [0.2, 0.15, 0.1, 1.0], false, surface)
}

fn leaves(count: u32) -> Part {
    let mut surface = Surface::default();
    for k in 0..count {
        // Fibonacci's spiral over the sphere.
        let up = 1.0 - 1.9 * (k as f32 + 0.5) / count as f32;
        let (s, c) = (2.399_963 * k as f32).sin_cos();
        let around = (1.0 - up * up).sqrt();
        let normal = Vec3::new(around * s, up, around * c);
        let lobe = if k % 5 == 0 { 0.8 } else { 0.0 };
        let at = Vec3::new(lobe, 2.6, 0.0) + Vec3::new(1.0, 1.3, 1.2) * normal;
        surface.append(quad(at, normal, 0.1));
    }
    part("leaf", [0.2, 0.6, 0.1, 1.0], true, surface)
}
