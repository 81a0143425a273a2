//! A grove as a GLB file for other programs: each kind of tree once, and where its copies stand, by cells of ground (`EXT_mesh_gpu_instancing`).
//!
//! Other programs do not change levels by themselves, so one is chosen for all trees: what is drawn at a distance ([`ExportParams`]). Cards that
//! turn and pictures for every side, for which glTF has no word, become two cards crossed where no other level is near.

use std::collections::BTreeMap;

use glam::Vec3;
use serde::Serialize;

use super::scene::Scene;
use super::stock::Stock;
use crate::geom::{PolyMesh, Surface};
use crate::model::glb::{Batch, Instanced, Kind, Plainly, write_instances};
use crate::model::{About, Material, Part};
use crate::repr::{BuiltPart, BuiltTree, Drawn, file};
use crate::{Result, Warning};

crate::params! {
    /// What of a grove is exported.
    pub struct ExportParams {
        /// The level that is drawn at this distance, in tree heights.
        export_distance: f64 = 10.0, in 0.0..=10_000.0, unit "", source "ours: a tree that is 130 pixels high on a screen of 1080";
        /// Side of the cells by which trees are batched, so that a viewer can leave out what is out of sight; 0 for as many as hold about 500 trees.
        export_cell_m: f64 = 0.0, in 0.0..=100_000.0, unit "m", source "ours: a few hundred copies a draw call";
    }
}

/// Trees of a cell, on average, where nothing else is asked.
const TREES_OF_CELL: f32 = 500.0;

/// The meadow's colour from afar, linear light: the middle of its two greens (shaders/shared/meadow.wgsl).
const MEADOW: [f32; 3] = [0.112, 0.163, 0.040];

/// A file and what it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// Its bytes.
    pub glb: Vec<u8>,
    /// Trees.
    pub trees: usize,
    /// Nodes that show copies: draw calls.
    pub draws: usize,
    /// Triangles of all copies.
    pub triangles: u64,
    /// Bytes of the file that grow with the number of trees.
    pub bytes_of_copies: usize,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// `extras.sphereboard` of the file.
#[derive(Serialize)]
struct Says<'a> {
    kind: &'static str,
    program: String,
    title: &'a str,
    trees: usize,
    species: Vec<OfSpecies<'a>>,
    cell_m: f32,
}

#[derive(Serialize)]
struct OfSpecies<'a> {
    name: &'a str,
    method: &'a str,
    distance: f32,
}

/// Writes `scene` with `stock`, one of it for each of the scene's species.
///
/// # Errors
/// [`Error::Internal`](crate::Error::Internal) for what GLB cannot hold.
pub fn export(scene: &Scene, stock: &[Stock], params: &ExportParams) -> Result<Export> {
    let chosen: Vec<(BuiltTree, f32)> = stock.iter().map(|stock| level(&stock.built, params.export_distance as f32)).collect();
    let cell_m = if params.export_cell_m > 0.0 { params.export_cell_m as f32 } else { fitting_cell_m(scene) };
    let batches = batches(scene, stock.len(), cell_m);
    let kind = |(index, ((built, _), stock)): (usize, (&(BuiltTree, f32), &Stock))| {
        let parts = built.parts.iter().map(plainly).collect::<Vec<_>>();
        (format!("{}_{index}", stock.size.name), parts)
    };
    let kinds: Vec<_> = chosen.iter().zip(stock).enumerate().map(kind).collect();
    let instanced = Instanced {
        kinds: kinds
            .iter()
            .map(|(name, parts)| Kind {
                name: name.clone(),
                parts: parts.iter().map(|(part, plainly)| (part, plainly.clone())).collect(),
            })
            .collect(),
        batches,
        ground: Some((ground(scene), MEADOW)),
    };
    let trees = instanced.batches.iter().map(|batch| batch.copies.len()).sum();
    let of_kind = |batch: &Batch| instanced.kinds[batch.kind].triangles();
    let species = chosen.iter().zip(stock).map(|((built, distance), stock)| OfSpecies {
        name: &stock.size.name,
        method: &built.method,
        distance: *distance,
    });
    let says =
        Says { kind: "grove", program: About::this_program(), title: &scene.file.title, trees, species: species.collect(), cell_m };
    Ok(Export {
        trees,
        draws: instanced.batches.iter().map(|batch| instanced.kinds[batch.kind].shown().count()).sum(),
        triangles: instanced.batches.iter().map(|batch| batch.copies.len() as u64 * of_kind(batch) as u64).sum(),
        bytes_of_copies: trees * BYTES_OF_COPY,
        warnings: chosen.iter().zip(stock).filter_map(|((built, _), stock)| lost(built, stock)).collect(),
        glb: write_instances(&instanced, &says, &says.program)?,
    })
}

/// Three numbers of place, four of turn, three of size.
const BYTES_OF_COPY: usize = 40;

/// What is seen of a tree at `distance`, or at the nearest to it, by ratio, at which nothing fades; a little farther or nearer where glTF can
/// say all of it there. Also that distance.
fn level(built: &BuiltTree, distance: f32) -> (BuiltTree, f32) {
    /// Half as far again, and eight times as far, in steps of 4 %.
    const NEAR: i32 = 10;
    const ANYWHERE: i32 = 52;
    let built = built.clone().plain();
    let whole = |d: &f32| {
        let mut seen = built.parts_at(*d).peekable();
        seen.peek().is_some() && seen.all(|part| part.seen.share_at(*d) == 1.0)
    };
    let plain = |d: &f32| whole(d) && built.parts_at(*d).all(|part| file::beyond_gltf(part).is_none());
    let around = |reach: i32| (0..=reach).flat_map(|step| [step, -step]).map(|step| distance.max(0.01) * 1.04f32.powi(step));
    let at = around(NEAR).find(plain).or_else(|| around(ANYWHERE).find(whole)).unwrap_or(distance);
    let parts = built.parts_at(at).cloned().collect();
    (BuiltTree { parts, ..built }, at)
}

/// A part as other programs show it. A card that turns, or has a picture for every side, becomes two that cross: trees are turned every which
/// way, and one would be edge-on.
fn plainly(part: &BuiltPart) -> (Part, Plainly) {
    let crossed = |mut front: Surface, side: Surface| {
        front.append(side);
        // Its normals are those of the front alone, or not in tangent space at all.
        let material = Material { two_sided: true, normal_texture: None, ..part.part.material.clone() };
        (Part { material, ..part.part.clone() }, Plainly::Other(front))
    };
    match (&part.drawn, file::plainly(part)) {
        (Drawn::Octahedral(pictures), _) => crossed(file::upright_card(pictures, false), file::upright_card(pictures, true)),
        (Drawn::Turned { pivot, .. }, Plainly::Itself) => {
            let front = part.part.surface.clone();
            let mut side = front.clone();
            side.mesh.positions.iter_mut().for_each(|p| *p = *pivot + quarter_turn(*p - *pivot));
            side.normals.iter_mut().for_each(|n| *n = quarter_turn(*n));
            crossed(front, side)
        }
        (_, plainly) => (part.part.clone(), plainly),
    }
}

/// From +Z to +X.
fn quarter_turn(v: Vec3) -> Vec3 {
    Vec3::new(v.z, v.y, -v.x)
}

/// That other programs do not show a tree as it is.
fn lost(built: &BuiltTree, stock: &Stock) -> Option<Warning> {
    let needs = built.parts.iter().find_map(file::beyond_gltf)?;
    let name = &stock.size.name;
    let told = format!(
        "{name}: what stands for it {needs}, which GLB cannot say: crossed or still cards stand there; export another --method or --export-distance"
    );
    Some(Warning::new("export-plain", told))
}

/// Cells of which each holds [`TREES_OF_CELL`] trees on average.
fn fitting_cell_m(scene: &Scene) -> f32 {
    let [width, depth] = scene.ground.size_m();
    (TREES_OF_CELL * width * depth / scene.planted.len().max(1) as f32).sqrt().clamp(10.0, width.max(depth).max(10.0))
}

/// Where a tree stands, its turn about the vertical and its scale.
type Place = (Vec3, f32, f32);

/// The scene's trees by cell and species, cells row by row from the north-west.
fn batches(scene: &Scene, kinds: usize, cell_m: f32) -> Vec<Batch> {
    let mut cells: BTreeMap<(i64, i64, usize), Vec<Place>> = BTreeMap::new();
    for tree in scene.planted.iter().filter(|tree| usize::from(tree.species) < kinds) {
        let along = |at: f32, from: f32| ((at - from) / cell_m).floor() as i64;
        let cell = (along(tree.position.z, scene.ground.north_m), along(tree.position.x, scene.ground.west_m), tree.species.into());
        cells.entry(cell).or_default().push((tree.position, tree.yaw_rad, tree.scale));
    }
    let batch = |((row, column, kind), copies)| Batch { kind, name: format!("{row}/{column}"), copies };
    cells.into_iter().map(batch).collect()
}

fn ground(scene: &Scene) -> Surface {
    let mesh = scene.ground.mesh();
    let triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    Surface { mesh: PolyMesh { positions: mesh.positions, triangles, quads: vec![] }, normals: mesh.normals, ..Surface::default() }
}

#[cfg(test)]
#[path = "export_tests.rs"]
mod tests;
