//! The last level: one card that turns to the viewer round the trunk, and a level one for those who look down on it.

use glam::Vec3;

use crate::Result;
use crate::geom::Bounds;
use crate::model::Part;
use crate::raster::View;
use crate::repr::card::{self, Card, window_around};
use crate::repr::{Drawn, Facing, Job, Scope};

/// Texels along the longer side of a card: a tree so far away is a few dozen pixels high.
const TEXELS: u32 = 64;
/// Sine of the elevations between which the upright card gives way to the level one.
const HANDOVER: [f32; 2] = [0.5, 0.75];
/// By how much they overlap there.
const OVERLAP: f32 = 0.1;

/// A card: how it turns, and from where it is seen.
pub(super) struct Flat {
    pub part: Part,
    pub drawn: Drawn,
    pub facing: Facing,
}

/// The cards of the tree; none where nothing is seen.
pub(super) fn cards(job: &Job, bounds: Bounds) -> Result<Vec<Flat>> {
    let parts = job.source.parts(job.scope);
    let of_leaves = job.source.bounds(Scope::Foliage).unwrap_or(bounds);
    let sides = [(0.0, 0.0), (0.0, std::f32::consts::FRAC_PI_2)].map(|(azimuth, up)| View::axes_from(azimuth, up));
    let planes = [0.0, of_leaves.center().y];
    let names = ["front", "top"];
    let mut asked = Vec::new();
    for ((axes, plane), name) in sides.into_iter().zip(planes).zip(names) {
        let corners = parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied());
        let Some(window) = window_around(corners, axes) else { return Ok(vec![]) };
        asked.push(Card { name: name.to_owned(), axes, window, plane, size_px: Card::size_px(window, TEXELS) });
    }
    let placed = [Drawn::Turned { pivot: bounds.foot_y() * Vec3::Y, upright: true }, Drawn::Still];
    let [from, to] = HANDOVER;
    let seen = |axis, cosines| Facing::Toward { axis, cosines, level: false, both_sides: false };
    let facings = [seen(Vec3::NEG_Y, [-to, -from - OVERLAP]), seen(Vec3::Y, [from, to - OVERLAP])];
    let taken = card::captured(job.capture, &parts, &asked)?.into_iter().zip(placed).zip(facings);
    Ok(taken.filter_map(|((part, drawn), facing)| part.map(|part| Flat { part, drawn, facing })).collect())
}
