//! What the sun's map shows, as far as the viewer has no part in it: while that is the same the map need not be drawn again.

use super::Shot;
use super::crowd::SunLook;
use super::drawer::PassKind;
use super::scene::Viewer;
use super::shadow::SunView;
use super::wind::Sway;
use super::world::{Placed, Stand};
use crate::gpu::layout;
use crate::repr::Seen;

/// What the map shows, as far as the viewer has no part in it: while it is the same, the map is.
#[derive(Debug, Clone, PartialEq)]
pub enum Cast {
    /// A crowd of that number.
    Crowd(u64, SunLook),
    /// Trees one by one.
    Stands(SunView, u32, Vec<CastStand>),
}

/// Number of a tree, where it stands, and which of its groups are there for each instance, one after the other.
type CastStand = (u64, Vec<layout::Instance>, Vec<bool>);

impl Cast {
    /// Of what casts shadows in still air onto a map of a side; `None` for what changes a little with every step of the viewer's: what
    /// sways, fades, or has a level of its own for every distance. `alone`: of trees one by one too.
    pub fn of(shot: &Shot, placed: &Placed, (view, size_px): (SunView, u32), alone: bool) -> Option<Self> {
        if Sway::of(&shot.wind) != Sway::NONE {
            return None;
        }
        let stands = &placed.stands[..placed.casters];
        match placed.crowd {
            Some(crowd) if stands.is_empty() => crowd.cast().map(|(number, look)| Self::Crowd(number, look)),
            None if alone => {
                let viewer = Viewer::of(shot);
                let all: Option<_> = stands.iter().map(|stand| cast_stand(stand, &viewer)).collect();
                Some(Self::Stands(view, size_px, all?))
            }
            _ => None,
        }
    }
}

fn cast_stand(Stand { tree, instances }: &Stand, viewer: &Viewer) -> Option<CastStand> {
    let there = |instance: &layout::Instance, seen: &Seen| {
        // What fades by the sun's side is the same on every map of that sun, what fades by distance on none.
        let by_distance = viewer.share_by_distance(tree.height_m(), seen, instance);
        let fades = by_distance > 0.0 && by_distance < 1.0;
        (!fades).then(|| viewer.share(tree.height_m(), seen, instance, PassKind::Shadow) > 0.0)
    };
    let all: Option<_> =
        instances.iter().flat_map(|instance| tree.groups().iter().map(move |seen| there(instance, seen))).collect();
    // Foliage in levels has another for every distance.
    all.filter(|_| tree.forests().is_empty()).map(|all| (tree.number(), instances.to_vec(), all))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::Seed;
    use crate::gpu::testing::software_gpu;
    use crate::model::{Material, Part};
    use crate::render::{Camera, Picture, Renderer};
    use crate::repr::lodf::foliage;
    use crate::repr::{BuiltPart, BuiltTree, Drawn};

    /// Many leaves near by, a fifth of them from farther away.
    fn leafy() -> BuiltTree {
        let part = |leaves: usize, [near, far]: [f32; 2]| {
            let surface = foliage::synthetic(leaves, Seed(4));
            let material = Material { two_sided: true, ..Material::default() };
            let part = Part { name: "leaves".to_owned(), surface, material, crown_center: None };
            BuiltPart { part, drawn: Drawn::Still, seen: Seen::between(Vec3::new(0.0, 6.0, 0.0), near, far, 0.2) }
        };
        let (near, far) = (part(500, [0.0, 60.0]), part(100, [60.0, f32::MAX]));
        BuiltTree::new(near.part.surface.mesh.bounds().unwrap(), vec![near, far])
    }

    #[test]
    fn a_kept_map_shows_what_a_new_one_would_and_stays_only_while_nothing_changes() {
        let Some(gpu) = software_gpu() else { return };
        let mut renderer = Renderer::new(gpu).unwrap();
        let tree = renderer.upload_built(&leafy()).unwrap();
        let other = renderer.upload_built(&leafy()).unwrap();
        let see = |renderer: &mut Renderer, tree, shot: &Shot| -> Picture {
            renderer.picture(shot, &[Stand { tree, instances: &[layout::Instance::IDENTITY] }]).unwrap()
        };
        let shot = |azimuth: f32, heights: f32| {
            let from = |away_m: f32| Shot::new(Camera::orbit(Vec3::new(0.0, 6.0, 0.0), azimuth, 0.3, away_m), [160, 160]);
            from(heights * tree.height_m() / from(1.0).heights()[1])
        };
        let evening = |azimuth| Shot { toward_sun: Vec3::new(1.0, 0.3, 0.0), ..shot(azimuth, 30.0) };
        // What is looked at, and whether the map of the picture before will do: 66 heights away the near leaves fade.
        let looks = [
            (&tree, shot(0.0, 30.0), false),
            (&tree, shot(2.0, 40.0), true),
            (&other, shot(2.0, 40.0), false),
            (&tree, shot(2.0, 40.0), false),
            (&tree, evening(2.0), false),
            (&tree, evening(0.5), true),
            (&tree, shot(0.5, 66.0), false),
            (&tree, shot(0.6, 66.0), false),
            (&tree, shot(0.6, 90.0), false),
            (&tree, shot(1.6, 120.0), true),
            (&tree, Shot { stage: crate::render::Stage::Antialiased, ..shot(1.6, 120.0) }, true),
            (&tree, shot(1.6, 120.0), false),
        ];
        for (i, (tree, shot, stays)) in looks.iter().enumerate() {
            let kept = see(&mut renderer, tree, shot);
            let drawn = renderer.counted().draws;
            renderer.timed(shot, &[Stand { tree, instances: &[layout::Instance::IDENTITY] }]).unwrap();
            let lit = shot.stage == crate::render::Stage::Lit;
            assert_eq!(*stays && lit, drawn < renderer.counted().draws, "look {i}");
            // Another sun in between, so that the map is drawn anew.
            see(&mut renderer, tree, &Shot { toward_sun: Vec3::Z, ..shot.clone() });
            let anew = see(&mut renderer, tree, shot);
            assert!(kept.color == anew.color && kept.depth_m == anew.depth_m, "look {i}");
        }
    }
}
