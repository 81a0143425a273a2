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
            Item::Bone(bone) => Role::Advance(f64::from(skeleton.bones[*bone as usize].length_m)),
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

/// The wood as a chain: every bone, then its side branches in brackets, then what goes on from it. What goes on is the thickest child
/// inside as many brackets as itself.
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
    let bracketed = |bone: u32| [Item::Close, Item::Bone(bone), Item::Open];
    let mut chain = Vec::with_capacity(2 * bones.len());
    // Last in, first out: everything is pushed backwards.
    let mut waiting: Vec<Item> = roots.iter().rev().flat_map(|&root| bracketed(root)).collect();
    while let Some(item) = waiting.pop() {
        chain.push(item);
        let Item::Bone(bone) = item else { continue };
        let under = &bones[bone as usize];
        let along = children[bone as usize].iter().copied().filter(|&child| bones[child as usize].depth == under.depth);
        let along = along.reduce(|a, b| if bones[b as usize].start_radius_m > bones[a as usize].start_radius_m { b } else { a });
        waiting.extend(along.map(Item::Bone));
        waiting.extend(
            children[bone as usize].iter().rev().filter(|child| Some(**child) != along).flat_map(|&child| bracketed(child)),
        );
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Seed;
    use crate::model::grown::preset_skeleton;
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
        // The first level is a path from the ground to a tip: the longest way is what branching length prefers.
        assert!(order.branches[1] > 1 && order.branches[1] < 60, "{}", order.branches[1]);
    }

    #[test]
    fn a_skeleton_without_wood_has_no_level() {
        let order = Order::of(&Skeleton::default(), Metric::BranchingLength).unwrap();
        assert_eq!(order.level_of.len(), 0);
        assert_eq!(*order.branches.last().unwrap(), 0);
        let _ = order.level_with(0.5);
    }
}
