//! One picture of the tree on one card that turns to the viewer: the simplest stand-in there is (She §1.2.2, fig. 2a; Truelsen A.1,
//! fig. 33). More pictures, taken all round, show the nearest of them. Metres, angles in radians.

use std::f32::consts::TAU;

use glam::Vec3;

use super::card::{self, Card};
use super::{BuiltPart, BuiltTree, Drawn, Facing, Job, Representation, Seen, SourceKind, TreeSource, not_applicable};
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::raster::View;
use crate::{Error, Result};

crate::choices! {
    /// How a card turns to the viewer.
    pub enum Turning {
        /// About its upright axis: it stays on the ground.
        Cylindrical = "cylindrical",
        /// Wholly: from above it lies on its back.
        Spherical = "spherical",
    }
}

crate::params! {
    /// How a billboard is made.
    pub struct BillboardParams {
        /// How the card turns to the viewer.
        turning: Turning = Turning::Cylindrical, unit "", source "Truelsen A.1: a tree stays fixed to the ground";
        /// Views taken round the tree at equal angles, of which the nearest is shown; 1 shows the front to everyone.
        views: u32 = 1, in 1..=16, unit "", source "She §1.2.2: always the same appearance";
        /// How far beyond the middle between two views the farther one fades out; 0 switches at once.
        blend_deg: f64 = 0.0, in 0..=10, unit "°", source "ours: as She's, until asked for";
        /// Texels along the longer side of each picture.
        texture_px: PowerOfTwo = PowerOfTwo(512), in 16..=2048, unit "px", source "Truelsen table 4: 1024 to 64";
    }
}

/// Views are told apart by so much less than the cosine between them, so that rounding leaves no direction without one.
const OVERLAP: f32 = 1e-5;
/// Cards of two views that fade into one another stand so far apart, in sizes of the tree: pixels of both do not mix.
const APART: f32 = 2e-4;

/// A picture that turns to the viewer.
pub struct Billboard;

impl Representation for Billboard {
    fn id(&self) -> &'static str {
        "billboard"
    }

    fn name(&self) -> &'static str {
        "Billboard"
    }

    fn citation(&self) -> &'static str {
        "She et al. 2018, §1.2.2 and fig. 2a; Truelsen & Bonding 2008, appendix A.1"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        BillboardParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.without_extent()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: BillboardParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let foot = job.source.foot();
        let upright = params.turning == Turning::Cylindrical;
        let pivot = foot.with_y(if upright { foot.y } else { bounds.center().y });

        let azimuth = |k: u32| TAU * k as f32 / params.views as f32;
        let cards: Vec<Card> = (0..params.views)
            .filter_map(|k| {
                let axes = View::axes_from(azimuth(k), 0.0);
                let window = card::window_around(job.source.points(job.scope), axes)?;
                let size_px = Card::size_px(window, params.texture_px.0);
                Some(Card { name: format!("view_{k}"), axes, window, plane: axes[2].dot(foot), size_px })
            })
            .collect();
        let taken = card::captured(job.capture, &job.source.parts(job.scope), &cards)?;

        let parts: Vec<BuiltPart> = (0..params.views)
            .zip(taken.into_iter().zip(&cards))
            .filter_map(|(k, (part, card))| {
                let mut part = part?;
                part.surface = facing_front(card, foot, APART * k as f32 * bounds.size().max_element()).surface();
                let facing = nearest_of(params.views, card.axes[2], (params.blend_deg as f32).to_radians());
                let seen = Seen { anchor: pivot, facing, ..Seen::default() };
                Some(BuiltPart { drawn: Drawn::Turned { pivot, upright }, ..BuiltPart::still(part).seen(seen) })
            })
            .collect();
        if parts.is_empty() {
            return Err(nothing_seen(self, job.source));
        }
        Ok(BuiltTree::new(bounds, parts))
    }
}

/// What a method says of a tree of which its pictures show nothing.
pub(super) fn nothing_seen(method: &dyn Representation, source: &TreeSource) -> Error {
    not_applicable(method, source, "nothing of it is seen from the sides that it takes pictures from".to_owned())
}

/// The card as it stands when `foot` is in its plane and the viewer in front of it, moved a little towards him.
fn facing_front(card: &Card, foot: Vec3, nearer_m: f32) -> Card {
    let axes = View::axes_from(0.0, 0.0);
    let aside = foot.x - card.axes[0].dot(foot);
    let mut window = card.window;
    window.min.x += aside;
    window.max.x += aside;
    Card { axes, window, plane: foot.z + nearer_m, ..card.clone() }
}

/// Seen where the view from `axis` is the nearest of `views`, and `blend_rad` beyond, where it fades out under its neighbour.
fn nearest_of(views: u32, axis: Vec3, blend_rad: f32) -> Facing {
    if views == 1 {
        return Facing::Any;
    }
    let half = 0.5 * TAU / views as f32;
    let all = half.cos() - OVERLAP;
    let none = if blend_rad > 0.0 { (half + blend_rad).min(0.5 * TAU).cos().min(all) } else { all };
    Facing::Toward { axis, cosines: [none, all], level: true, both_sides: false }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::model::Part;
    use crate::raster::ALPHA_CUTOFF;
    use crate::repr::Scope;
    use crate::repr::trial::{self, built, mask, overlap};

    /// The part as who stands at that azimuth sees it turned.
    fn turned(part: &BuiltPart, azimuth_rad: f32) -> Part {
        let Drawn::Turned { pivot, .. } = part.drawn else { panic!("not a turned card") };
        let turn = Quat::from_rotation_y(azimuth_rad);
        let mut part = part.part.clone();
        part.surface.mesh.positions.iter_mut().for_each(|p| *p = pivot + turn * (*p - pivot));
        part.surface.normals.iter_mut().for_each(|n| *n = turn * *n);
        part
    }

    #[test]
    fn each_view_has_the_outline_of_the_tree_from_its_side_wherever_the_tree_stands() {
        for source in [trial::tree(), trial::tree_at(Vec3::new(7.0, 0.0, -3.0))] {
            for turning in ["cylindrical", "spherical"] {
                let tree = built("billboard", &["views=5", "texture_px=256", &format!("turning={turning}")], &source).unwrap();
                assert_eq!(tree.parts.len(), 5);
                for (k, part) in tree.parts.iter().enumerate() {
                    let azimuth = TAU * k as f32 / 5.0;
                    let view = View::around(source.points(Scope::Tree), azimuth, 0.0, 160, 160);
                    let same = overlap(&mask([&turned(part, azimuth)], &view), &mask(source.parts(Scope::Tree), &view));
                    assert!(same > 0.93, "view {k} of {}: {same}", source.name());
                }
            }
        }
    }

    #[test]
    fn every_side_shows_the_nearest_view_and_no_other() {
        for views in [2, 3, 16] {
            let tree = built("billboard", &[&format!("views={views}"), "texture_px=16"], &trial::tree()).unwrap();
            let blended = built("billboard", &[&format!("views={views}"), "blend_deg=5", "texture_px=16"], &trial::tree()).unwrap();
            for i in 0..2000 {
                let azimuth = TAU * i as f32 / 2000.0;
                for elevation in [-0.3, 0.0, 1.2, std::f32::consts::FRAC_PI_2] {
                    let toward = View::axes_from(azimuth, elevation)[2];
                    let shares: Vec<f32> = tree.parts.iter().map(|part| part.seen.share_toward(toward)).collect();
                    let between = (azimuth * views as f32 / TAU - 0.5).rem_euclid(1.0);
                    if elevation < 1.5 && (0.01..0.99).contains(&between) {
                        let nearest = (azimuth * views as f32 / TAU).round() as usize % views;
                        assert_eq!(shares[nearest], 1.0, "{azimuth} of {views}");
                        assert_eq!(shares.iter().sum::<f32>(), 1.0, "{azimuth} of {views}");
                    }
                    for tree in [&tree, &blended] {
                        let most = tree.parts.iter().map(|part| part.seen.share_toward(toward)).fold(0.0, f32::max);
                        assert_eq!(most, 1.0, "{azimuth} {elevation} of {views}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_lit_side_follows_the_sun() {
        let tree = built("billboard", &[], &trial::tree()).unwrap();
        let material = &tree.parts[0].part.material;
        let (texture, normals) = (material.texture.as_ref().unwrap(), material.normal_texture.as_ref().unwrap());
        let brightness = |sun: Vec3, left: bool| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (x, y, n) in normals.enumerate_pixels() {
                let there = f32::from(texture.get_pixel(x, y)[3]) >= 255.0 * ALPHA_CUTOFF;
                if there && (2 * x < normals.width()) == left {
                    let n = Vec3::from_slice(&n.0[..3].iter().map(|v| f32::from(*v) / 127.5 - 1.0).collect::<Vec<_>>());
                    (sum, count) = (sum + n.dot(sun).max(0.0), count + 1.0);
                }
            }
            sum / count
        };
        let tilt =
            |x: f32| brightness(Vec3::new(x, 0.3, 0.6).normalize(), true) - brightness(Vec3::new(x, 0.3, 0.6).normalize(), false);
        assert!(tilt(-0.7) > 0.15 && tilt(0.7) < -0.15, "{} {}", tilt(-0.7), tilt(0.7));
    }

    #[test]
    fn a_bare_tree_and_one_leaf_stand_and_a_point_is_refused() {
        assert_eq!(built("billboard", &["views=3"], &trial::bare()).unwrap().parts.len(), 3);
        // From its edge there is nothing of it to see.
        assert_eq!(built("billboard", &["views=4"], &trial::one_leaf()).unwrap().parts.len(), 2);
        let refused = built("billboard", &[], &trial::point()).unwrap_err().to_string();
        assert!(refused.contains("extent"), "{refused}");
        let wrong = built("billboard", &["views=17"], &trial::tree()).unwrap_err().to_string();
        assert!(wrong.contains("views") && wrong.contains("17"), "{wrong}");
    }
}
