//! Wood from foliage. What a person says comes first; then what is cut out by alpha is foliage; where nothing is, many small flat pieces
//! are; and where there are none, what is called so.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::RgbaImage;

use super::connect::Components;
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::{Material, Part, Wrap, bounds};
use crate::{Error, Result};

/// What a person says about the materials of a tree, by their names; capitals do not matter.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Asked {
    /// Foliage (`--leaves MATERIAL`).
    pub leaves: Vec<String>,
    /// Wood (`--wood MATERIAL`).
    pub wood: Vec<String>,
}

/// What a surface of a tree is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Trunk, branches, twigs.
    Wood,
    /// Leaves, or cards with leaves painted on them.
    Foliage,
}

/// How that was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// A person said so.
    Asked,
    /// It is a crown that `sphereboard model` made, or its trunk.
    Model,
    /// Its material is cut out by alpha, or it is not where others are.
    Alpha,
    /// It consists of many small flat pieces, or it does not where others do.
    Connectivity,
    /// It is called so.
    Name,
    /// Nothing says anything else.
    Default,
}

/// Most triangles of a piece of foliage that may lie wholly in opaque texels; anything larger without a gap is wood that shares the
/// leaves' texture.
const OPAQUE_LEAF_TRIANGLES: usize = 64;
/// Share of transparent samples from which a piece counts as cut out.
const CUT_OUT_SHARE: f64 = 0.01;
/// Most triangles of a leaf that only its connectivity tells, how many of them make foliage, and their largest size in tree heights.
const LEAF_TRIANGLES: usize = 16;
const FEWEST_LEAVES: usize = 16;
const LARGEST_LEAF: f32 = 0.15;
/// Share of a piece's area that faces along one line, from which it counts as flat: 1 for a quad, ½ for a tube.
const FLAT_SHARE: f32 = 0.62;
/// How foliage is called; `wood` and `bark` need no words, since all else is wood.
const LEAF_WORDS: [&str; 9] = ["leaf", "leaves", "foliage", "needle", "frond", "crown", "canopy", "blatt", "laub"];

/// Parts with their roles; a part that is both becomes two.
pub fn split(parts: Vec<Part>, asked: &Asked) -> Result<Vec<(Part, Role, By)>> {
    check_names(&parts, asked)?;
    let height = bounds(&parts).map_or(0.0, |bounds| bounds.size().max_element());
    let said = |part: &Part| {
        let names = |list: &[String]| list.iter().any(|name| name.to_lowercase() == part.material.name.to_lowercase());
        if names(&asked.leaves) { Some(Role::Foliage) } else { names(&asked.wood).then_some(Role::Wood) }
    };
    let modelled = parts.iter().any(|part| part.crown_center.is_some());
    let cut: Vec<bool> = cut_out(&parts);
    let any_cut = parts.iter().zip(&cut).any(|(part, cut)| *cut && said(part).is_none());
    let mut done = Vec::with_capacity(parts.len());
    // Who names the leaves has named them all, as far as alpha does not say otherwise.
    let foliage_is_said = !asked.leaves.is_empty();
    for (part, cut) in parts.into_iter().zip(cut) {
        if let Some(role) = said(&part) {
            done.push((part, role, By::Asked));
        } else if modelled {
            let role = if part.crown_center.is_some() { Role::Foliage } else { Role::Wood };
            done.push((part, role, By::Model));
        } else if cut {
            let leafy = |part: &Part, piece: &[u32]| piece.len() <= OPAQUE_LEAF_TRIANGLES || shows_gaps(part, piece);
            let pieces = divided(part, leafy, 1);
            done.extend(pieces.into_iter().map(|(part, role)| (part, role, By::Alpha)));
        } else if any_cut || foliage_is_said {
            done.push((part, Role::Wood, if any_cut { By::Alpha } else { By::Asked }));
        } else {
            let leafy = |part: &Part, piece: &[u32]| is_leaf_like(&part.surface.mesh, piece, LARGEST_LEAF * height);
            let pieces = divided(part, leafy, FEWEST_LEAVES);
            done.extend(pieces.into_iter().map(|(part, role)| (part, role, By::Connectivity)));
        }
    }
    if !done.iter().any(|(_, role, _)| *role == Role::Foliage) {
        by_name(&mut done);
    }
    Ok(done)
}

/// The last resort.
fn by_name(done: &mut [(Part, Role, By)]) {
    let called = |name: &str| LEAF_WORDS.iter().any(|word| name.to_lowercase().contains(word));
    let leafy = |part: &Part| called(&part.material.name) || called(&part.name);
    let found = done.iter().any(|(part, _, by)| *by != By::Asked && leafy(part));
    for (part, role, by) in done.iter_mut().filter(|(_, _, by)| *by != By::Asked) {
        (*role, *by) = match found {
            true if leafy(part) => (Role::Foliage, By::Name),
            true => (Role::Wood, By::Name),
            false => (Role::Wood, By::Default),
        };
    }
}

/// Every name that is asked for belongs to a material.
fn check_names(parts: &[Part], asked: &Asked) -> Result<()> {
    let flags = [("--leaves", &asked.leaves), ("--wood", &asked.wood)];
    for (flag, name) in flags.into_iter().flat_map(|(flag, names)| names.iter().map(move |name| (flag, name))) {
        if !parts.iter().any(|part| part.material.name.to_lowercase() == name.to_lowercase()) {
            let mut known: Vec<&str> =
                parts.iter().map(|part| part.material.name.as_str()).filter(|name| !name.is_empty()).collect();
            known.sort_unstable();
            known.dedup();
            let known = if known.is_empty() { "no named ones".to_owned() } else { known.join(", ") };
            return Err(Error::UnknownMaterial { flag, asked: name.clone(), known });
        }
    }
    Ok(())
}

/// Whether each part's material leaves anything out. A texture is looked through once, however many parts share it.
fn cut_out(parts: &[Part]) -> Vec<bool> {
    let mut least: BTreeMap<*const RgbaImage, u8> = BTreeMap::new();
    let mut cut_out = |material: &Material| {
        let Some(cutoff) = material.alpha_cutoff else { return false };
        // Without its texture a leaf is still a leaf.
        let Some(texture) = &material.texture else { return true };
        let least = least.entry(Arc::as_ptr(texture)).or_insert_with(|| texture.pixels().map(|p| p[3]).min().unwrap_or(255));
        material.factor[3] * f32::from(*least) / 255.0 < cutoff
    };
    parts.iter().map(|part| cut_out(&part.material)).collect()
}

/// Whether the texture has gaps where the piece lies on it.
fn shows_gaps(part: &Part, piece: &[u32]) -> bool {
    const SAMPLES: [[f32; 3]; 7] = [
        [0.34, 0.33, 0.33],
        [0.8, 0.1, 0.1],
        [0.1, 0.8, 0.1],
        [0.1, 0.1, 0.8],
        [0.5, 0.45, 0.05],
        [0.05, 0.5, 0.45],
        [0.45, 0.05, 0.5],
    ];
    let (Some(texture), Some(cutoff)) = (&part.material.texture, part.material.alpha_cutoff) else { return true };
    let texel = |at: f32, px: u32| match part.material.wrap {
        Wrap::Clamp => (at * px as f32).clamp(0.0, px as f32 - 1.0) as u32,
        Wrap::Repeat => (at.rem_euclid(1.0) * px as f32).min(px as f32 - 1.0) as u32,
    };
    let opaque = |uv: Vec2| {
        let alpha = texture.get_pixel(texel(uv.x, texture.width()), texel(uv.y, texture.height()))[3];
        part.material.factor[3] * f32::from(alpha) / 255.0 >= cutoff
    };
    let (mut gaps, mut all) = (0usize, 0usize);
    for &polygon in piece {
        let corners = part.surface.mesh.polygon(polygon as usize);
        for k in 2..corners.len() {
            let uvs =
                [corners[0], corners[k - 1], corners[k]].map(|v| part.surface.uvs.get(v as usize).copied().unwrap_or_default());
            gaps += SAMPLES.iter().filter(|[a, b, c]| !opaque(*a * uvs[0] + *b * uvs[1] + *c * uvs[2])).count();
            all += SAMPLES.len();
        }
    }
    gaps as f64 > CUT_OUT_SHARE * all as f64
}

/// Whether the piece is small and flat.
fn is_leaf_like(mesh: &PolyMesh, piece: &[u32], largest: f32) -> bool {
    let corners = |polygon: &u32| mesh.polygon(*polygon as usize).iter().map(|&v| mesh.positions[v as usize]);
    if piece.len() > LEAF_TRIANGLES {
        return false;
    }
    let bounds = Bounds::of(piece.iter().flat_map(corners));
    if bounds.is_none_or(|bounds| bounds.size().max_element() > largest) {
        return false;
    }
    let mut facing: Vec<Vec3> = Vec::new();
    for polygon in piece {
        let corners: Vec<Vec3> = corners(polygon).collect();
        facing.extend((2..corners.len()).map(|k| 0.5 * (corners[k - 1] - corners[0]).cross(corners[k] - corners[0])));
    }
    let area: f32 = facing.iter().map(|normal| normal.length()).sum();
    area > 0.0 && along_one_line(&facing) >= FLAT_SHARE * area
}

/// How much of the area faces along the line that most of it faces along: the largest eigenvalue of Σ n nᵀ / |n|, by power iteration.
fn along_one_line(facing: &[Vec3]) -> f32 {
    let apply = |line: Vec3| facing.iter().filter(|n| n.length() > 0.0).map(|n| *n * n.dot(line) / n.length()).sum::<Vec3>();
    let start = facing.iter().copied().max_by(|a, b| a.length().total_cmp(&b.length())).unwrap_or(Vec3::Y).normalize_or(Vec3::Y);
    let line = (0..12).fold(start, |line, _| apply(line).normalize_or(line));
    apply(line).length()
}

/// The part divided by what its pieces are, wood first; whole when all are alike or fewer than `fewest` are leafy.
fn divided(part: Part, leafy: impl Fn(&Part, &[u32]) -> bool, fewest: usize) -> Vec<(Part, Role)> {
    let components = Components::of(&part.surface.mesh);
    let mut is_leaf = vec![false; part.surface.mesh.polygon_count()];
    let mut leaves = 0;
    for component in 0..components.count() {
        let piece = components.polygons(component);
        if leafy(&part, piece) {
            leaves += 1;
            piece.iter().for_each(|&polygon| is_leaf[polygon as usize] = true);
        }
    }
    if leaves < fewest {
        return vec![(part, Role::Wood)];
    }
    if !is_leaf.contains(&false) {
        return vec![(part, Role::Foliage)];
    }
    let of = |role: Role| {
        let surface = extracted(&part.surface, |polygon| is_leaf[polygon] == (role == Role::Foliage));
        (Part { name: part.name.clone(), surface, material: part.material.clone(), crown_center: None }, role)
    };
    vec![of(Role::Wood), of(Role::Foliage)]
}

/// The polygons for which `keep` holds, with the vertices that they use.
fn extracted(surface: &Surface, keep: impl Fn(usize) -> bool) -> Surface {
    const UNUSED: u32 = u32::MAX;
    let mesh = &surface.mesh;
    let first_quad = mesh.triangles.len();
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().enumerate().filter(|(k, _)| keep(*k)).map(|(_, t)| *t).collect();
    let mut quads: Vec<[u32; 4]> = mesh.quads.iter().enumerate().filter(|(k, _)| keep(first_quad + k)).map(|(_, q)| *q).collect();
    let mut numbers = vec![UNUSED; mesh.positions.len()];
    triangles.iter().flatten().chain(quads.iter().flatten()).for_each(|&v| numbers[v as usize] = 0);
    let used: Vec<usize> = (0..numbers.len()).filter(|&v| numbers[v] != UNUSED).collect();
    used.iter().zip(0..).for_each(|(&v, number)| numbers[v] = number);
    triangles.iter_mut().flatten().chain(quads.iter_mut().flatten()).for_each(|v| *v = numbers[*v as usize]);
    fn taken<T: Copy>(list: &[T], used: &[usize]) -> Vec<T> {
        if list.is_empty() { Vec::new() } else { used.iter().map(|&v| list[v]).collect() }
    }
    Surface {
        mesh: PolyMesh { positions: taken(&mesh.positions, &used), triangles, quads },
        normals: taken(&surface.normals, &used),
        uvs: taken(&surface.uvs, &used),
        colors: taken(&surface.colors, &used),
    }
}
