//! Leaves as groups of parallel slices, one group per azimuth, fading with the angle to the viewer; trunk and limbs stay geometry
//! (Jakulin 2000, as told in Lluch et al. 2004 §2, Truelsen §2.2 and She fig. 2c): "six slice groups forming a 60° angle between them, and
//! containing five slices each. A total of 30 textures".
//!
//! Where Jakulin blends sorted slices, opacity here thins them out by hashed alpha, so that order never shows. Metres.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::card::{self, Card};
use super::source::{is_hollow, opened};
use super::{BuiltPart, BuiltTree, Facing, Job, Representation, Scope, Seen, SourceKind, Switch, TreeSource};
use crate::geom::Bounds;
use crate::model::Part;
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::raster::View;
use crate::{Result, Warning};

crate::params! {
    /// How leaves are sliced.
    pub struct SlicesParams {
        /// Groups at equal angles round the tree.
        groups: u32 = 6, in 3..=12, unit "", source "Jakulin 2000 (Lluch et al. 2004 §2)";
        /// Parallel slices at equal distances in each group.
        slices: u32 = 5, in 1..=15, unit "", source "Jakulin 2000 (Lluch et al. 2004 §2)";
        /// Opacity of both groups in the middle between two: 0.5 thins the crown out there, 1 makes it denser than it is.
        opacity_between: f64 = 0.8, in 0.5..=1.0, unit "", source "ours: as dense from everywhere as from in front of a group";
        /// One more group, level slices for who looks from above.
        level: Switch = Switch::Off, unit "", source "Lluch et al. 2004 §2: Jakulin's is for viewers on the ground";
        /// Texels along the longer side of a group; its slices are cut to what they hold.
        texture_px: PowerOfTwo = PowerOfTwo(256), in 16..=2048, unit "px", source "Truelsen table 4: 1024 to 64";
    }
}

/// The level slices are not seen by who looks at them at a flatter angle than the first, all of them at the second. Degrees.
const LEVEL_FADES_DEG: [f32; 2] = [30.0, 60.0];

/// Slices of leaves round a tree of wood.
pub struct Slices;

impl Representation for Slices {
    fn id(&self) -> &'static str {
        "slices"
    }

    fn name(&self) -> &'static str {
        "Slices"
    }

    fn citation(&self) -> &'static str {
        "Jakulin 2000, as told by Lluch et al. 2004 §2, Truelsen & Bonding 2008 §2.2 and fig. 1, She et al. 2018 fig. 2c"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Foliage]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        SlicesParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.without_extent()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: SlicesParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let foliage = opened(job.source.parts(job.scope));
        let leaves: Vec<&Part> = foliage.iter().map(|part| &**part).collect();
        let Some(crown) = job.source.bounds(job.scope) else {
            let bare = Warning::new("no-leaves", "the tree has no leaves to slice: only its wood is shown");
            return Ok(BuiltTree { warnings: vec![bare], ..BuiltTree::new(bounds, vec![]) });
        };

        let mut groups: Vec<(Vec<Card>, Facing)> = (0..params.groups)
            .map(|k| {
                let axes = View::axes_from(TAU * k as f32 / params.groups as f32, 0.0);
                (sliced(&leaves, &format!("group_{k}"), axes, &params), side_facing(axes[2], &params))
            })
            .collect();
        if params.level == Switch::On {
            let cosines = LEVEL_FADES_DEG.map(|deg| deg.to_radians().sin());
            let facing = Facing::Toward { axis: Vec3::Y, cosines, level: false, both_sides: false };
            groups.push((sliced(&leaves, "level", View::axes_from(0.0, 0.5 * PI), &params), facing));
        }

        let (cards, facings): (Vec<Card>, Vec<Facing>) =
            groups.into_iter().flat_map(|(cards, facing)| cards.into_iter().map(move |card| (card, facing))).unzip();
        let anchor = crown.center();
        let taken = card::captured(job.capture, &leaves, &cards)?;
        let parts = taken
            .into_iter()
            .zip(facings)
            .filter_map(|(part, facing)| Some(BuiltPart::still(part?).seen(Seen { anchor, facing, ..Seen::default() })))
            .collect();
        Ok(BuiltTree::new(bounds, parts))
    }
}

/// The slices of one group, back to front: each shows its own slab, cut to what that holds, and stands in its middle. A slab out of a shell
/// would be a ring with nothing in it: there the front half's slices show all before them, too, and the others the inside of all behind.
fn sliced(leaves: &[&Part], name: &str, axes: [Vec3; 3], params: &SlicesParams) -> Vec<Card> {
    let points = leaves.iter().flat_map(|part| part.surface.mesh.positions.iter().copied());
    let Some(all) = card::window_around(points, axes) else { return vec![] };
    let size = all.size();
    let texels_per_m = params.texture_px.0 as f32 / size.x.max(size.y).max(1e-6);
    let edge = |k: u32| all.min.z + size.z * k as f32 / params.slices as f32;
    let slab = |k: u32| match is_hollow(leaves) {
        true if 2 * k + 1 < params.slices => [all.min.z, edge(k + 1)],
        true => [edge(k), all.max.z],
        false => [edge(k), edge(k + 1)],
    };
    let slabs: Vec<[f32; 2]> = (0..params.slices).map(slab).collect();
    let windows = windows_of(leaves, axes, &slabs);
    windows
        .into_iter()
        .zip(0..)
        .filter_map(|(window, k)| {
            let window = window?;
            let longest_px = texels_per_m * window.size().x.max(window.size().y);
            let size_px = Card::size_px(window, longest_px.round() as u32);
            Some(Card { name: format!("{name}_slice_{k}"), axes, window, plane: 0.5 * (edge(k) + edge(k + 1)), size_px })
        })
        .collect()
}

/// Of each slab along the last of `axes`, the box around the polygons that reach into it, cut to it.
fn windows_of(leaves: &[&Part], axes: [Vec3; 3], slabs: &[[f32; 2]]) -> Vec<Option<Bounds>> {
    let mut windows = vec![None::<Bounds>; slabs.len()];
    for part in leaves {
        let mesh = &part.surface.mesh;
        for polygon in mesh.polygons() {
            let Some(b) = card::window_around(polygon.iter().map(|v| mesh.positions[*v as usize]), axes) else { continue };
            for (window, [low, high]) in windows.iter_mut().zip(slabs) {
                if b.max.z >= *low && b.min.z <= *high {
                    *window = Some(window.map_or(b, |w| Bounds { min: w.min.min(b.min), max: w.max.max(b.max) }));
                }
            }
        }
    }
    for (window, [low, high]) in windows.iter_mut().zip(slabs) {
        if let Some(window) = window {
            (window.min.z, window.max.z) = (*low, (*high).max(low + 1e-6));
        }
    }
    windows
}

/// Opacity by the angle between a group's axis and the viewer's azimuth: all within a part of the way to the next group, `opacity_between` in
/// the middle between two, nothing before the next group is faced; groups that face away are not seen.
fn side_facing(axis: Vec3, params: &SlicesParams) -> Facing {
    let step = TAU / params.groups as f32;
    let between = params.opacity_between as f32;
    // Linear in the cosine from nothing at the next group's axis, through the middle, to all.
    let (none, middle) = (step.cos(), (0.5 * step).cos());
    let all = (none + (middle - none) / between).min(1.0);
    Facing::Toward { axis, cosines: [none, all], level: true, both_sides: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster;
    use crate::repr::trial::{self, built};
    use crate::repr::{BuiltTree as Tree, Stats};

    fn slices(tree: &Tree) -> Vec<&BuiltPart> {
        tree.parts.iter().filter(|part| part.part.material.texture.is_some()).collect()
    }

    /// How much of the picture from that azimuth is covered, when each slice is thinned out at random to its opacity.
    fn covered(cards: &[&BuiltPart], view: &View) -> f64 {
        let mut open = vec![1.0f64; (view.width_px * view.height_px) as usize];
        for card in cards {
            let share = f64::from(card.seen.share_toward(view.axes[2]));
            if share > 0.0 {
                let taken = raster::render(&[(&card.part.surface, card.part.material.raster())], view, None).unwrap();
                open.iter_mut().zip(taken.coverage.as_raw()).for_each(|(o, c)| *o *= 1.0 - share * f64::from(*c) / 255.0);
            }
        }
        open.iter().map(|o| 1.0 - o).sum()
    }

    #[test]
    fn six_groups_of_five_each_in_its_own_slab() {
        let tree = built("slices", &[], &trial::tree()).unwrap();
        let cards = slices(&tree);
        assert_eq!(cards.len(), 30);
        assert_eq!(Stats::of_all(&tree).textures, 60, "each has its picture and its normals");
        for (k, group) in cards.chunks(5).enumerate() {
            let axis = View::axes_from(TAU * k as f32 / 6.0, 0.0)[2];
            let planes: Vec<f32> = group.iter().map(|card| card.part.surface.mesh.positions[0].dot(axis)).collect();
            let step = planes[1] - planes[0];
            assert!(step > 0.1 && planes.windows(2).all(|w| (w[1] - w[0] - step).abs() < 1e-4), "{planes:?}");
            assert!(group.iter().all(|card| (card.part.surface.normals[0] - axis).length() < 1e-5));
        }
    }

    #[test]
    fn a_crown_is_as_dense_from_everywhere() {
        let source = trial::tree();
        let tree = built("slices", &[], &source).unwrap();
        let cards = slices(&tree);
        for azimuth_deg in (0..60).step_by(6) {
            let view = View::around(source.points(Scope::Tree), (azimuth_deg as f32).to_radians(), 0.0, 96, 96);
            let leaves: Vec<_> = source.parts(Scope::Foliage).iter().map(|part| (&part.surface, part.material.raster())).collect();
            let truth: f64 =
                raster::render(&leaves, &view, None).unwrap().coverage.as_raw().iter().map(|c| f64::from(*c) / 255.0).sum();
            let ratio = covered(&cards, &view) / truth;
            println!("{azimuth_deg}: {ratio}");
            assert!((0.9..1.1).contains(&ratio), "{azimuth_deg}°: {ratio}");
        }
    }

    #[test]
    fn groups_that_face_away_are_dropped_and_two_are_seen_at_most() {
        let tree = built("slices", &["texture_px=16"], &trial::tree()).unwrap();
        for i in 0..360 {
            let toward = View::axes_from((i as f32).to_radians(), 0.2)[2];
            let seen = slices(&tree).into_iter().filter(|card| card.seen.share_toward(toward) > 1e-4);
            let seen: Vec<_> = seen.collect();
            assert!(
                (5..=10).contains(&seen.len()) && seen.iter().all(|card| card.part.surface.normals[0].dot(toward) > 0.4),
                "{i}"
            );
        }
    }

    #[test]
    fn level_slices_are_for_who_looks_from_above() {
        let tree = built("slices", &["level=on", "slices=3", "texture_px=32"], &trial::tree()).unwrap();
        let level: Vec<_> = slices(&tree).split_off(18);
        assert!(level.len() == 3 && level.iter().all(|card| card.seen.share_toward(Vec3::Y) == 1.0));
        assert!(level.iter().all(|card| card.seen.share_toward(Vec3::Z) == 0.0));
    }

    #[test]
    fn a_bare_tree_and_one_leaf_stand_and_a_point_is_refused() {
        let bare = built("slices", &[], &trial::bare()).unwrap();
        assert!(bare.parts.len() == 1 && bare.warnings[0].code == "no-leaves");
        assert!(!built("slices", &[], &trial::one_leaf()).unwrap().parts.is_empty());
        assert!(built("slices", &[], &trial::point()).is_err());
    }
}
