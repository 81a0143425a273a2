//! Procedural multiresolution as levels of detail (Lluch03 §5, table 1, fig. 4–7): the branches that count most stay longest, and leaves go
//! with the branches that they stand on. Metres.
//!
//! Every level of a multichain is a prefix of the next finer one. So a tree is drawn as the coarsest level and what each finer one adds to
//! it: an addition fades out where the next coarser level takes over, and nothing else moves or fades. (Lluch03 §7 leaves transitions open.)
//!
//! Where it builds the wood of another method's leaves (Lluch04 §6), the branches that are left have ever fewer corners and joints as well
//! (ours): a branch of a few pixels looks the same with three sides.

mod order;

use glam::Vec3;
use rayon::prelude::*;

use self::order::Order;
use super::levels::{BAND, gap_m, middles, switches};
use super::pick::{area_m2, picked};
use super::{
    BuiltPart, BuiltTree, Job, Level, REFERENCE_FOCAL_PX, Representation, Scope, Seen, SourceKind, TreeSource, not_applicable,
};
use crate::geom::Surface;
use crate::model::Part;
use crate::model::reference::ReferenceTree;
use crate::params::{ParamSet, ParamSpec};
use crate::plant::mesh::{LeafParams, Sheet, WoodParams, leaves, wood};
use crate::plant::multires::Metric;
use crate::plant::{BoneKind, Skeleton};
use crate::{Result, Seed};

crate::params! {
    /// How levels are chosen.
    pub struct MultichainParams {
        /// Levels of detail; their shares of the branches follow table 1.
        levels: u32 = 4, in 1..=16, unit "", source "Lluch03, table 1: coarsest, medium, high and finest";
        /// What makes a branch count.
        metric: Metric = Metric::BranchingLength, unit "", source "Lluch03 §5.1 (d), its choice";
        /// How many pixels wide a branch, or a gap in the leaves, may be when it goes.
        error_px: f64 = 1.0, in 0.1..=64.0, unit "px", source "ours: what is smaller than a pixel does not show";
        /// How many pixels the surface of wood without leaves may be off where it gets fewer corners; 0 for never.
        round_px: f64 = 1.0, in 0.0..=64.0, unit "px", source "ours: what is smaller than a pixel does not show";
        /// How many pixels wide a branch of such wood may be when it goes.
        thin_px: f64 = 0.5, in 0.0..=64.0, unit "px", source "ours: in leaf, thin branches hardly show";
    }
}

/// Shares of the branches from the coarsest level to the finest: about those of both trees of table 1.
const SHARES: [f64; 4] = [0.027, 0.21, 0.51, 1.0];

/// Levels of a multichain.
pub struct Multichain;

impl Representation for Multichain {
    fn id(&self) -> &'static str {
        "multichain"
    }

    fn name(&self) -> &'static str {
        "Procedural multiresolution"
    }

    fn citation(&self) -> &'static str {
        "Lluch et al. 2003, §5, table 1, fig. 4-7"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree, Scope::Wood]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        &[SourceKind::Grown]
    }

    fn specs(&self) -> Vec<ParamSpec> {
        MultichainParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        bones(source).is_none().then(|| "it has no wood".to_owned())
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: MultichainParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let no_wood = || not_applicable(self, job.source, "it has no wood".to_owned());
        let (tree, skeleton) = bones(job.source).ok_or_else(no_wood)?;
        let order = Order::of(skeleton, params.metric)?;
        let ends = ends(&order, params.levels);
        let with_leaves = job.scope == Scope::Tree;
        let added = additions(tree, skeleton, &order, &ends, with_leaves, job.seed);
        let errors_m: Vec<f32> = (0..ends.len()).map(|level| error_m(skeleton, &order, ends[level], &added[..level])).collect();
        let switches = switches(&errors_m, params.error_px as f32, bounds.height_m());
        let levels = (0..).zip(middles(&switches)).map(|(level, distance)| Level { name: name(&order, ends[level]), distance });
        let round_px = if with_leaves { 0.0 } else { params.round_px as f32 };
        let band = if round_px > 0.0 { ROUND_BAND } else { BAND };
        let seen = |near: f32, far: f32| Seen::between(bounds.center(), near, far, band);
        let of_level = |(level, addition): (usize, Addition)| {
            let far = switches.get(level + 1).copied().unwrap_or(f32::MAX);
            let rungs = rungs(far, [round_px, params.thin_px as f32], bounds.height_m());
            let first = rungs.first().map_or(far, |rung| rung.near);
            let whole = addition.parts().into_iter().map(|part| BuiltPart::still(part).seen(seen(0.0, first)));
            let coarser = rungs.iter().map(|rung| {
                let surface = wood_of(skeleton, comes_in(&order, &ends, level), job.seed, rung.errors_m);
                BuiltPart::still(Part { surface, ..tree.wood[0].clone() }).seen(seen(rung.near, rung.far))
            });
            whole.chain(coarser).filter(|built| built.part.surface.mesh.polygon_count() > 0).collect::<Vec<_>>()
        };
        let parts = added.into_par_iter().enumerate().flat_map_iter(of_level).collect();
        Ok(BuiltTree { levels: levels.collect(), ..BuiltTree::new(bounds, parts) })
    }
}

/// The tree and its bones, where it has wood.
fn bones(source: &TreeSource) -> Option<(&ReferenceTree, &Skeleton)> {
    let TreeSource::Reference(tree) = source else { return None };
    tree.skeleton.as_ref().map(|skeleton| (&**tree, skeleton)).filter(|(tree, _)| !tree.wood.is_empty())
}

/// The last level of the multichain that each level of detail has, finest first, falling.
fn ends(order: &Order, levels: u32) -> Vec<u32> {
    let share = |number: u32| {
        // Along table 1's shares, a third of the way from each to the next.
        let at = 3.0 - 3.0 * f64::from(number) / f64::from((levels - 1).max(1));
        let (below, t) = (at.floor().min(2.0), at - at.floor().min(2.0));
        SHARES[below as usize] * (1.0 - t) + SHARES[below as usize + 1] * t
    };
    let mut ends: Vec<u32> = (0..levels).map(|number| order.level_with(share(number))).collect();
    ends.dedup();
    ends
}

fn name(order: &Order, end: u32) -> String {
    format!("{} branches", order.branches[end as usize])
}

/// Wood with fewer corners: from where to where it is seen, in heights of the tree, and how far its surface may be off, and how thick a branch
/// may be that is gone.
struct Rung {
    near: f32,
    far: f32,
    errors_m: [f32; 2],
}

/// Nearer than that, in heights of the tree, wood is as round as it was grown.
const ROUND_WITHIN: f32 = 1.06;
/// So often corners get fewer, each time twice as far away: beyond, a trunk is hardly a pixel wide.
const RUNGS: i32 = 7;
/// Over which share of its distance wood fades into such with fewer corners: they are so alike that a blend hardly shows, and both are drawn.
const ROUND_BAND: f32 = 0.05;

/// Those of wood that is seen up to `far`, whose surface may be off, and whose branches may be thick that are gone, by so many pixels.
fn rungs(far: f32, [round_px, thin_px]: [f32; 2], height_m: f32) -> Vec<Rung> {
    let near = |number: i32| ROUND_WITHIN * 2f32.powi(number);
    let rung = |number: i32| {
        let far = if number + 1 < RUNGS { far.min(near(number + 1)) } else { far };
        let pixel_m = near(number) * height_m / REFERENCE_FOCAL_PX;
        Rung { near: near(number), far, errors_m: [round_px * pixel_m, thin_px * pixel_m] }
    };
    (0..RUNGS).filter(|number| round_px > 0.0 && near(*number) < far).map(rung).collect()
}

/// What a level adds to the next coarser one.
struct Addition {
    wood: Part,
    leaves: Vec<Part>,
}

impl Addition {
    fn parts(self) -> Vec<Part> {
        std::iter::once(self.wood).chain(self.leaves).filter(|part| part.surface.mesh.polygon_count() > 0).collect()
    }
}

/// What each level of detail, finest first, adds to the next coarser one; the last is the coarsest itself.
fn additions(
    tree: &ReferenceTree,
    skeleton: &Skeleton,
    order: &Order,
    ends: &[u32],
    with_leaves: bool,
    seed: Seed,
) -> Vec<Addition> {
    let perch = if with_leaves { perches(tree, skeleton, seed) } else { vec![] };
    let addition = |level: usize| {
        let comes_in = comes_in(order, ends, level);
        let wood = Part { surface: wood_of(skeleton, &comes_in, seed, [0.0; 2]), ..tree.wood[0].clone() };
        let leaves =
            (0..if with_leaves { tree.foliage.len() } else { 0 }).map(|part| leaves_of(tree, part, &perch, &comes_in)).collect();
        Addition { wood, leaves }
    };
    (0..ends.len()).into_par_iter().map(addition).collect()
}

/// Which bones a level of detail adds to the next coarser one.
fn comes_in(order: &Order, ends: &[u32], level: usize) -> impl Fn(u32) -> bool {
    let shown = ends.get(level + 1).map_or(1, |coarser| coarser + 1)..=ends[level];
    move |bone| shown.contains(&order.level_of[bone as usize])
}

/// The wood of some of the bones, within `errors_m` of it: see [`Rung`]. A bone without length is not drawn, and all keep their numbers, by which bark is
/// placed.
fn wood_of(skeleton: &Skeleton, shown: impl Fn(u32) -> bool, seed: Seed, errors_m: [f32; 2]) -> Surface {
    let mut some = skeleton.clone();
    some.bones.iter_mut().zip(0..).filter(|(_, number)| !shown(*number)).for_each(|(bone, _)| bone.length_m = 0.0);
    wood::wood_within(&some, &WoodParams::default(), seed, errors_m)
}

/// Those leaves of one part whose bones are shown.
fn leaves_of(tree: &ReferenceTree, part: usize, perch: &[u32], shown: impl Fn(u32) -> bool) -> Part {
    let mesh = &tree.foliage[part].surface.mesh;
    let (mut triangles, mut quads) = (vec![], vec![]);
    for (leaf, _) in tree.leaves.iter().zip(perch).filter(|(leaf, perch)| leaf.part as usize == part && shown(**perch)) {
        let range = |first: u32, count: u32| first as usize..(first + count) as usize;
        triangles.extend_from_slice(&mesh.triangles[range(leaf.first_triangle, leaf.triangles)]);
        quads.extend_from_slice(&mesh.quads[range(leaf.first_quad, leaf.quads)]);
    }
    Part { surface: picked(&tree.foliage[part].surface, &triangles, &quads), ..tree.foliage[part].clone() }
}

/// The piece of wood that each leaf stands on, by number.
fn perches(tree: &ReferenceTree, skeleton: &Skeleton, seed: Seed) -> Vec<u32> {
    let bones = &skeleton.bones;
    let wood_under = |bone: u32| {
        let up = std::iter::successors(Some(bone), |&b| bones[b as usize].parent.filter(|&parent| parent < b));
        up.into_iter().find(|&b| bones[b as usize].kind != BoneKind::Leaf)
    };
    // A grown leaf is the quad of its bone's place in the list of leaves.
    let own = leaves::leaves(skeleton, Sheet { columns: 1, by_light: false }, &LeafParams::default(), seed).bones;
    let nearest = |at: Vec3| {
        let wood = bones.iter().zip(0..).filter(|(bone, _)| bone.kind != BoneKind::Leaf);
        wood.min_by(|(a, _), (b, _)| a.end().distance_squared(at).total_cmp(&b.end().distance_squared(at)))
            .map_or(0, |(_, number)| number)
    };
    let of = |(number, leaf): (usize, &crate::model::reference::Leaf)| {
        let by_number = if own.len() == tree.leaves.len() { wood_under(own[number]) } else { None };
        by_number.unwrap_or_else(|| {
            let mesh = &tree.foliage[leaf.part as usize].surface.mesh;
            let corner = mesh.quads.get(leaf.first_quad as usize).map(|q| q[0]).filter(|_| leaf.quads > 0);
            let corner = corner.or(mesh.triangles.get(leaf.first_triangle as usize).map(|t| t[0]));
            nearest(corner.map_or(Vec3::ZERO, |corner| mesh.positions[corner as usize]))
        })
    };
    tree.leaves.par_iter().enumerate().map(of).collect()
}

/// How far a level is from the tree: as much as the thickest branch that is gone is thick, or as the gaps between leaves are wide.
/// `gone` is what finer levels add.
fn error_m(skeleton: &Skeleton, order: &Order, end: u32, gone: &[Addition]) -> f32 {
    let hidden = skeleton.bones.iter().zip(&order.level_of).filter(|(_, level)| **level > end);
    let thickest = hidden.map(|(bone, _)| 2.0 * bone.start_radius_m.max(bone.end_radius_m)).fold(0.0, f32::max);
    let lost: Vec<&Surface> = gone.iter().flat_map(|addition| &addition.leaves).map(|part| &part.surface).collect();
    let lost_m2 = lost.iter().map(|surface| area_m2(&surface.mesh)).sum();
    let lost: usize = lost.iter().map(|surface| surface.mesh.polygon_count()).sum();
    let all = skeleton.bones.iter().filter(|bone| bone.kind == BoneKind::Leaf).count();
    thickest.max(gap_m(lost_m2, all.saturating_sub(lost)))
}

/// Branches and polygons of the coarsest, medium, high and finest level of a tree's wood, as table 1 of Lluch03 has them.
///
/// # Errors
/// As `Order::of`.
pub fn table(tree: &ReferenceTree, skeleton: &Skeleton, seed: Seed) -> Result<Vec<(usize, usize)>> {
    let order = Order::of(skeleton, Metric::BranchingLength)?;
    let ends = ends(&order, 4);
    let mut polygons = 0;
    let row = |(addition, end): (&Addition, &u32)| {
        polygons += addition.wood.surface.mesh.polygon_count();
        (order.branches[*end as usize], polygons)
    };
    Ok(additions(tree, skeleton, &order, &ends, false, seed).iter().zip(&ends).rev().map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::reference::Asked;
    use crate::repr::{Settings, SoftwareCapture, Stats, build};

    fn open(name: &str) -> TreeSource {
        TreeSource::open(name, &Asked::default(), Seed(1)).unwrap().0
    }

    fn built(source: &TreeSource, levels: u32) -> BuiltTree {
        let settings = Settings::default().with("levels", levels);
        let order = super::super::Order { method: "multichain", trunk: None, settings: &settings, seed: Seed(1) };
        build(&order, source, &SoftwareCapture::default()).unwrap()
    }

    #[test]
    fn wood_beside_other_leaves_loses_corners_with_distance_and_that_of_a_whole_tree_does_not() {
        let source = open("acacia");
        let wood = |trunk: &Settings, distance: f32| {
            let order = super::super::Order { method: "box-hierarchy", trunk: None, settings: trunk, seed: Seed(1) };
            let tree = build(&order, &source, &SoftwareCapture::default()).unwrap();
            let wood = tree.parts_at(distance).filter(|part| part.part.material.alpha_cutoff.is_none());
            wood.map(|part| part.part.surface.mesh.polygon_count()).sum::<usize>()
        };
        let (round, plain) = (Settings::default(), Settings::default().with("trunk.round_px", 0.0));
        assert_eq!(wood(&round, 1.0), wood(&plain, 1.0), "near");
        for (distance, times) in [(2.0, 1), (8.0, 2), (30.0, 4)] {
            assert!(times * wood(&round, distance) < wood(&plain, distance), "{distance} heights");
        }
        assert!(wood(&round, 1000.0) > 0, "the trunk stays");
        let whole = built(&source, 4);
        assert!(whole.parts.iter().all(|part| part.seen.appears[1] == 0.0), "only additions");
    }

    /// Table 1: branches and polygons at the four levels, as shares of the finest.
    #[test]
    fn table_1_in_shape() {
        let generic = [(27, 172), (233, 872), (638, 2103), (1023, 3252)];
        let acacia = [(57, 255), (414, 1430), (805, 2605), (2048, 6334)];
        let shares = |table: &[(usize, usize)], row: usize| {
            let (all, own) = (table[3], table[row]);
            [own.0 as f64 / all.0 as f64, own.1 as f64 / all.1 as f64]
        };
        for name in ["acacia", "birch"] {
            let source = open(name);
            let (tree, skeleton) = bones(&source).unwrap();
            let table = table(tree, skeleton, Seed(1)).unwrap();
            println!("{name}: {table:?}");
            for row in 0..4 {
                for ((own, a), b) in shares(&table, row).into_iter().zip(shares(&generic, row)).zip(shares(&acacia, row)) {
                    assert!(own > 0.5 * a.min(b) && own < 1.6 * a.max(b), "{name}, row {row}: {own}, not {a} or {b}");
                }
            }
        }
    }

    #[test]
    fn leaves_stand_on_branches_that_are_shown() {
        let source = open("birch");
        let tree = built(&source, 4);
        let coarse: Vec<&BuiltPart> = tree.parts_at(tree.levels[3].distance).collect();
        assert_eq!(coarse.len(), 2);
        let (wood, leaves) = (&coarse[0].part.surface.mesh, &coarse[1].part.surface.mesh);
        assert!(!leaves.quads.is_empty());
        for quad in &leaves.quads {
            let foot = 0.5 * (leaves.positions[quad[0] as usize] + leaves.positions[quad[1] as usize]);
            let nearest = wood.positions.iter().map(|p| p.distance(foot)).fold(f32::MAX, f32::min);
            assert!(nearest < 0.5, "a leaf hangs {nearest} m off");
        }
    }

    #[test]
    fn levels_add_up_to_the_tree_whatever_their_number() {
        let source = open("acacia");
        let full: usize = source.parts(Scope::Foliage).iter().map(|part| part.surface.mesh.quads.len()).sum();
        for levels in [1, 2, 4, 9] {
            let tree = built(&source, levels);
            let stats = Stats::of_levels(&tree);
            assert_eq!(stats.len(), levels as usize);
            assert!(stats.windows(2).all(|pair| pair[0].1.polygons > pair[1].1.polygons));
            let near = tree.parts_at(0.0).filter(|part| part.part.material.alpha_cutoff.is_some());
            assert_eq!(near.map(|part| part.part.surface.mesh.quads.len()).sum::<usize>(), full);
        }
    }

    #[test]
    fn what_has_no_bones_is_refused_with_the_reason() {
        let TreeSource::Reference(mut tree) = open("acacia") else { unreachable!("presets are true trees") };
        tree.skeleton = None;
        let settings = Settings::default();
        let order = super::super::Order { method: "multichain", trunk: None, settings: &settings, seed: Seed(1) };
        let error = build(&order, &TreeSource::Reference(tree), &SoftwareCapture::default()).unwrap_err();
        assert!(error.to_string().contains("it needs a grown tree, and this is an imported tree"), "{error}");
    }
}
