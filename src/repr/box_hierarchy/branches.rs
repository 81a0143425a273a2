//! The branches of a tree, the box of each and the branch that every leaf grows on (Lluch04 §3.1, §3.2.1), metres.
//!
//! A grown tree knows its branches: they stand between the brackets of its chain. An imported one has only surfaces, and its branches are
//! derived (ours): every connected piece of wood is a branch, which grows from the larger piece that it comes nearest to; leaves grow on
//! the nearest piece. Without wood, all leaves are on one branch.

use glam::Vec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::geom::Bounds;
use crate::model::reference::{Components, Leaf, ReferenceTree};
use crate::plant::boxes::{self, BranchBox};
use crate::plant::{BoneKind, Skeleton};

/// Branches, parents before their children, and who grows where.
pub struct Branches {
    /// The box of each branch; number 0 is the whole plant.
    pub boxes: Vec<BranchBox>,
    /// The box of each leaf.
    pub leaves: Vec<Bounds>,
    /// The branch that each leaf grows on.
    pub branch_of: Vec<u32>,
}

/// A place with the number of what is there.
type Place = GeomWithData<[f32; 3], u32>;

/// Most places on wood that leaves and branches are looked up among; of more, every so-manieth is taken.
const MOST_PLACES: usize = 400_000;
/// How many places on wood there are at least over the size of the tree: long tubes have few vertices.
const STEPS: f32 = 128.0;

impl Branches {
    /// Those of a tree.
    pub fn of(tree: &ReferenceTree) -> Self {
        let corners: Vec<Vec<Vec3>> = tree.leaves.iter().map(|leaf| corners(tree, leaf)).collect();
        let leaves: Vec<Bounds> =
            corners.iter().map(|c| Bounds::of(c.iter().copied()).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO })).collect();
        let (mut boxes, branch_of) = match &tree.skeleton {
            Some(skeleton) => (boxes::of(skeleton), grown(skeleton, &corners)),
            None => derived(tree, &corners),
        };
        // Leaf quads are turned and scaled a little, and a derived box is that of its wood alone so far.
        for (leaf, branch) in leaves.iter().zip(&branch_of) {
            let bounds = &mut boxes[*branch as usize].bounds;
            *bounds = Some(bounds.map_or(*leaf, |b| joined(b, *leaf)));
        }
        for i in (1..boxes.len()).rev() {
            let (Some(parent), Some(own)) = (boxes[i].parent, boxes[i].bounds) else { continue };
            let bounds = &mut boxes[parent as usize].bounds;
            *bounds = Some(bounds.map_or(own, |b| joined(b, own)));
        }
        Self { boxes, leaves, branch_of }
    }
}

/// The box around both.
pub fn joined(a: Bounds, b: Bounds) -> Bounds {
    Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }
}

/// The corners of a leaf, its foot first where it has one: quads of grown leaves begin there, outlined blades too.
fn corners(tree: &ReferenceTree, leaf: &Leaf) -> Vec<Vec3> {
    let mesh = &tree.foliage[leaf.part as usize].surface.mesh;
    let quads = &mesh.quads[leaf.first_quad as usize..][..leaf.quads as usize];
    let triangles = &mesh.triangles[leaf.first_triangle as usize..][..leaf.triangles as usize];
    quads.iter().flatten().chain(triangles.iter().flatten()).map(|v| mesh.positions[*v as usize]).collect()
}

/// The innermost branch of each leaf: that of the bone which begins where the leaf does.
fn grown(skeleton: &Skeleton, corners: &[Vec<Vec3>]) -> Vec<u32> {
    let bones = innermost(skeleton, skeleton.bones.len(), |branch| &branch.bones);
    let polygons = innermost(skeleton, skeleton.polygons.len(), |branch| &branch.polygons);
    let leaf_bones = skeleton.bones.iter().zip(&bones).filter(|(bone, _)| bone.kind == BoneKind::Leaf);
    let feet = leaf_bones.map(|(bone, branch)| (bone.start, *branch));
    let blades = skeleton.polygons.iter().zip(&polygons).filter_map(|(p, branch)| Some((*p.corners.first()?, *branch)));
    let places = feet.chain(blades).filter(|(at, _)| at.is_finite()).map(|(at, branch)| Place::new(at.to_array(), branch));
    let places = RTree::bulk_load(places.collect());
    let branch = |corners: &Vec<Vec3>| {
        let foot = match corners[..] {
            [a, b, _, _] => 0.5 * (a + b),
            [a, ..] => a,
            [] => Vec3::ZERO,
        };
        places.nearest_neighbor(foot.to_array()).map_or(0, |place| place.data)
    };
    corners.iter().map(branch).collect()
}

/// For every bone or polygon, the last branch that began before it and has not ended.
fn innermost(skeleton: &Skeleton, count: usize, range: impl Fn(&crate::plant::Branch) -> &std::ops::Range<u32>) -> Vec<u32> {
    let mut of = vec![0; count];
    // Branches stand behind those that they grow from, so that the innermost is written last.
    for (number, branch) in (0..).zip(&skeleton.branches) {
        let range = range(branch);
        let (start, end) = (range.start as usize, (range.end as usize).min(count));
        of[start.min(end)..end].fill(number);
    }
    of
}

/// Branches of connected wood, largest first behind the whole plant, and the one nearest to each leaf.
fn derived(tree: &ReferenceTree, corners: &[Vec<Vec3>]) -> (Vec<BranchBox>, Vec<u32>) {
    let mut boxes = vec![BranchBox { parent: None, level: 0, bounds: None }];
    let pieces = pieces(tree);
    let step = pieces.iter().map(Vec::len).sum::<usize>().div_ceil(MOST_PLACES).max(1);
    let mut places: RTree<Place> = RTree::new();
    for piece in &pieces {
        let number = boxes.len() as u32;
        let nearest = piece.iter().filter_map(|at| places.nearest_neighbor_iter_with_distance_2(at.to_array()).next());
        let parent = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place.data);
        let level = boxes[parent as usize].level + 1;
        boxes.push(BranchBox { parent: Some(parent), level, bounds: Bounds::of(piece.iter().copied()) });
        piece.iter().step_by(step).for_each(|at| places.insert(Place::new(at.to_array(), number)));
    }
    let branch = |corners: &Vec<Vec3>| {
        let nearest = corners.iter().filter_map(|at| places.nearest_neighbor_iter_with_distance_2(at.to_array()).next());
        nearest.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place.data)
    };
    (boxes, corners.iter().map(branch).collect())
}

/// Places on an edge, no further apart than `step_m`; without its end, where other edges begin.
fn along([a, b]: [Vec3; 2], step_m: f32) -> impl Iterator<Item = Vec3> {
    let count = (a.distance(b) / step_m).ceil().clamp(1.0, STEPS) as u32;
    (0..count).map(move |i| a.lerp(b, i as f32 / count as f32))
}

/// Places on every connected piece of wood, the largest piece first: a branch is longer than what grows from it.
fn pieces(tree: &ReferenceTree) -> Vec<Vec<Vec3>> {
    let step_m = (tree.bounds.size().max_element() / STEPS).max(1e-4);
    let mut pieces: Vec<(f32, Vec<Vec3>)> = vec![];
    for part in &tree.wood {
        let mesh = &part.surface.mesh;
        let components = Components::of(mesh);
        for component in 0..components.len() {
            let edges = |polygon: &u32| {
                let corners = mesh.polygon(*polygon as usize);
                (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]).map(|[a, b]| [a.min(b), a.max(b)])
            };
            let mut edges: Vec<[u32; 2]> = components.polygons(component).iter().flat_map(edges).collect();
            edges.sort_unstable();
            edges.dedup();
            let at: Vec<Vec3> = edges.iter().flat_map(|edge| along(edge.map(|v| mesh.positions[v as usize]), step_m)).collect();
            let size = Bounds::of(at.iter().copied()).map_or(0.0, |b| b.size().length());
            pieces.push((size, at));
        }
    }
    // Stable: of two equal ones the first in the file comes first.
    pieces.sort_by(|a, b| b.0.total_cmp(&a.0));
    pieces.into_iter().map(|(_, piece)| piece).collect()
}
