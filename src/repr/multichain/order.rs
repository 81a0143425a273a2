//! At which level of detail each bone of a skeleton comes in (Lluch03 §5): the bones are read as the bracketed chain that they stand for,
//! and sorted by [`Multichain`].

use crate::Result;
use crate::plant::multires::{Metric, Multichain, Role, WeightedTree};
use crate::plant::{BoneKind, Skeleton};

/// The levels of the wood of a skeleton. Level of detail n, from 1, is all bones that come in at n or before.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// The level at which each bone comes in; 0 for leaves, which come in with what they stand on.
    pub level_of: Vec<u32>,
    /// How many branches the first n levels have, n from 0.
    pub branches: Vec<usize>,
}

/// A bracket or a bone of the chain.
#[derive(Clone, Copy)]
enum Item {
    Open,
    Bone(u32),
    /// A bone and all that it goes on in; written out before the chain is read.
    Axis(u32),
    Close,
}

impl Order {
    /// Sorts the branches.
    ///
    /// # Errors
    /// [`Error::UnreadableChain`](crate::Error::UnreadableChain) for a bone of a length that is not finite.
    pub fn of(skeleton: &Skeleton, metric: Metric) -> Result<Self> {
        let chain = chain(skeleton);
        let role = |item: &Item| match item {
            Item::Open => Role::Open,
            Item::Bone(bone) | Item::Axis(bone) => Role::Advance(f64::from(skeleton.bones[*bone as usize].length_m)),
            Item::Close => Role::Close,
        };
        let multichain = Multichain::new(&WeightedTree::parse(chain.iter().map(role))?, metric);
        let (mut level_of, mut branches) = (vec![0; skeleton.bones.len()], vec![0]);
        for level in 1..=multichain.levels() {
            let mut count = branches[level - 1];
            for step in multichain.level(level) {
                let mut has_wood = false;
                for item in &chain[step.modules.start as usize..step.modules.end as usize] {
                    let Item::Bone(bone) = item else { continue };
                    level_of[*bone as usize] = level as u32;
                    has_wood = true;
                }
                count += usize::from(has_wood);
            }
            branches.push(count);
        }
        Ok(Self { level_of, branches })
    }

    /// The level of detail that has that share of the branches, from 1; at least one branch.
    pub fn level_with(&self, share: f64) -> u32 {
        let all = *self.branches.last().unwrap_or(&0);
        let wanted = ((share * all as f64).round() as usize).max(1);
        let levels = self.branches.len() - 1;
        self.branches.partition_point(|count| *count < wanted).clamp(usize::from(levels > 0), levels) as u32
    }
}

/// The wood as a chain: every axis whole, then its side branches in brackets. What goes on from a bone is its thickest child inside as many
/// brackets as itself.
///
/// So an axis is one branch, as the paper's parse has it (§5.2: the modules between two brackets make one node), and limbs of one trunk
/// compete with each other. Were the trunk cut at every limb, as a turtle would need it, all limbs above would weigh against each
/// one by itself, and crowns would fill from the top.
fn chain(skeleton: &Skeleton) -> Vec<Item> {
    let bones = &skeleton.bones;
    let wood = |bone: usize| bones[bone].kind != BoneKind::Leaf;
    let mut children: Vec<Vec<u32>> = vec![vec![]; bones.len()];
    let mut roots = vec![];
    for bone in (0..bones.len()).filter(|&bone| wood(bone)) {
        match bones[bone].parent.map(|parent| parent as usize).filter(|&parent| parent < bone && wood(parent)) {
            Some(parent) => children[parent].push(bone as u32),
            None => roots.push(bone as u32),
        }
    }
    let goes_on = |bone: u32| {
        let same =
            children[bone as usize].iter().copied().filter(|&child| bones[child as usize].depth == bones[bone as usize].depth);
        same.reduce(|a, b| if bones[b as usize].start_radius_m > bones[a as usize].start_radius_m { b } else { a })
    };
    let bracketed = |bone: u32| [Item::Close, Item::Axis(bone), Item::Open];
    let mut chain = Vec::with_capacity(2 * bones.len());
    // Last in, first out: everything is pushed backwards.
    let mut waiting: Vec<Item> = roots.iter().rev().flat_map(|&root| bracketed(root)).collect();
    while let Some(item) = waiting.pop() {
        let Item::Axis(first) = item else {
            chain.push(item);
            continue;
        };
        let axis: Vec<u32> = std::iter::successors(Some(first), |&bone| goes_on(bone)).collect();
        chain.extend(axis.iter().map(|&bone| Item::Bone(bone)));
        let aside = |bone: &u32| {
            children[*bone as usize].iter().copied().filter(|child| Some(*child) != goes_on(*bone)).collect::<Vec<_>>()
        };
        let side: Vec<u32> = axis.iter().flat_map(aside).collect();
        waiting.extend(side.iter().rev().flat_map(|&child| bracketed(child)));
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;
    use crate::model::grown::preset_skeleton;
    use crate::plant::Bone;
    use crate::plant::presets::preset;

    #[test]
    fn every_level_is_a_tree_and_the_last_is_all_of_it() {
        let skeleton = preset_skeleton(preset("acacia").unwrap(), None, Seed(1)).unwrap();
        let order = Order::of(&skeleton, Metric::BranchingLength).unwrap();
        for (bone, level) in skeleton.bones.iter().zip(&order.level_of) {
            assert_eq!(*level == 0, bone.kind == BoneKind::Leaf);
            let parent = bone.parent.map_or(1, |parent| order.level_of[parent as usize]);
            assert!(*level == 0 || (1..=*level).contains(&parent), "a bone of level {level} stands on one of level {parent}");
        }
        let last = (order.branches.len() - 1) as u32;
        assert_eq!((order.level_with(1.0), order.level_with(0.0)), (last, 1));
        assert!(order.branches.is_sorted());
        // The first level is a way from the ground to a tip.
        assert!((2..20).contains(&order.branches[1]), "{}", order.branches[1]);
    }

    /// Five equal limbs along a trunk: each is there before any has a second twig.
    #[test]
    fn limbs_of_a_trunk_come_in_together() {
        let bone = |parent, depth, start| Bone {
            parent,
            kind: BoneKind::Branch,
            start,
            orientation: glam::Quat::IDENTITY,
            length_m: 1.0,
            start_radius_m: 0.1,
            end_radius_m: 0.1,
            depth,
            tint: 0,
        };
        let mut skeleton = Skeleton::default();
        for trunk in 0..5u32 {
            let below = (trunk > 0).then(|| 4 * (trunk - 1));
            skeleton.bones.push(bone(below, 0, glam::Vec3::Y * trunk as f32));
            skeleton.bones.push(bone(Some(4 * trunk), 1, glam::Vec3::ZERO));
            skeleton.bones.extend([0, 1].map(|_| bone(Some(4 * trunk + 1), 2, glam::Vec3::ZERO)));
        }
        let order = Order::of(&skeleton, Metric::BranchingLength).unwrap();
        for trunk in 0..5 {
            let [stem, limb, twig, second] = [0, 1, 2, 3].map(|k| order.level_of[4 * trunk + k]);
            assert!(stem == 1 && limb <= 5 && twig == limb && second > 5, "{:?}", order.level_of);
        }
        assert_eq!(order.branches, [0, 3, 5, 7, 9, 11, 12, 13, 14, 15, 16]);
    }

    #[test]
    fn a_skeleton_without_wood_has_no_level() {
        let order = Order::of(&Skeleton::default(), Metric::BranchingLength).unwrap();
        assert_eq!(order.level_of.len(), 0);
        assert_eq!(*order.branches.last().unwrap(), 0);
        let _ = order.level_with(0.5);
    }
}
