//! Smooth transitions between levels, which Lluch03 §7 leaves open: the branches of the finer level grow in, by length and by radius (ours).
//!
//! Between levels of detail n and m > n, at `t` from 0 to 1, every bone that only m has is `t` times as long and `t` times as thick, and
//! stands where its parent then ends. Leaves grow with their twigs. Along a level's path everything therefore shrinks towards the one point
//! at which the path leaves the tree, and no branch ever comes loose. Since only bones of n carry others from outside, those of n do not move.

use crate::plant::Bone;

/// The bones of a transition. `bones` are those of the finer level, in order of output (each behind its parent), of which the first `kept`
/// are the coarser level's.
///
/// At `t` ≤ 0 these are the coarser level's bones alone, at `t` ≥ 1 all bones as they are; in between, lengths and radii grow steadily
/// with `t`, and ends move continuously. A `t` that is not a number counts as 1: the tree is then whole.
pub fn between(bones: &[Bone], kept: usize, t: f32) -> Vec<Bone> {
    let kept = kept.min(bones.len());
    if t <= 0.0 {
        return bones[..kept].to_vec();
    }
    let mut grown = bones.to_vec();
    if t < 1.0 {
        for b in kept..bones.len() {
            let Bone { parent, start, length_m, start_radius_m, end_radius_m, .. } = bones[b];
            // What a jump leaves between a parent's end and its child grows as well.
            if let Some(parent) = parent.map(|p| p as usize).filter(|&p| p < b) {
                grown[b].start = grown[parent].end() + t * (start - bones[parent].end());
            }
            grown[b].length_m = t * length_m;
            grown[b].start_radius_m = t * start_radius_m;
            grown[b].end_radius_m = t * end_radius_m;
        }
    }
    grown
}

/// The levels on either side of a level that is not whole, and how far the way between them has been gone: 2.25 is a quarter of the way
/// from level 2 to level 3. Levels run from 0, nothing, to `levels`, and so does what is returned.
pub fn split_level(level: f64, levels: usize) -> (usize, f32) {
    let level = if level.is_nan() { levels as f64 } else { level.clamp(0.0, levels as f64) };
    (level.floor() as usize, level.fract() as f32)
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::plant::BoneKind;

    /// Bones that stand on any earlier one, some after a jump.
    fn any_bones() -> impl Strategy<Value = Vec<Bone>> {
        let bone = (any::<prop::sample::Index>(), -3.0f32..3.0, 0.1f32..2.0, 0.01f32..0.2, prop_oneof![Just(0.0f32), Just(0.5f32)]);
        prop::collection::vec(bone, 1..30).prop_map(|all| {
            let mut bones: Vec<Bone> = vec![];
            for (b, (on, turn, length_m, radius, jump)) in all.into_iter().enumerate() {
                let parent = (b > 0).then(|| on.index(b) as u32);
                let from = parent.map_or(Vec3::ZERO, |p| bones[p as usize].end());
                let orientation = Quat::from_euler(glam::EulerRot::ZXY, turn, turn * 0.7, 0.0);
                bones.push(Bone {
                    parent,
                    kind: BoneKind::Branch,
                    start: from + orientation * Vec3::Y * jump,
                    orientation,
                    length_m,
                    start_radius_m: radius,
                    end_radius_m: radius * 0.8,
                    depth: 0,
                    tint: 0,
                });
            }
            bones
        })
    }

    proptest! {
        #[test]
        fn branches_grow_in_steadily(bones in any_bones(), kept in any::<prop::sample::Index>(), t in 0.0f32..1.0, step in 0.0f32..0.01) {
            let kept = kept.index(bones.len() + 1);
            prop_assert_eq!(&between(&bones, kept, 0.0), &bones[..kept]);
            prop_assert_eq!(&between(&bones, kept, 1.0), &bones);
            let (now, then) = (between(&bones, kept, t.max(1e-6)), between(&bones, kept, (t + step).clamp(1e-6, 1.0)));
            prop_assert_eq!((now.len(), then.len()), (bones.len(), bones.len()));
            prop_assert_eq!(&now[..kept], &bones[..kept]);
            let reach: f32 = bones.iter().map(|b| b.length_m + 0.5).sum();
            for (a, b) in now.iter().zip(&then) {
                prop_assert!(a.length_m <= b.length_m && a.start_radius_m <= b.start_radius_m && a.end_radius_m <= b.end_radius_m);
                // No end moves faster than the whole tree is long, at the seams 0 and 1 too.
                prop_assert!((a.end() - b.end()).length() <= 1.01 * reach * step.max(2e-6) + 1e-4);
            }
            for (b, bone) in now.iter().enumerate() {
                let Some(parent) = bone.parent else { continue };
                let gap = |all: &[Bone]| (all[b].start - all[parent as usize].end()).length();
                prop_assert!(gap(&now) <= gap(&bones) + 1e-4, "bone {} came loose", b);
            }
        }
    }

    #[test]
    fn at_the_seams_nothing_jumps() {
        let bone = |parent, y| Bone {
            parent,
            kind: BoneKind::Trunk,
            start: Vec3::Y * y,
            orientation: Quat::IDENTITY,
            length_m: 1.0,
            start_radius_m: 0.1,
            end_radius_m: 0.1,
            depth: 0,
            tint: 0,
        };
        let bones = [bone(None, 0.0), bone(Some(0), 1.0), bone(Some(1), 2.0)];
        let barely = between(&bones, 1, 1e-5);
        assert_eq!(barely.len(), 3);
        assert!(barely[1..].iter().all(|b| b.length_m <= 1e-5 && b.end_radius_m <= 1e-5 && (b.start - Vec3::Y).length() <= 2e-5));
        let half = between(&bones, 1, 0.5);
        assert_eq!((half[1].start.y, half[2].start.y, half[2].end().y), (1.0, 1.5, 2.0));
        assert_eq!(between(&bones, 1, f32::NAN), bones);
        assert_eq!(between(&bones, 9, 0.5), bones);
        assert_eq!(split_level(2.25, 3), (2, 0.25));
        assert_eq!((split_level(-1.0, 3), split_level(9.0, 3), split_level(f64::NAN, 3)), ((0, 0.0), (3, 0.0), (3, 0.0)));
    }
}
