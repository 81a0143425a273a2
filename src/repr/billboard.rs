//! One picture of the tree on one card that turns to the viewer: the simplest stand-in there is (She §1.2.2, fig. 2a; Truelsen A.1,
//! fig. 33). More pictures, taken all round, show the nearest of them. Metres, angles in radians.

use std::f32::consts::TAU;

use glam::Vec3;

use super::card::{self, Card};
use super::{BuiltPart, BuiltTree, Drawn, Facing, Job, Representation, Seen, SourceKind, TreeSource};
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
        let pivot = foot.with_y(if upright { 0.0 } else { bounds.center().y });

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
    let why = "nothing of it is seen from the sides that it takes pictures from".to_owned();
    Error::NotApplicable { method: method.id(), source_name: source.name().to_owned(), why }
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
