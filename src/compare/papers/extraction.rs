//! What a change of level costs (Rebollo fig. 15 and 16): VDF, LoDF in main memory and on the device, meshoptimizer's simplifier. Milliseconds
//! of the quickest of some passes over 50 levels; trunks are left out, they are the same on all sides.
//!
//! The level goes from 0 to 1 (all leaves to one a cluster), everywhere at once or by the distance from a viewer who walks off. In main
//! memory the list of all leaves shown is written anew, as it is sent; on the device what has changed is sent.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

use crate::geom::Surface;
use crate::gpu::layout::Instance;
use crate::model::{Material, Part};
use crate::render::{Camera, Renderer, Shot, Stage, Stand};
use crate::repr::lodf::{Detail, LeafForest, LeafId, Resolution, Shown, Viewer, Wanted, Zones, foliage, simplify};
use crate::repr::vdf::{Front, Hierarchy};
use crate::repr::{BuiltPart, BuiltTree, Drawn, Seen};
use crate::{Result, Seed};

/// The tree of fig. 11, 15 and 16: Taxus Baccata.
pub const LEAVES: usize = 48_160;
/// Its clusters (table III).
pub const CLUSTERS: usize = 641;
/// Levels between 0 and 1.
pub const STEPS: usize = 50;

/// What was measured at one level.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The structure.
    pub how: &'static str,
    /// Which change, and whether a frame is in it.
    pub what: &'static str,
    /// Level, 0 to 1.
    pub level: f64,
    /// Milliseconds to get there from the level before.
    pub ms: f64,
    /// Leaves shown.
    pub leaves: usize,
    /// Bytes sent.
    pub bytes: u64,
}

/// Made-up foliage with as many leaves and clusters as Taxus Baccata has.
pub fn taxus(seed: Seed) -> (Surface, LeafForest) {
    let surface = foliage::synthetic(LEAVES, seed);
    let forest = LeafForest::of(&surface, CLUSTERS);
    (surface, forest)
}

/// Walks over all levels `runs` times and keeps the quickest of each. `change` goes to a level and gives leaves and bytes sent.
fn walked(
    rows: &mut Vec<Measured>,
    runs: usize,
    how: &'static str,
    what: &'static str,
    mut change: impl FnMut(f64) -> (usize, u64),
) {
    let mut best: Vec<Measured> = vec![];
    for run in 0..runs {
        change(0.0);
        for step in 1..=STEPS {
            let level = step as f64 / STEPS as f64;
            let begun = Instant::now();
            let (leaves, bytes) = change(level);
            let ms = begun.elapsed().as_secs_f64() * 1e3;
            if run == 0 {
                best.push(Measured { how, what, level, ms, leaves, bytes });
            } else {
                best[step - 1].ms = best[step - 1].ms.min(ms);
            }
        }
    }
    rows.extend(best);
}

/// A viewer who walks off, in the crown's own space: at level 0 so near that all is shown in full, at 1 so far that nothing is.
fn viewer(level: f64) -> Viewer {
    Viewer::at(Vec3::new(0.0, 6.0, 5.0 + 195.0 * level as f32), 10.0)
}

fn by_distance(forest: &LeafForest) -> LeafForest {
    LeafForest { detail: Detail { near: 0.4, far: 19.0, least: 0.0, zones: Zones::Distance }, ..forest.clone() }
}

/// Extraction alone, `runs` passes over all levels.
pub fn extraction(surface: &Surface, forest: &LeafForest, runs: usize) -> Vec<Measured> {
    let mut rows = vec![];
    let structure = &forest.forest;
    let blades = foliage::blades(surface);
    let collapses = simplify::simplify(&blades, structure.clusters());
    let last = collapses.len() as f64;
    let zones = by_distance(forest);
    let corners_of = |leaf: u32, corner: u8| surface.mesh.quads[leaf as usize][usize::from(corner)];

    // What is sent of CPU-side models: the four vertex numbers of every leaf shown.
    let hierarchy = Hierarchy::new(&surface.mesh, &collapses);
    let mut out: Vec<[u32; 4]> = Vec::with_capacity(structure.leaves());
    let mut front = hierarchy.finest();
    let mut listed = |front: &Front| {
        out.clear();
        out.extend(
            front
                .nodes()
                .iter()
                .map(|&node| hierarchy.nodes()[node as usize].corners.map(|c| corners_of(c >> 3, (c >> 1 & 3) as u8))),
        );
        (black_box(&out).len(), 16 * out.len() as u64)
    };
    walked(&mut rows, runs, "vdf", "uniform, extraction", |level| {
        hierarchy.set_uniform(&mut front, (level * last) as usize);
        listed(&front)
    });
    walked(&mut rows, runs, "vdf", "variable, extraction", |level| {
        let (eye, detail) = (viewer(level).eye, zones.detail);
        hierarchy.set_variable(&mut front, |(middle, radius)| {
            last as f32 * (1.0 - detail.share(0.1 * (eye.distance(middle) - radius).max(0.0)))
        });
        listed(&front)
    });

    let mut out: Vec<[u32; 4]> = Vec::with_capacity(structure.leaves());
    let mut resolution = Resolution::finest(structure);
    let mut listed = |resolution: &Resolution| {
        out.clear();
        for cluster in 0..structure.clusters() as u32 {
            out.extend(
                structure
                    .shown(cluster, resolution.collapsed(cluster))
                    .map(|number| structure.shape(LeafId { cluster, number }).corners.map(|c| corners_of(c.leaf, c.corner))),
            );
        }
        (black_box(&out).len(), 16 * out.len() as u64)
    };
    walked(&mut rows, runs, "lodf, CPU-side", "uniform, extraction", |level| {
        resolution.set_uniform(structure, structure.leaves() - (level * last) as usize);
        listed(&resolution)
    });
    walked(&mut rows, runs, "lodf, CPU-side", "variable, extraction", |level| {
        let Wanted::Variable(wanted) = zones.wanted(&viewer(level)) else { return (0, 0) };
        resolution.set_variable(structure, |cluster| wanted[cluster as usize] as usize);
        listed(&resolution)
    });

    let mut shown = Shown::finest(forest);
    walked(&mut rows, runs, "lodf, GPU-resident", "uniform, extraction", |level| {
        let sent = shown.set(forest, &Wanted::Uniform((level * last) as f32));
        (shown.leaves(), sent.bytes() as u64)
    });
    walked(&mut rows, runs, "lodf, GPU-resident", "variable, extraction", |level| {
        let sent = shown.set(&zones, &zones.wanted(&viewer(level)));
        (shown.leaves(), sent.bytes() as u64)
    });

    let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
    let positions: Vec<[f32; 3]> = surface.mesh.positions.iter().map(|p| p.to_array()).collect();
    walked(&mut rows, runs, "meshopt", "uniform, extraction", |level| {
        let left = (structure.leaves() as f64 - level * last) as usize;
        let kept = meshopt::simplify_sloppy_decoder(&indices, &positions, 6 * left, f32::MAX, None);
        (black_box(&kept).len() / 6, 4 * kept.len() as u64)
    });
    rows
}

/// Extraction and a frame of 256×256 pixels.
///
/// # Errors
/// Those of [`Renderer::frame`].
pub fn total(renderer: &mut Renderer, surface: &Surface, forest: &LeafForest, runs: usize) -> Result<Vec<Measured>> {
    let mut rows = vec![];
    let texture = image::RgbaImage::from_pixel(1, 1, image::Rgba([60, 120, 40, 255]));
    let material = Material { texture: Some(Arc::new(texture)), two_sided: true, alpha_cutoff: Some(0.5), ..Material::default() };
    let part = Part { name: "leaves".to_owned(), surface: surface.clone(), material, crown_center: None };
    let Some(bounds) = part.surface.mesh.bounds() else { return Ok(rows) };
    let mut failed = Ok(());
    for (how, resent) in [("vdf", true), ("lodf, GPU-resident", false)] {
        for (what, zones) in [("uniform, total", Zones::Uniform), ("variable, total", Zones::Distance)] {
            let forest = LeafForest { resent, detail: Detail { zones, ..by_distance(forest).detail }, ..forest.clone() };
            let drawn = BuiltPart { part: part.clone(), drawn: Drawn::Forest(Arc::new(forest)), seen: Seen::default() };
            let tree = renderer.upload_built(&BuiltTree::new(bounds, vec![drawn]))?;
            walked(&mut rows, runs, how, what, |level| {
                let camera = Camera::orbit(bounds.center(), 0.0, 0.0, 5.0 + 195.0 * level as f32);
                let shot = Shot { stage: Stage::Unshaped, ..Shot::new(camera, [256, 256]) };
                let frame = renderer.frame(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]);
                if failed.is_ok() {
                    failed = frame;
                }
                (renderer.leaves_shown(), renderer.sent_bytes())
            });
        }
    }
    failed.map(|()| rows)
}
