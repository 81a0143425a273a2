//! What an artist would try first: the whole tree through the simplifier of meshoptimizer, as its tool `gltfpack` does it, at several
//! shares of the triangles (issue "Image-based representations"). Metres.
//!
//! Every surface is simplified by itself to the same share. Wood may collapse across the seams of its texture and loses branches that
//! are too small to matter (`Permissive`, `Prune`). Leaves are quads of their own; what becomes of them is [`Leaves`]. Vertices are kept
//! as they are, so that normals and texture coordinates survive. How much leaf area is lost is said in warnings.
//!
//! Locking borders, so that leaves would drop out whole, is no way: the simplifier then prunes all leaves of about one size together, and
//! an acacia asked for half its leaves keeps a third, for a fifth none.

use ::meshopt::{SimplifyOptions, simplify_sloppy_decoder, simplify_with_attributes_and_locks_decoder};
use glam::Vec3;
use rayon::prelude::*;

use super::levels::{Rung, gap_m, relieving};
use super::pick::{area_m2, picked_with_quads};
use super::{BuiltTree, Job, Representation, Scope, SourceKind};
use crate::geom::Surface;
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec};
use crate::{Result, Warning};

crate::choices! {
    /// How leaves are simplified.
    pub enum Leaves {
        /// As gltfpack does unasked: leaves lose corners, then drop out, least error first (Prune).
        Corners = "corners",
        /// As gltfpack does when asked to be aggressive: corners that lie near one another become one, whatever hangs together.
        Sloppy = "sloppy",
    }
}

crate::params! {
    /// How the simplifier is used.
    pub struct MeshoptParams {
        /// What becomes of leaves.
        leaves: Leaves = Leaves::Corners, unit "", source "gltfpack's default";
        /// How many pixels an error may be high when a level takes over.
        error_px: f64 = 1.0, in 0.1..=64.0, unit "px", source "ours: what is smaller than a pixel does not show";
    }
}

/// Shares of the triangles, finest first.
const SHARES: [f32; 5] = [1.0, 0.5, 0.2, 0.05, 0.01];

/// How much a turn of the normal counts, beside a move by as much of the surface's extent: gltfpack's.
const NORMAL_WEIGHT: f32 = 0.5;

/// A level that loses more of its leaf area than this is said so.
const TOLD_LOSS: f32 = 0.01;

/// Plain simplification.
pub struct Meshopt;

impl Representation for Meshopt {
    fn id(&self) -> &'static str {
        "meshopt"
    }

    fn name(&self) -> &'static str {
        "Simplified mesh"
    }

    fn citation(&self) -> &'static str {
        "Kapoulkine, meshoptimizer (after Garland & Heckbert 1997); ours: with foliage kept apart"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree, Scope::Foliage, Scope::Wood]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::REFERENCE
    }

    fn specs(&self) -> Vec<ParamSpec> {
        MeshoptParams::specs()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: MeshoptParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let of = |scope: Scope| if job.scope == Scope::Tree || job.scope == scope { job.source.parts(scope) } else { vec![] };
        let (wood, foliage) = (of(Scope::Wood), of(Scope::Foliage));
        let leaf_area_m2: f32 = foliage.iter().map(|part| area_m2(&part.surface.mesh)).sum();
        let levels: Vec<(Rung, f32)> =
            SHARES.par_iter().map(|share| level(*share, &wood, &foliage, leaf_area_m2, params.leaves)).collect();
        let warnings =
            levels.iter().filter(|(_, lost)| *lost > TOLD_LOSS).map(|(rung, lost)| lost_leaves(&rung.name, *lost)).collect();
        let rungs = levels.into_iter().map(|(rung, _)| rung).filter(|rung| !rung.parts.is_empty()).collect();
        let (parts, levels) = relieving(rungs, bounds.center(), params.error_px as f32, bounds.height_m());
        Ok(BuiltTree { levels, warnings, ..BuiltTree::new(bounds, parts) })
    }
}

/// One level, and which share of the leaf area it has lost.
fn level(share: f32, wood: &[&Part], foliage: &[&Part], leaf_area_m2: f32, how: Leaves) -> (Rung, f32) {
    let (wood, bent): (Vec<Part>, Vec<f32>) = wood.iter().map(|part| simplified(part, share, simplified_wood)).unzip();
    let (leaves, _): (Vec<Part>, Vec<f32>) =
        foliage.iter().map(|part| simplified(part, share, |surface, count| simplified_leaves(surface, count, how))).unzip();
    let lost_m2 = leaf_area_m2 - leaves.iter().map(|part| area_m2(&part.surface.mesh)).sum::<f32>();
    let polygons = leaves.iter().map(|part| part.surface.mesh.polygon_count()).sum();
    let error_m = bent.into_iter().fold(gap_m(lost_m2, polygons), f32::max);
    let parts = wood.into_iter().chain(leaves).filter(|part| part.surface.mesh.polygon_count() > 0).collect();
    (Rung { name: format!("{:.0} %", 100.0 * share), error_m, parts }, lost_m2 / leaf_area_m2.max(f32::MIN_POSITIVE))
}

fn lost_leaves(level: &str, lost: f32) -> Warning {
    Warning::new(
        "leaves-lost",
        format!("the simplifier has dropped {:.0} % of the leaf area at its level of {level}", 100.0 * lost),
    )
}

/// The part with that share of its triangles, and how far they lie from those it had, metres.
fn simplified(part: &Part, share: f32, simplify: impl Fn(&Surface, usize) -> (Vec<u32>, f32)) -> (Part, f32) {
    let triangles = part.surface.mesh.triangles.len() + 2 * part.surface.mesh.quads.len();
    if share >= 1.0 || triangles == 0 {
        return (part.clone(), 0.0);
    }
    let (indices, error_m) = simplify(&part.surface, 3 * (share * triangles as f32).round().max(1.0) as usize);
    let corners: Vec<[u32; 3]> = indices.as_chunks().0.to_vec();
    (Part { surface: picked_with_quads(&part.surface, &corners), ..part.clone() }, error_m)
}

fn simplified_wood(surface: &Surface, count: usize) -> (Vec<u32>, f32) {
    careful(surface, count, SimplifyOptions::Permissive | SimplifyOptions::Prune)
}

fn simplified_leaves(surface: &Surface, count: usize, how: Leaves) -> (Vec<u32>, f32) {
    match how {
        Leaves::Corners => careful(surface, count, SimplifyOptions::Prune),
        Leaves::Sloppy => {
            let mut error_m = 0.0;
            let left = simplify_sloppy_decoder(&indices(surface), &places(surface), count, f32::MAX, Some(&mut error_m));
            (left, error_m * extent_m(surface))
        }
    }
}

/// The simplifier proper: collapses edges, least error first, with normals counted in.
fn careful(surface: &Surface, count: usize, options: SimplifyOptions) -> (Vec<u32>, f32) {
    let places = places(surface);
    let normals: Vec<f32> = surface.normals.iter().flat_map(|n| n.to_array()).collect();
    let weights = if surface.normals.len() == places.len() { &[NORMAL_WEIGHT; 3][..] } else { &[] };
    let (free, stride) = (vec![false; places.len()], 3 * size_of::<f32>());
    let options = options | SimplifyOptions::ErrorAbsolute;
    let (all, mut error_m) = (indices(surface), 0.0);
    let left = simplify_with_attributes_and_locks_decoder(
        &all,
        &places,
        &normals,
        weights,
        stride,
        &free,
        count,
        f32::MAX,
        options,
        Some(&mut error_m),
    );
    (left, error_m)
}

fn indices(surface: &Surface) -> Vec<u32> {
    surface.mesh.triangulated().flatten().collect()
}

fn places(surface: &Surface) -> Vec<[f32; 3]> {
    surface.mesh.positions.iter().map(Vec3::to_array).collect()
}

/// What the simplifier's relative errors are shares of.
fn extent_m(surface: &Surface) -> f32 {
    surface.mesh.bounds().map_or(0.0, |bounds| bounds.size().max_element())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;
    use crate::model::reference::Asked;
    use crate::repr::{Order, Settings, SoftwareCapture, Stats, TreeSource, build};

    fn built(settings: &Settings) -> BuiltTree {
        let (source, _) = TreeSource::open("acacia", &Asked::default(), Seed(1)).unwrap();
        let order = Order { method: "meshopt", trunk: None, settings, seed: Seed(1) };
        build(&order, &source, &SoftwareCapture::default()).unwrap()
    }

    #[test]
    fn levels_hold_their_shares_and_say_what_they_lost() {
        for how in ["corners", "sloppy"] {
            let tree = built(&Settings::default().with("leaves", how));
            let levels = Stats::of_levels(&tree);
            let full = levels[0].1.triangles as f32;
            for ((name, stats), share) in levels.iter().zip(SHARES) {
                let got = stats.triangles as f32 / full;
                assert!((0.6 * share..=1.01 * share).contains(&got), "{how}: {got} at the level of {name}");
            }
            assert_eq!((levels.len(), tree.warnings.len()), (5, 4));
            let [half, hundredth] = [&tree.warnings[0], &tree.warnings[3]].map(|warning| &warning.message);
            assert!(half.contains("at its level of 50 %") && hundredth.contains("at its level of 1 %"), "{half}; {hundredth}");
        }
    }

    #[test]
    fn vertices_stay_what_they_were() {
        let tree = built(&Settings::default());
        let of = |level: usize, name: &str| {
            let parts: Vec<_> = tree.parts_at(tree.levels[level].distance).filter(|part| part.part.name == name).collect();
            parts[0].part.surface.clone()
        };
        for name in ["wood", "leaves"] {
            let (full, tenth) = (of(0, name), of(2, name));
            let key =
                |surface: &Surface, v: usize| format!("{} {} {}", surface.mesh.positions[v], surface.normals[v], surface.uvs[v]);
            let known: std::collections::BTreeSet<String> = (0..full.normals.len()).map(|v| key(&full, v)).collect();
            assert!((0..tenth.normals.len()).all(|v| known.contains(&key(&tenth, v))), "{name}");
        }
    }

    #[test]
    fn the_leaf_area_that_is_lost_is_told() {
        let quad = |x: f32| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| Vec3::new(x + u, v, 0.0));
        let positions: Vec<Vec3> = (0..100).flat_map(|i| quad(2.0 * i as f32)).collect();
        let quads = (0..100).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect();
        let normals = vec![Vec3::Z; positions.len()];
        let mesh = crate::geom::PolyMesh { positions, triangles: vec![], quads };
        let surface = Surface { mesh, normals, ..Surface::default() };
        let part = Part { name: "leaves".to_owned(), surface, material: Default::default(), crown_center: None };
        let (rung, lost) = level(0.2, &[], &[&part], 100.0, Leaves::Corners);
        assert!((100.0 * (1.0 - lost) - area_m2(&rung.parts[0].surface.mesh)).abs() < 1e-3);
        assert!(lost > 0.5 && rung.error_m > 0.5, "{lost} {}", rung.error_m);
    }
}
