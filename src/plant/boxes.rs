//! Bounding boxes of branches in one pass (Lluch04 §3.2.1), metres.
//!
//! The paper updates every open box at every module. A box that closes hands its extent to the box it lies in, which comes to the
//! same and costs nothing with depth (ours).

use glam::Vec3;

use super::skeleton::{Bone, BoneKind, Branch, Skeleton};
use crate::geom::Bounds;

/// The box of one branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchBox {
    /// The box that it lies in, by number; `None` for the whole plant.
    pub parent: Option<u32>,
    /// How many brackets are open round it: boxes of one level are one level of detail.
    pub level: u32,
    /// Its extent; `None` for a branch without wood or leaf.
    pub bounds: Option<Bounds>,
}

/// A box for every branch of the skeleton, in its order; one for the whole plant when it has no branches listed.
pub fn of(skeleton: &Skeleton) -> Vec<BranchBox> {
    let whole =
        Branch { parent: None, level: 0, bones: 0..skeleton.bones.len() as u32, polygons: 0..skeleton.polygons.len() as u32 };
    let branches = if skeleton.branches.is_empty() { std::slice::from_ref(&whole) } else { skeleton.branches.as_slice() };
    let mut boxes: Vec<BranchBox> = branches.iter().map(|b| BranchBox { parent: b.parent, level: b.level, bounds: None }).collect();

    // Every bone goes to the innermost box that is open at its place in the chain: the last one that began and has not ended.
    add(&mut boxes, branches, |b| &b.bones, |i| skeleton.bones.get(i).map(of_bone));
    add(&mut boxes, branches, |b| &b.polygons, |i| Bounds::of(skeleton.polygons.get(i)?.corners.iter().copied()));
    // Children stand behind their parents, so backwards every box is complete before it is handed on.
    for i in (0..boxes.len()).rev() {
        if let Some(parent) = boxes[i].parent.map(|p| p as usize).filter(|p| *p < i) {
            boxes[parent].bounds = join(boxes[parent].bounds, boxes[i].bounds);
        }
    }
    boxes
}

/// Adds the extents of a branch's own items, those of its children left out.
fn add(
    boxes: &mut [BranchBox],
    branches: &[Branch],
    range: impl Fn(&Branch) -> &std::ops::Range<u32>,
    extent: impl Fn(usize) -> Option<Bounds>,
) {
    let mut open: Vec<usize> = vec![];
    let mut next = 0;
    let last = branches.iter().map(|b| range(b).end).max().unwrap_or(0);
    for item in 0..last {
        while next < branches.len() && range(&branches[next]).start <= item {
            open.push(next);
            next += 1;
        }
        while open.last().is_some_and(|b| range(&branches[*b]).end <= item) {
            open.pop();
        }
        if let Some(innermost) = open.last() {
            boxes[*innermost].bounds = join(boxes[*innermost].bounds, extent(item as usize));
        }
    }
}

fn join(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }),
        _ => a.or(b),
    }
}

/// The box of one bone: wood with the half-spheres of its joints (Truelsen fig. 10), a leaf as the rectangle of its blade.
pub fn of_bone(bone: &Bone) -> Bounds {
    let (start, end) = (bone.start, bone.end());
    let around = |point: Vec3, radius: Vec3| (point - radius, point + radius);
    let (a, b) = if bone.kind == BoneKind::Leaf {
        let side = (bone.orientation * Vec3::X).abs() * bone.start_radius_m;
        (around(start, side), around(end, side))
    } else {
        (around(start, Vec3::splat(bone.start_radius_m)), around(end, Vec3::splat(bone.end_radius_m)))
    };
    Bounds { min: a.0.min(b.0), max: a.1.max(b.1) }
}
