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
    /// Largest distance of a sample of the original surface from this one, metres.
    pub hausdorff_m: f32,
    /// Mean of these distances.
    pub mean_m: f32,
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

/// Measures both on one surface. Both only ever use vertices of the original, so that distances from it to them are what counts.
pub fn compare(surface: &Surface, seed: Seed) -> Comparison {
    let begun = Instant::now();
    let model = Lodstrips::of(surface);
    let build_ms = ms_since(begun);
    let samples = samples(surface, seed);
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
        let ours = measured(&samples, &model.surface, &triangles, ms);
        let begun = Instant::now();
        let options = SimplifyOptions::Permissive | SimplifyOptions::Prune;
        let theirs = simplify_decoder(&indices, &places, 3 * triangles.len(), f32::MAX, options, None);
        let ms = ms_since(begun);
        indexed_bytes += 4 * theirs.len();
        [ours, measured(&samples, surface, theirs.as_chunks().0, ms)]
    });
    let levels = levels.collect();
    Comparison { build_ms, lodstrips_bytes: model.bytes(), indexed_bytes, levels }
}

fn ms_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}

fn measured(samples: &[Vec3], surface: &Surface, triangles: &[[u32; 3]], ms: f64) -> Measured {
    let corners: Vec<Corners> = triangles.iter().map(|t| t.map(|v| surface.mesh.positions[v as usize])).collect();
    let off = |p: &Vec3| corners.iter().map(|t| nearest_on(*t, *p).distance_squared(*p)).fold(f32::MAX, f32::min).sqrt();
    let all: Vec<f32> = samples.par_iter().map(off).collect();
    let mean_m = all.iter().sum::<f32>() / all.len().max(1) as f32;
    Measured { triangles: triangles.len(), ms, hausdorff_m: all.into_iter().fold(0.0, f32::max), mean_m }
}

/// Points all over a surface, by area.
fn samples(surface: &Surface, seed: Seed) -> Vec<Vec3> {
    let triangles: Vec<Corners> = surface.mesh.triangulated().map(|t| t.map(|v| surface.mesh.positions[v as usize])).collect();
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
