//! What a method has built: plain data, metres in the tree's own space, the same for every method (DESIGN §4).
//!
//! A tree is a list of parts. Each says how its vertices are placed ([`Drawn`]) and when it is seen ([`Seen`]): between which distances,
//! and from which sides. Levels of detail, slices that fade, boxes that stand for branches are all parts that are seen at their own
//! distances; a renderer needs to know nothing else of the method.

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::Warning;
use crate::geom::Bounds;
use crate::model::{Growth, Part};

use super::lodf::{self, LeafForest};

/// How many pixels high a thing of one metre is at a distance of one metre, in the picture for which distances are told: 1080 rows, 45° from
/// its lower to its upper edge.
pub const REFERENCE_FOCAL_PX: f32 = 1303.68;

/// A tree as a method has built it.
#[derive(Debug, Clone)]
pub struct BuiltTree {
    /// Which method: [`Representation::id`](super::Representation::id).
    pub method: String,
    /// Of the tree that it stands for: what wind and distances are scaled by.
    pub bounds: Bounds,
    /// What it consists of, in the order in which it is drawn. What is drawn first never shows.
    pub parts: Vec<BuiltPart>,
    /// Its levels of detail, finest first; at least one.
    pub levels: Vec<Level>,
    /// How the outlines of its crowns grow; `None` where it has none.
    pub growth: Option<Growth>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// How long building took; filled in by [`build`](super::build).
    pub build_ms: f64,
}

/// A level of detail: a distance at which the tree is looked at, written to files and counted. What is seen there is its parts' own affair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// What it is called.
    pub name: String,
    /// A distance at which it is all there and nothing else is, as [`Seen`] has distances.
    pub distance: f32,
}

/// One surface of a built tree.
#[derive(Debug, Clone)]
pub struct BuiltPart {
    /// Its surface and what it is made of.
    pub part: Part,
    /// How it is placed.
    pub drawn: Drawn,
    /// When it is seen.
    pub seen: Seen,
}

/// How the vertices of a part are placed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Drawn {
    /// Where they are.
    Still,
    /// A card that faces +Z as it stands, and turns about `pivot` to whoever sees it (She §1.2.2; Truelsen A.1).
    Turned {
        /// What it turns about.
        pivot: Vec3,
        /// Only round the vertical (cylindrical); else it faces the viewer wholly (spherical).
        upright: bool,
    },
    /// A card that faces the viewer and shows the nearest of many captured views.
    Octahedral(Octahedral),
    /// Leaves that collapse the farther away they are; the part holds the original. Files have plain levels instead ([`BuiltTree::plain`]).
    #[serde(skip)]
    Forest(Arc<LeafForest>),
}

/// An octahedral impostor (Brucks 2018): views from all over the upper half sphere in one atlas. The part's texture holds colour and
/// coverage. Its `normal_texture` holds in red and green the normal n in the frame's axes, seen from its front, by the stereographic
/// projection 0.5 + 0.5 · (x, y) / (1 + z); in blue whether it is that of foliage (1) or wood (0); in alpha the depth,
/// 0.5 + 0.5 · (metres towards the viewer) / `radius_m`. Frame (i, j), from the top left, looks from the direction of
/// [`Octahedral::direction`]; its picture spans `radius_m` to all sides of `center`, with axes as `raster::View::axes_from` has them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Octahedral {
    /// Frames along each side of the atlas.
    pub grid: u32,
    /// Middle of what was captured.
    pub center: Vec3,
    /// Half the side of each picture, metres.
    pub radius_m: f32,
}

impl Octahedral {
    /// Towards the viewer of frame (i, j), unit length: the square unfolds the upper half of an octahedron, its centre on +Y.
    pub fn direction(&self, i: u32, j: u32) -> Vec3 {
        let along = |k: u32| 2.0 * k as f32 / (self.grid.max(2) - 1) as f32 - 1.0;
        let (u, v) = (along(i), along(j));
        let (x, z) = (0.5 * (u + v), 0.5 * (v - u));
        Vec3::new(x, 1.0 - x.abs() - z.abs(), z).normalize()
    }
}

/// When a part is seen. Distances are the viewer's from `anchor` in heights of the tree, as in a picture of [`REFERENCE_FOCAL_PX`]; in a
/// picture of another size or angle, those at which the tree is just as many pixels high. So what counts is the tree's size on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    /// From where distances are measured.
    pub anchor: Vec3,
    /// From where those at which it vanishes are measured instead; `None` for the same. What stands for a part of a tree vanishes just where
    /// what stands for more of it appears, which is measured from the middle of that (Lluch04 §4, fig. 8).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vanish_anchor: Option<Vec3>,
    /// Nothing of it is seen up to the first, all of it from the second on.
    pub appears: [f32; 2],
    /// All of it is seen up to the first, nothing from the second on; `f32::MAX` for never.
    pub vanishes: [f32; 2],
    /// From which sides.
    pub facing: Facing,
    /// How it fades in between.
    pub fade: Fade,
}

/// From which sides a part is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Facing {
    /// From all.
    Any,
    /// By the cosine between `axis` and the direction from the anchor to the viewer (in the sun's map: to the sun): nothing at or below
    /// `cosines[0]`, all at or above `cosines[1]`, linear between; a hard edge where they are equal. Where they fall it is the other way
    /// round: nothing at or above the first, all at or below the second.
    Toward {
        /// Unit vector, object space.
        axis: Vec3,
        /// Where it begins and where it ends to fade.
        cosines: [f32; 2],
        /// Takes the direction to the viewer in the horizontal plane: only the azimuth counts. From straight above that is +Z.
        level: bool,
        /// The other side counts as this one.
        both_sides: bool,
    },
    /// From one sector of the sphere round the anchor: by azimuth as `Toward` with `level` has it, and at the same time by the sine of the
    /// viewer's elevation. Sectors that share borders make a set of views of which the nearest is seen.
    Sector {
        /// Unit vector, object space, horizontal: the middle of the sector.
        axis: Vec3,
        /// By azimuth: nothing at or below the first cosine, all at or above the second.
        cosines: [f32; 2],
        /// Nothing below the first sine, all from the second on.
        rises: [f32; 2],
        /// All up to the first sine, nothing from the second on.
        sinks: [f32; 2],
    },
    /// Each of its polygons from both its sides: the cosine as above, with the polygon's own normal (that of its first vertex) for an axis.
    /// So many cards that cross fade edge-on in one part.
    Own {
        /// Where it begins and where it ends to fade.
        cosines: [f32; 2],
    },
}

/// How a part that is seen only in part is thinned out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fade {
    /// Pixel by pixel, by a hash of the place on the tree (Wyman & McGuire 2017).
    Hashed,
    /// By raising the cutoff of its alpha test from the material's to 1: noise in the texture's alpha tells what goes first (Truelsen
    /// §9.2).
    Alpha,
}

impl Default for Seen {
    fn default() -> Self {
        Self {
            anchor: Vec3::ZERO,
            vanish_anchor: None,
            appears: [0.0; 2],
            vanishes: [f32::MAX; 2],
            facing: Facing::Any,
            fade: Fade::Hashed,
        }
    }
}

impl Seen {
    /// Seen between two distances from `anchor`. At each end it fades over `band` (a share of that distance, 0.15 for a fifth), outwards: two
    /// levels that meet overlap, so that nothing gets thinner in between. 0 and `f32::MAX` have no end.
    pub fn between(anchor: Vec3, near: f32, far: f32, band: f32) -> Self {
        let appears = if near > 0.0 { [near * (1.0 - band), near] } else { [0.0; 2] };
        let vanishes = if far < f32::MAX { [far, far * (1.0 + band)] } else { [f32::MAX; 2] };
        Self { anchor, appears, vanishes, ..Self::default() }
    }

    /// Whether all of it is seen at any distance from every side.
    pub fn is_always(&self) -> bool {
        self.appears[1] <= 0.0 && self.vanishes[0] == f32::MAX && self.facing == Facing::Any
    }

    /// How much of it is seen at a distance, 0 to 1, whatever the side.
    pub fn share_at(&self, distance: f32) -> f32 {
        self.share_between(distance, distance)
    }

    /// How much of it is seen by a viewer at `eye`, whatever the side; object space in metres, of a tree of that height.
    pub fn share_from(&self, eye: Vec3, height_m: f32) -> f32 {
        let away = |anchor: Vec3| eye.distance(anchor) / height_m;
        self.share_between(away(self.anchor), away(self.vanish_anchor.unwrap_or(self.anchor)))
    }

    /// How much of it is seen at a distance from its anchor and another from where it vanishes, 0 to 1, whatever the side.
    pub fn share_between(&self, near: f32, far: f32) -> f32 {
        let rise = |distance: f32, [from, to]: [f32; 2]| {
            if distance < from {
                0.0
            } else if distance >= to {
                1.0
            } else {
                (distance - from) / (to - from)
            }
        };
        rise(near, self.appears) * (1.0 - rise(far, self.vanishes))
    }

    /// How much of it is seen from the direction `toward_viewer` (unit length), 0 to 1, whatever the distance; 1 where each polygon has a side
    /// of its own.
    pub fn share_toward(&self, toward_viewer: Vec3) -> f32 {
        let flat = Vec3::new(toward_viewer.x, 0.0, toward_viewer.z).normalize_or(Vec3::Z);
        let share = |cosine: f32, [none, all]: [f32; 2]| {
            if all != none { ((cosine - none) / (all - none)).clamp(0.0, 1.0) } else { f32::from(u8::from(cosine >= all)) }
        };
        match self.facing {
            Facing::Any | Facing::Own { .. } => 1.0,
            Facing::Toward { axis, cosines, level, both_sides } => {
                let cosine = axis.dot(if level { flat } else { toward_viewer });
                share(if both_sides { cosine.abs() } else { cosine }, cosines)
            }
            Facing::Sector { axis, cosines, rises, sinks } => {
                let sine = toward_viewer.y;
                share(axis.dot(flat), cosines) * share(sine, rises) * (1.0 - share(sine, sinks))
            }
        }
    }
}

impl Facing {
    /// A unit axis and finite cosines, rising or equal for polygons of their own.
    fn is_sound(&self) -> bool {
        match self {
            Self::Any => true,
            Self::Own { cosines: [none, all] } => none.is_finite() && all.is_finite() && none <= all,
            Self::Sector { axis, cosines, rises, sinks } => {
                axis.is_normalized() && [cosines, rises, sinks].iter().flat_map(|ends| ends.iter()).all(|end| end.is_finite())
            }
            Self::Toward { axis, cosines: [none, all], .. } => axis.is_normalized() && none.is_finite() && all.is_finite(),
        }
    }
}

impl Drawn {
    /// Finite numbers, and no more frames than an atlas has texels.
    fn is_sound(&self) -> bool {
        match self {
            Self::Still | Self::Forest(_) => true,
            Self::Turned { pivot, .. } => pivot.is_finite(),
            Self::Octahedral(Octahedral { grid, center, radius_m }) => {
                (2..=64).contains(grid) && center.is_finite() && radius_m.is_finite() && *radius_m > 0.0
            }
        }
    }
}

impl BuiltPart {
    /// A part that always stands where it is.
    pub fn still(part: Part) -> Self {
        Self { part, drawn: Drawn::Still, seen: Seen::default() }
    }

    /// The same, seen then.
    pub fn seen(self, seen: Seen) -> Self {
        Self { seen, ..self }
    }
}

impl BuiltTree {
    /// A tree of these parts around which `bounds` lie, with one level and nothing to say.
    pub fn new(bounds: Bounds, parts: Vec<BuiltPart>) -> Self {
        Self {
            method: String::new(),
            bounds,
            parts,
            levels: vec![Level { name: "all".to_owned(), distance: 1.0 }],
            growth: None,
            warnings: vec![],
            build_ms: 0.0,
        }
    }

    /// Height of the tree, metres: what distances are measured in.
    pub fn height_m(&self) -> f32 {
        self.bounds.height_m()
    }

    /// The parts of which anything is seen at a distance from the tree's middle.
    pub fn parts_at(&self, distance: f32) -> impl Iterator<Item = &BuiltPart> {
        self.parts.iter().filter(move |part| part.seen.share_at(distance) > 0.0)
    }

    /// The same without what only we can draw: forests of leaves become plain surfaces, one a level.
    pub fn plain(mut self) -> Self {
        let plain = |part: BuiltPart| match &part.drawn {
            Drawn::Forest(forest) => lodf::plain_levels(&part, forest),
            _ => vec![part],
        };
        self.parts = self.parts.into_iter().flat_map(plain).collect();
        self
    }

    /// This and what another method built of the rest of the tree. Levels are this one's, or the other's where this has but one, at
    /// distances near theirs at which nothing of the rest fades.
    pub fn joined(mut self, other: Self) -> Self {
        let (main, rest) = if self.levels.len() > 1 { (&self, &other) } else { (&other, &self) };
        let levels =
            main.levels.iter().map(|level| Level { distance: settled(level.distance, main, rest), ..level.clone() }).collect();
        self.levels = levels;
        self.parts.extend(other.parts);
        self.growth = self.growth.or(other.growth);
        self.warnings.extend(other.warnings);
        self
    }

    /// Checks what renderers and files rely on: parts and levels there, sound surfaces, sound distances, levels from near to far.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn check(&self) -> Result<(), String> {
        if !self.bounds.min.is_finite() || !self.bounds.max.is_finite() {
            return Err("its box is not finite".to_owned());
        }
        if self.parts.is_empty() || self.levels.is_empty() {
            return Err("nothing was built".to_owned());
        }
        for BuiltPart { part, drawn, seen } in &self.parts {
            part.check().map_err(|what| format!("{}: {what}", part.name))?;
            let ends = [seen.appears[0], seen.appears[1], seen.vanishes[0], seen.vanishes[1]];
            if !seen.anchor.is_finite()
                || seen.vanish_anchor.is_some_and(|anchor| !anchor.is_finite())
                || ends.iter().any(|d| d.is_nan() || *d < 0.0)
                || !ends.is_sorted()
            {
                return Err(format!("{}: it appears and vanishes at {ends:?}, which are no rising distances", part.name));
            }
            if !seen.facing.is_sound() || !drawn.is_sound() {
                return Err(format!("{}: its axes and pivots are not finite", part.name));
            }
        }
        let distances = self.levels.iter().map(|level| level.distance);
        if !distances.clone().is_sorted() || distances.clone().any(|d| !d.is_finite() || d < 0.0) {
            return Err("its levels do not run from near to far".to_owned());
        }
        Ok(())
    }
}

/// The distance nearest to `distance` at which as much as there is seen of the parts of `main`, and at and around which all or nothing is
/// seen of each of `rest`; `distance` itself where there is none within a factor of three.
fn settled(distance: f32, main: &BuiltTree, rest: &BuiltTree) -> f32 {
    let same = |d: f32| main.parts.iter().all(|part| part.seen.share_at(d) == part.seen.share_at(distance));
    let around = |d: f32| [0.99 * d, d, 1.01 * d];
    let whole = |d: f32| around(d).iter().all(|d| rest.parts.iter().all(|part| [0.0, 1.0].contains(&part.seen.share_at(*d))));
    let steps = (0..=60).flat_map(|step| [step, -step]);
    steps.map(|step| distance * 1.02f32.powi(step)).find(|d| same(*d) && whole(*d)).unwrap_or(distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_meets_overlaps_and_never_leaves_a_hole() {
        let near = Seen::between(Vec3::ZERO, 0.0, 10.0, 0.2);
        let far = Seen::between(Vec3::ZERO, 10.0, f32::MAX, 0.2);
        for i in 0..400 {
            let d = 0.05 * i as f32;
            assert!(near.share_at(d).max(far.share_at(d)) == 1.0, "{d}");
        }
        assert_eq!((near.share_at(7.9), far.share_at(7.9), near.share_at(12.1), far.share_at(1e9)), (1.0, 0.0, 0.0, 1.0));
        assert!((near.share_at(11.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn levels_of_a_joined_tree_are_where_nothing_fades() {
        let tree = |ends: &[f32], distances: &[f32]| {
            let part = Part { name: String::new(), surface: Default::default(), material: Default::default(), crown_center: None };
            let seen = ends.windows(2).map(|ends| Seen::between(Vec3::ZERO, ends[0], ends[1], 0.15));
            let parts = seen.map(|seen| BuiltPart::still(part.clone()).seen(seen)).collect();
            let levels = distances.iter().map(|distance| Level { name: String::new(), distance: *distance }).collect();
            BuiltTree { levels, ..BuiltTree::new(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, parts) }
        };
        let main = || tree(&[0.0, 10.0, 30.0, f32::MAX], &[5.0, 17.0, 60.0]);
        let other = || tree(&[0.0, 5.0, f32::MAX], &[2.0, 9.0]);
        let one = || tree(&[0.0, f32::MAX], &[1.0]);
        for (joined, parts_seen) in [(main().joined(other()), 2.0), (main().joined(one()), 2.0), (one().joined(main()), 2.0)] {
            let distances: Vec<f32> = joined.levels.iter().map(|level| level.distance).collect();
            assert!(distances[0] < 10.0 && distances[1..] == [17.0, 60.0], "{distances:?}");
            let shares = joined.parts.iter().map(|part| part.seen.share_at(distances[0]));
            assert!(shares.clone().all(|share| share == 0.0 || share == 1.0) && shares.sum::<f32>() == parts_seen, "{distances:?}");
        }
    }

    #[test]
    fn a_side_is_told_by_azimuth_alone_where_asked() {
        let seen = Seen {
            facing: Facing::Toward { axis: Vec3::X, cosines: [0.5, 0.5], level: true, both_sides: false },
            ..Seen::default()
        };
        let at = |azimuth_deg: f32, up: f32| {
            let (s, c) = azimuth_deg.to_radians().sin_cos();
            seen.share_toward(Vec3::new(s, up, c).normalize())
        };
        assert_eq!((at(90.0, 20.0), at(31.0, 0.0), at(29.0, 0.0), at(270.0, 0.0)), (1.0, 1.0, 0.0, 0.0));
        assert_eq!(seen.share_toward(Vec3::Y), 0.0);
        // Seen but from above.
        let facing = Facing::Toward { axis: Vec3::Y, cosines: [0.9, 0.5], level: false, both_sides: false };
        let low = Seen { facing, ..Seen::default() };
        let at = |y: f32| low.share_toward(Vec3::new((1.0 - y * y).sqrt(), y, 0.0));
        assert!(at(-1.0) == 1.0 && at(0.5) == 1.0 && (at(0.7) - 0.5).abs() < 1e-5 && at(0.95) == 0.0);
    }

    #[test]
    fn octahedral_frames_look_from_above_the_horizon_and_their_corners_along_the_axes() {
        let impostor = Octahedral { grid: 9, center: Vec3::ZERO, radius_m: 1.0 };
        assert!((impostor.direction(4, 4) - Vec3::Y).length() < 1e-6);
        assert!((impostor.direction(8, 8) - Vec3::X).length() < 1e-6 && (impostor.direction(0, 8) - Vec3::Z).length() < 1e-6);
        assert!((0..81).all(|k| impostor.direction(k % 9, k / 9).y >= 0.0));
    }
}
