//! Where each level of a sphere-board takes over: as soon as its outline is off by less than a pixel or so. Distances in heights of the
//! tree, as [`Seen`] has them.

use glam::{DVec2, Vec3};

use super::SphereBoardParams;
use super::flat::Flat;
use crate::Result;
use crate::geom::Bounds;
use crate::model::{Growth, Part};
use crate::raster::{Mask, View, fill_triangle};
use crate::repr::{BuiltPart, BuiltTree, Level, REFERENCE_FOCAL_PX, Seen};

/// Over which share of its distance a level fades.
const BAND: f32 = 0.15;
/// And where crowns give way to what is seen of the tree, which is not only coarser but another thing.
const WIDE_BAND: f32 = 0.25;
/// Every level lasts so many times as far as the one before it at least, and none begins beyond the farthest.
const LEAST_STEP: f32 = 1.6;
const FARTHEST: f32 = 400.0;
/// The finest level is there up to so many heights at least.
const NEAREST: f32 = 2.5;
/// From where on a tree that is pictured from all sides is a mere card: a dozen pixels high.
const FLAT: f32 = 120.0;
/// Rows and columns on which outlines are compared.
const CELLS: u32 = 320;
/// From where they are compared: azimuth and elevation, radians.
const LOOKS: [(f32, f32); 4] = [(0.0, 0.0), (0.8, 0.3), (1.6, 0.0), (0.4, 0.9)];

/// What there is for the levels.
pub(super) struct Ladder {
    /// Crowns, finest first.
    pub meshes: [Vec<Part>; 2],
    pub far: Far,
    pub wood: Option<Part>,
    pub cards: Vec<Flat>,
}

/// The coarse level.
pub(super) enum Far {
    /// Crowns like the finer ones.
    Crowns(Vec<Part>),
    /// Parts that are seen from their own sides each.
    Looks(Vec<BuiltPart>),
}

/// All levels with their distances.
pub(super) fn built(ladder: Ladder, bounds: Bounds, growth: Growth, params: &SphereBoardParams) -> Result<BuiltTree> {
    let error_px = params.error_px;
    let height_m = bounds.height_m();
    // So far away something of that size has as many pixels as may be wrong.
    let hidden_from = |metres: f32, px: f64| REFERENCE_FOCAL_PX * metres / (height_m * px as f32);
    let grown_m = 0.5 * (growth.min_m + growth.max_m) as f32;
    let growing_until = hidden_from(grown_m, 1.0).min(FARTHEST);
    let [near, mid] = &ladder.meshes;
    let begins = |wanted: f32, after: f32| wanted.clamp((LEAST_STEP * after).min(FARTHEST), FARTHEST);
    let to_mid = begins(hidden_from(deviation_m(near, mid, bounds), error_px), NEAREST / LEAST_STEP);
    let (to_mid, to_far, to_flat) = match &ladder.far {
        Far::Crowns(far) => {
            let to_far = begins(hidden_from(deviation_m(near, far, bounds), error_px), to_mid);
            // The coarse level has no growth: it waits until that shows no more.
            let to_far = to_far.max(growing_until);
            (to_mid, to_far, begins(hidden_from(off_the_card_m(near, bounds), error_px), to_far))
        }
        Far::Looks(_) => {
            let to_far = (REFERENCE_FOCAL_PX / params.look_from_px as f32).max(NEAREST);
            (to_mid.min(to_far / LEAST_STEP), to_far, FLAT.max(LEAST_STEP * to_far))
        }
    };
    let ends = [0.0, to_mid, to_far, to_flat, f32::MAX];
    let anchor = bounds.center();
    let looks = matches!(ladder.far, Far::Looks(_));
    // Of the end at which each level begins.
    let bands = if looks { [0.0, BAND, WIDE_BAND, WIDE_BAND, 0.0] } else { [BAND; 5] };
    let seen = |level: usize| Seen {
        vanishes: Seen::between(anchor, 0.0, ends[level + 1], bands[level + 1]).vanishes,
        ..Seen::between(anchor, ends[level], f32::MAX, bands[level])
    };
    let mut parts: Vec<BuiltPart> = Vec::new();
    for (level, crowns) in ladder.meshes.into_iter().enumerate() {
        let grows = ends[level] < growing_until;
        let crowns = crowns.into_iter().map(|part| Part {
            name: format!("{}_{}", NAMES[level], part.name),
            crown_center: part.crown_center.filter(|_| grows),
            ..part
        });
        parts.extend(crowns.map(|part| BuiltPart::still(part).seen(seen(level))));
    }
    // Pictures show the wood, too.
    let last = if looks { 1 } else { 2 };
    match ladder.far {
        Far::Crowns(crowns) => parts.extend(crowns.into_iter().map(|part| {
            let part = Part { name: format!("{}_{}", NAMES[2], part.name), crown_center: None, ..part };
            BuiltPart::still(part).seen(seen(2))
        })),
        Far::Looks(looks) => parts.extend(looks.into_iter().map(|look| {
            let facing = look.seen.facing;
            look.seen(Seen { facing, ..seen(2) })
        })),
    }
    parts.extend(ladder.wood.map(|wood| BuiltPart::still(wood).seen(Seen { appears: [0.0; 2], ..seen(last) })));
    let flat = seen(3);
    parts.extend(ladder.cards.into_iter().map(|card| BuiltPart {
        part: card.part,
        drawn: card.drawn,
        seen: Seen { facing: card.facing, ..flat },
    }));
    let middle = |level: usize| {
        let begins = ends[level] * if looks { 1.0 + bands[level] } else { 1.0 };
        if level == 3 { 1.5 * to_flat } else { 0.5 * (begins.max(1.0) + ends[level + 1] * (1.0 - bands[level + 1])) }
    };
    let levels = (0..4).map(|level| Level { name: NAMES[level].to_owned(), distance: middle(level) }).collect();
    Ok(BuiltTree { levels, growth: Some(growth), ..BuiltTree::new(bounds, parts) })
}

const NAMES: [&str; 4] = ["near", "mid", "far", "flat"];

/// How far apart the outlines of two levels are on average, at the look at which they differ most, metres.
fn deviation_m(one: &[Part], other: &[Part], bounds: Bounds) -> f32 {
    let apart = LOOKS.map(|(azimuth, elevation)| {
        let axes = View::axes_from(azimuth, elevation);
        offset_m(&outline(one, axes, bounds), &outline(other, axes, bounds), bounds)
    });
    apart.into_iter().fold(0.0, f32::max)
}

/// The same of the level and the card from its front, seen from elsewhere on the ground.
fn off_the_card_m(near: &[Part], bounds: Bounds) -> f32 {
    let from = |azimuth: f32| outline(near, View::axes_from(azimuth, 0.0), bounds);
    let card = from(0.0);
    [0.8, 1.6, 2.4].map(|azimuth| offset_m(&card, &from(azimuth), bounds)).into_iter().fold(0.0, f32::max)
}

/// The area in one but not in the other, over the length of the outline.
fn offset_m(one: &Mask, other: &Mask, bounds: Bounds) -> f32 {
    let differing = one.zip(other, |a, b| a != b).count() as f32;
    let inside = |x: i64, y: i64| one.get(x, y);
    let border = |x: u32, y: u32| {
        let (x, y) = (i64::from(x), i64::from(y));
        inside(x, y) && !(inside(x - 1, y) && inside(x + 1, y) && inside(x, y - 1) && inside(x, y + 1))
    };
    let length = Mask::from_fn(CELLS, CELLS, border).count().max(1) as f32;
    differing / length * cell_m(bounds)
}

fn cell_m(bounds: Bounds) -> f32 {
    1.1 * bounds.size().length().max(1e-3) / CELLS as f32
}

/// What `parts` cover along `axes`, gaps filled: a square about the middle of the tree's foot.
fn outline(parts: &[Part], axes: [Vec3; 3], bounds: Bounds) -> Mask {
    let mut mask = Mask::new(CELLS, CELLS);
    let middle = Vec3::new(0.0, bounds.center().y, 0.0);
    let at = |p: Vec3| {
        let d = (p - middle) / cell_m(bounds);
        DVec2::new(f64::from(d.dot(axes[0])), f64::from(-d.dot(axes[1]))) + 0.5 * f64::from(CELLS)
    };
    for part in parts {
        let mesh = &part.surface.mesh;
        for corners in mesh.triangulated() {
            fill_triangle(&mut mask, corners.map(|v| at(mesh.positions[v as usize])));
        }
    }
    mask
}
