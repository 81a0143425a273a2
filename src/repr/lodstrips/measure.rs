//! LodStrips beside plain indexed simplification by meshoptimizer: bytes, ms and Hausdorff distance at the same numbers of triangles (issue
//! "Geometric multiresolution").

use std::time::Instant;

use ::meshopt::{SimplifyOptions, simplify_decoder};
use glam::Vec3;
use rayon::prelude::*;

use super::nearest::{Corners, nearest_on};
use super::{Lodstrips, SHARES};
use crate::Seed;
use crate::geom::Surface;

/// One of the two at one level.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Measured {
    /// Triangles.
    pub triangles: usize,
    /// How long going there takes: from the level before, or by simplifying anew.
    pub ms: f64,
    /// Largest distance of a sample of either surface, the original and this one, from the other, metres.
    pub hausdorff_m: f32,
    /// Mean of these distances.
    pub mean_m: f32,
    /// Mean distance of a sample of this surface from the original: webs across bends stand off it.
    pub swell_m: f32,
}

/// The two side by side.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// How long the order of all collapses takes.
    pub build_ms: f64,
    /// All levels as LodStrips.
    pub lodstrips_bytes: usize,
    /// The same vertices with the indices of every level of [`SHARES`].
    pub indexed_bytes: usize,
    /// LodStrips and the simplifier at each of [`SHARES`].
    pub levels: Vec<[Measured; 2]>,
}

/// Samples of the surface that distances are measured from.
const SAMPLES: usize = 4096;

/// Measures both on one surface.
pub fn compare(surface: &Surface, seed: Seed) -> Comparison {
    let begun = Instant::now();
    let model = Lodstrips::of(surface);
    let build_ms = ms_since(begun);
    let original = corners(surface, &surface.mesh.triangulated().collect::<Vec<_>>());
    let mut extraction = model.extraction();
    let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
    let places: Vec<[f32; 3]> = surface.mesh.positions.iter().map(Vec3::to_array).collect();
    let mut indexed_bytes = 32 * places.len();
    let levels = SHARES.iter().map(|share| {
        let level = model.level_with((share * model.levels[0].triangles as f32) as usize);
        let begun = Instant::now();
        extraction.go_to(level);
        let ms = ms_since(begun);
        let triangles = extraction.triangles();
        let ours = measured(&original, &corners(&model.surface, &triangles), ms, seed);
        let begun = Instant::now();
        let options = SimplifyOptions::Permissive | SimplifyOptions::Prune;
        let theirs = simplify_decoder(&indices, &places, 3 * triangles.len(), f32::MAX, options, None);
        let ms = ms_since(begun);
        indexed_bytes += 4 * theirs.len();
        [ours, measured(&original, &corners(surface, theirs.as_chunks().0), ms, seed)]
    });
    let levels = levels.collect();
    Comparison { build_ms, lodstrips_bytes: model.bytes(), indexed_bytes, levels }
}

fn ms_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}

fn corners(surface: &Surface, triangles: &[[u32; 3]]) -> Vec<Corners> {
    triangles.iter().map(|t| t.map(|v| surface.mesh.positions[v as usize])).collect()
}

fn measured(original: &[Corners], simplified: &[Corners], ms: f64, seed: Seed) -> Measured {
    let [lost, swollen] = [[original, simplified], [simplified, original]].map(|[from, to]| distances(from, to, seed));
    let mean = |all: &[f32]| all.iter().sum::<f32>() / all.len().max(1) as f32;
    let hausdorff_m = lost.iter().chain(&swollen).copied().fold(0.0, f32::max);
    Measured { triangles: simplified.len(), ms, hausdorff_m, mean_m: mean(&lost), swell_m: mean(&swollen) }
}

/// How far samples of one surface are from another, metres.
fn distances(from: &[Corners], to: &[Corners], seed: Seed) -> Vec<f32> {
    let off = |p: &Vec3| to.iter().map(|t| nearest_on(*t, *p).distance_squared(*p)).fold(f32::MAX, f32::min).sqrt();
    samples(from, seed).par_iter().map(off).collect()
}

/// Points all over a surface, by area.
fn samples(triangles: &[Corners], seed: Seed) -> Vec<Vec3> {
    let mut sum = 0.0;
    let until = |[a, b, c]: &Corners| {
        sum += f64::from((*b - *a).cross(*c - *a).length());
        sum
    };
    let untils: Vec<f64> = triangles.iter().map(until).collect();
    let sample = |number: u64| {
        let mut draws = seed.keyed("hausdorff", number);
        let at = draws.unit() * sum;
        let [a, b, c] = *triangles.get(untils.partition_point(|until| *until <= at))?;
        let (u, v) = (draws.unit() as f32, draws.unit() as f32);
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some(a + u * (b - a) + v * (c - a))
    };
    (0..SAMPLES as u64).filter_map(sample).collect()
}
