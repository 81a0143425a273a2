//! Which bones make one branch: the chains of bones along which the mesh shares its vertices.

use crate::plant::{Bone, BoneKind, Skeleton};

/// Bones of less length make no ring of their own, metres.
const SHORTEST_M: f32 = 1e-5;

/// A bone that turns off by more than this (the cosine of 75°) begins a branch of its own, since a shared ring there would pinch.
const SHARPEST_TURN: f32 = 0.26;

/// The bones of every branch, from its base to its tip, by number. Every drawable piece of wood is in exactly one.
///
/// A bone goes on in the child of its own bracket depth; where the turtle ends in brackets only, as at a fork, in its thickest child.
pub fn limbs(skeleton: &Skeleton) -> Vec<Vec<u32>> {
    let bones = &skeleton.bones;
    let mut next: Vec<Option<u32>> = vec![None; bones.len()];
    for (number, bone) in bones.iter().enumerate().filter(|(_, bone)| drawable(bone)) {
        let Some(parent) = parent_of(bones, bone) else { continue };
        let under = &bones[parent];
        if !drawable(under) || !goes_on(under, bone) {
            continue;
        }
        let rank = |b: &Bone| (b.depth == under.depth, b.start_radius_m);
        if next[parent].is_none_or(|rival| rank(bone) > rank(&bones[rival as usize])) {
            next[parent] = Some(number as u32);
        }
    }
    let mut taken = vec![false; bones.len()];
    let mut limbs = Vec::new();
    // A bone stands before its children, so that the first one of a branch is met first.
    for (number, _) in bones.iter().enumerate().filter(|(_, bone)| drawable(bone)) {
        if taken[number] {
            continue;
        }
        let limb: Vec<u32> = std::iter::successors(Some(number as u32), |&b| next[b as usize]).collect();
        limb.iter().for_each(|&b| taken[b as usize] = true);
        limbs.push(limb);
    }
    limbs
}

/// The number of the bone that `bone` stands on, where there is one.
pub fn parent_of(bones: &[Bone], bone: &Bone) -> Option<usize> {
    bone.parent.map(|p| p as usize).filter(|&p| p < bones.len())
}

fn drawable(bone: &Bone) -> bool {
    let sizes = [bone.length_m, bone.start_radius_m, bone.end_radius_m];
    let finite = bone.start.is_finite() && bone.orientation.is_finite() && sizes.iter().all(|s| s.is_finite());
    bone.kind != BoneKind::Leaf && finite && bone.length_m > SHORTEST_M && bone.start_radius_m.max(bone.end_radius_m) > 0.0
}

fn goes_on(under: &Bone, bone: &Bone) -> bool {
    let gap = under.end().distance(bone.start);
    gap <= 0.01 * under.length_m.min(bone.length_m) + SHORTEST_M && under.heading().dot(bone.heading()) > SHARPEST_TURN
}
