//! Which slices a tree gets: where they stand, what each shows, in which order they come (Truelsen §4.1.2, §4.2.1, fig. 12 to 15). Metres.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};

use super::foliage::{Depths, edges, window_of};
use super::params::{Arrangement, GridParams, MOST_LEVELS, Placement};
use crate::Result;
use crate::geom::Bounds;
use crate::model::Part;
use crate::raster::View;
use crate::repr::card::Card;
use crate::repr::source::is_hollow;
use crate::repr::{Facing, Job, Scope};

/// The lowest part of the wood, of the tree's height, in the middle of which the base pair crosses.
const FOOT: f32 = 0.05;

/// Level slices come as the view rises or sinks between these angles from the horizon: their sines, of 40° and 60°.
const LEVEL_COMES: [f32; 2] = [0.642_787_6, 0.866_025_4];
/// And upright ones, of which from there only edges are seen, go as it rises: all below 55°, none above 80°. From below they stay, since
/// who stands at the trunk looks up.
const UPRIGHT_GOES: [f32; 2] = [0.984_807_7, 0.819_152_04];

/// One slice.
pub struct Slice {
    /// Its picture to be taken.
    pub card: Card,
    /// Whether it shows wood beside foliage.
    pub has_wood: bool,
    /// From this level on it is drawn; 1 is the coarsest.
    pub level: usize,
    /// From where it is seen.
    pub facing: Facing,
}

/// All slices of a tree.
pub struct Plan {
    /// In the order in which they are drawn: those of level 1 first.
    pub slices: Vec<Slice>,
    /// Around the tree.
    pub bounds: Bounds,
}

impl Plan {
    /// For the tree of a job.
    ///
    /// # Errors
    /// [`Error::EmptyModel`](crate::Error::EmptyModel) for a tree of nothing.
    pub fn of(job: &Job, params: &GridParams) -> Result<Self> {
        let bounds = job.source.box_of_all()?;
        let foliage = job.source.parts(Scope::Foliage);
        let stump = stump(&job.source.parts(Scope::Wood), bounds);
        let middle = stump.unwrap_or(bounds).center();
        let planner = Planner {
            bounds,
            foot: Vec2::new(middle.x, middle.z),
            trunk_radius: stump.map_or(0.0, |stump| 0.5 * stump.size().x.max(stump.size().z)),
            is_hollow: is_hollow(&foliage),
            foliage,
            params,
        };
        let mut slices = match params.arrangement {
            Arrangement::Grid => [0.0, FRAC_PI_2].into_iter().zip(["z", "x"]).flat_map(|row| planner.row(row)).collect(),
            Arrangement::Star => planner.star(),
        };
        slices.extend(planner.level());
        // Stable: within a level, one row after the other.
        slices.sort_by_key(|slice| slice.level);
        Ok(Self { slices, bounds })
    }
}

/// Around the lowest part of the wood: where the trunk stands. `None` without any.
fn stump(wood: &[&Part], bounds: Bounds) -> Option<Bounds> {
    let low = bounds.min.y + FOOT * bounds.size().y;
    Bounds::of(wood.iter().flat_map(|part| &part.surface.mesh.positions).copied().filter(|p| p.y <= low))
}

struct Planner<'a> {
    bounds: Bounds,
    /// Where the trunk stands on the ground, x and z.
    foot: Vec2,
    /// Half its width there; 0 without wood.
    trunk_radius: f32,
    foliage: Vec<&'a Part>,
    is_hollow: bool,
    params: &'a GridParams,
}

impl Planner<'_> {
    /// Half of eq. 1's `max_tree_dimension_xy`: how far the tree reaches from its foot along X or Z, whichever is more.
    fn radius(&self) -> f32 {
        let reach = |low: f32, high: f32, foot: f32| (foot - low).max(high - foot);
        let (low, high) = (self.bounds.min, self.bounds.max);
        reach(low.x, high.x, self.foot.x).max(reach(low.z, high.z, self.foot.y)).max(1e-3)
    }

    /// Slices at right angles to the direction of azimuth `turn_rad`, side by side: the middle one through the foot.
    fn row(&self, (turn_rad, name): (f32, &str)) -> Vec<Slice> {
        let side = self.params.side_slices as usize;
        let (axes, radius) = (View::axes_from(turn_rad, 0.0), self.radius());
        let middle = axes[2].dot(Vec3::new(self.foot.x, 0.0, self.foot.y));
        // Eq. 1.
        let clip_depth = 2.0 * radius / (2 * side + 1) as f32;
        let mut planes: Vec<f32> = (0..=2 * side).map(|i| middle + (i as f32 - side as f32) * clip_depth).collect();
        if self.params.placement == Placement::Adaptive {
            Depths::of(&self.foliage, axes[2]).settle(&mut planes, side);
        }
        // A leaf at the very rim is in, whatever the rounding.
        let reach = 1.001 * radius;
        let slabs = edges(&planes, middle - reach, middle + reach);
        let slice = |i: usize| {
            let name = format!("slice {name} {}", i as i32 - side as i32);
            if i == side {
                self.base(name, axes, radius)
            } else {
                self.side(name, axes, planes[i], slabs[i], level_of(i.abs_diff(side)))
            }
        };
        (0..planes.len()).map(slice).collect()
    }

    /// Slices through the foot at equal angles, the first and the one at right angles to it the base pair.
    fn star(&self) -> Vec<Slice> {
        let quarter = 2 * self.params.side_slices as usize + 1;
        let radius = self.radius() * 2f32.sqrt();
        let ranks = spread_ranks(quarter);
        let slice = |i: usize| {
            let axes = View::axes_from(i as f32 * PI / (2 * quarter) as f32, 0.0);
            let name = format!("slice star {i}");
            match i % quarter {
                0 => self.base(name, axes, radius),
                // As deep as the grid's (eq. 1): the gaps between slices are no wider at the rim.
                at => {
                    let (middle, half) = (axes[2].dot(Vec3::new(self.foot.x, 0.0, self.foot.y)), radius / quarter as f32);
                    self.side(name, axes, middle, [middle - half, middle + half], level_of(1 + ranks[at - 1] / 2))
                }
            }
        };
        (0..2 * quarter).map(slice).collect()
    }

    /// A slice of the base pair: with the wood, and deeper than the others.
    fn base(&self, name: String, axes: [Vec3; 3], radius: f32) -> Slice {
        let plane = axes[2].dot(Vec3::new(self.foot.x, 0.0, self.foot.y));
        // A slab out of the middle of a shell would be a ring with nothing in it, be it a crown or a thick trunk.
        let quarter = self.params.base_depth as f32 * radius;
        let half = if self.is_hollow { 1.5 * radius } else { quarter.max(1.1 * self.trunk_radius) };
        let window = self.window(axes, [plane - half, plane + half]);
        Slice { card: self.card(name, axes, window, plane), has_wood: true, level: 1, facing: self.upright() }
    }

    /// Any other upright slice.
    fn side(&self, name: String, axes: [Vec3; 3], plane: f32, slab: [f32; 2], level: usize) -> Slice {
        let window = match self.params.placement {
            Placement::Uniform => self.window(axes, slab),
            Placement::Adaptive => window_of(&self.foliage, axes, slab).unwrap_or_else(|| self.window(axes, slab)),
        };
        Slice { card: self.card(name, axes, window, plane), has_wood: false, level, facing: self.upright() }
    }

    /// From where upright slices are seen: from all sides, unless others take over.
    fn upright(&self) -> Facing {
        match self.params.top_slices {
            0 => Facing::Any,
            _ => Facing::Toward { axis: Vec3::Y, cosines: UPRIGHT_GOES, level: false, both_sides: false },
        }
    }

    /// Level slices one above the other.
    fn level(&self) -> Vec<Slice> {
        let axes = View::axes_from(0.0, FRAC_PI_2);
        let depths = Depths::of(&self.foliage, Vec3::Y);
        let (low, high) = (self.bounds.min.y, self.bounds.max.y);
        let bottom = lowest(&self.foliage).unwrap_or(low);
        let count = self.params.level_slices(self.bounds.size().with_y(high - bottom)) as usize;
        let thick = (high - bottom) / count.max(1) as f32;
        let slice = |i: usize| {
            let slab = [if i == 0 { low } else { bottom + i as f32 * thick }, bottom + (i + 1) as f32 * thick + 1e-3 * thick];
            let plane = depths.mean(slab).unwrap_or(0.5 * (slab[0] + slab[1]));
            let window = self.window(axes, slab);
            let facing = Facing::Toward { axis: Vec3::Y, cosines: LEVEL_COMES, level: false, both_sides: true };
            Slice { card: self.card(format!("slice top {i}"), axes, window, plane), has_wood: true, level: 1, facing }
        };
        (0..count).map(slice).collect()
    }

    /// The whole tree, cut to a slab.
    fn window(&self, axes: [Vec3; 3], slab: [f32; 2]) -> Bounds {
        let (low, high) = (self.bounds.min, self.bounds.max);
        let corner = |i: usize| Vec3::new([low.x, high.x][i & 1], [low.y, high.y][i >> 1 & 1], [low.z, high.z][i >> 2]);
        let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
        for p in (0..8).map(corner).map(|p| Vec3::from(axes.map(|axis| axis.dot(p)))) {
            (min, max) = (min.min(p), max.max(p));
        }
        Bounds { min: min.truncate().extend(slab[0]), max: max.truncate().extend(slab[1]) }
    }

    /// A card whose texels are as large as those of a picture of the whole tree.
    fn card(&self, name: String, axes: [Vec3; 3], window: Bounds, plane: f32) -> Card {
        let longest = |size: Vec3| size.x.max(size.y).max(1e-6);
        let share = longest(window.size()) / longest(self.window(axes, [0.0; 2]).size());
        let longest_px = (share.min(1.0) * self.params.size_px.0 as f32).ceil() as u32;
        Card { name, axes, window, plane, size_px: Card::size_px(window, longest_px) }
    }
}

fn lowest(parts: &[&Part]) -> Option<f32> {
    Bounds::of(parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied())).map(|b| b.min.y)
}

/// The level of the slices that stand `step` steps from the base slice: each level adds four to the grid, two in each row (fig. 15, 27).
/// The text does not say which; ours go outwards: of all choices the silhouettes are then the most like the tree's (oak, birch and pine,
/// six azimuths at 0° and 30°: level 2 of the inner pairs 0.81, 0.54, 0.65 of intersection over union, of the middle ones 0.78, 0.53, 0.62,
/// of the outer ones 0.72, 0.49, 0.52; so with level 3).
fn level_of(step: usize) -> usize {
    (1 + step).min(MOST_LEVELS)
}

/// The slices 1 to `quarter` − 1 of a right angle, ranked such that any first of them spread over it: each as far as can be from 0, from
/// `quarter` and from those before it.
fn spread_ranks(quarter: usize) -> Vec<usize> {
    let mut taken = vec![0, quarter];
    let mut ranks = vec![0; quarter.saturating_sub(1)];
    for rank in 0..ranks.len() {
        let gap = |at: usize| taken.iter().map(|t| t.abs_diff(at)).min().unwrap_or(0);
        let at = (1..quarter).max_by_key(|at| (gap(*at), quarter - at)).unwrap_or(1);
        ranks[at - 1] = rank;
        taken.push(at);
    }
    ranks
}
