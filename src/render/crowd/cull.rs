//! Which of many trees a picture shows, and in which of their groups: cells against the picture's planes first, then whole cells against the
//! distances at which a group is seen, and single trees only where a cell lies across one or the other. In parallel over cells; the lists do
//! not depend on how many threads there are.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::cells::{Cell, Cells, Run};
use super::frustum::{Frustum, Side};
use super::{Batch, CullParams, Shape};
use crate::geom::Bounds;
use crate::gpu::layout::Placed;
use crate::render::drawer::PassKind;
use crate::render::scene::Viewer;
use crate::render::shadow::SunView;
use crate::render::tiles::screen_rect;
use crate::render::wind::Sway;
use crate::render::{Camera, Projection, Shot};
use crate::repr::{Facing, Seen};

/// Cells that a thread takes at a time.
const CELLS_AT_ONCE: usize = 32;

/// Who looks, whereto, and how closely.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    viewer: Viewer,
    /// What decides which trees are in the picture; another than the viewer's where that is frozen.
    camera: Camera,
    size_px: [u32; 2],
    sway: Sway,
    /// The sun's map and its side in texels, where there is one.
    sun: Option<(SunView, u32)>,
    grows: bool,
    params: CullParams,
}

impl Look {
    /// Of a picture; `frozen`: the camera that culls instead of the picture's own.
    pub fn new(shot: &Shot, frozen: Option<Camera>, sun: Option<(SunView, u32)>, params: &CullParams) -> Self {
        Self {
            viewer: Viewer::of(shot),
            camera: frozen.unwrap_or(shot.camera),
            size_px: shot.size_px,
            sway: Sway::of(&shot.wind),
            sun,
            grows: shot.grows(),
            params: params.clone(),
        }
    }

    /// Whether outlines so high grow.
    pub fn reshapes(&self, height_px: f32) -> bool {
        self.grows && height_px >= self.params.reshape_px as f32
    }

    /// How many trees a call draws.
    pub fn batch(&self) -> Batch {
        self.params.batch
    }

    fn clip_from_world(&self) -> glam::Mat4 {
        let [width, height] = self.size_px;
        self.camera.clip_from_world(width as f32 / height as f32)
    }

    /// Pixels of a metre at a point.
    fn px_per_m(&self, at: Vec3) -> f32 {
        let [plain, by_depth] = self.camera.px_per_m(self.size_px[1]);
        match self.camera.projection {
            Projection::Perspective { near_m, .. } => by_depth * near_m / self.camera.eye.distance(at).max(near_m),
            Projection::Orthographic { .. } => plain,
        }
    }
}

/// What is seen of many trees.
#[derive(Debug, Default, PartialEq)]
pub struct Culled {
    /// Numbers of trees: one list after the other.
    pub entries: Vec<u32>,
    /// The list of each group of each species, [`list_number`], for the picture and then the same for the sun.
    pub lists: Vec<Range<u32>>,
    /// Trees that are near enough to be drawn one by one: their outlines grow, or their foliage has levels of its own.
    pub near: Vec<(u16, u32)>,
    /// Where in the picture trees may be: left, top, right, bottom in pixels.
    pub rects: Vec<[f32; 4]>,
    /// Trees in the picture.
    pub trees: usize,
}

/// What a number of cells add to it.
#[derive(Default)]
struct Share {
    lists: Vec<Vec<u32>>,
    near: Vec<(u16, u32)>,
    rects: Vec<[f32; 4]>,
    trees: usize,
}

/// Asks all cells.
pub fn cull(cells: &Cells, placed: &[Placed], shapes: &[Shape], look: &Look) -> Culled {
    let groups = shapes.iter().map(|shape| shape.groups.len()).sum::<usize>();
    let first: Vec<usize> = shapes
        .iter()
        .scan(0, |sum, shape| {
            *sum += shape.groups.len();
            Some(*sum - shape.groups.len())
        })
        .collect();
    let frustum = Frustum::new(&look.clip_from_world());
    let asking = Asking { cells, placed, shapes, look, frustum, first: &first, groups };
    let shares: Vec<Share> = cells.cells.par_chunks(CELLS_AT_ONCE).filter_map(|chunk| asking.share(chunk)).collect();
    let mut culled = Culled::default();
    for list in 0..2 * groups {
        let begin = culled.entries.len() as u32;
        shares.iter().for_each(|share| culled.entries.extend(&share.lists[list]));
        culled.lists.push(begin..culled.entries.len() as u32);
    }
    for share in shares {
        culled.near.extend(share.near);
        culled.rects.extend(share.rects);
        culled.trees += share.trees;
    }
    culled.near.sort_unstable();
    culled
}

struct Asking<'a> {
    cells: &'a Cells,
    placed: &'a [Placed],
    shapes: &'a [Shape],
    look: &'a Look,
    frustum: Frustum,
    /// Number of each species' first list.
    first: &'a [usize],
    /// Lists of the picture; the sun has as many.
    groups: usize,
}

/// How a cell is asked for.
#[derive(Clone, Copy)]
struct Where {
    in_picture: Side,
    in_sun: bool,
}

impl Asking<'_> {
    /// What some cells add; `None` for nothing.
    fn share(&self, cells: &[Cell]) -> Option<Share> {
        let mut share = Share { lists: vec![vec![]; 2 * self.groups], ..Share::default() };
        let mut any = false;
        for cell in cells {
            let reach = Vec3::splat(self.look.sway.reach_m(cell.tallest_m));
            let bounds = Bounds { min: cell.bounds.min - reach, max: cell.bounds.max + reach };
            let in_picture = self.frustum.of_box(&bounds);
            let sees = |(sun, side_px): (SunView, u32)| sun.sees(bounds.center(), 0.5 * bounds.size().length(), side_px);
            let at = Where { in_picture, in_sun: self.look.sun.is_some_and(sees) };
            if at.in_picture == Side::Outside && !at.in_sun {
                continue;
            }
            any = true;
            if at.in_picture != Side::Outside {
                share.rects.extend(screen_rect(&self.look.clip_from_world(), bounds, self.look.size_px));
            }
            for run in &self.cells.runs[cell.runs.start as usize..cell.runs.end as usize] {
                self.ask(run, &bounds, at, &mut share);
            }
        }
        any.then_some(share)
    }

    /// Lists the trees of a run.
    fn ask(&self, run: &Run, bounds: &Bounds, at: Where, share: &mut Share) {
        let shape = &self.shapes[usize::from(run.species)];
        let first = self.first[usize::from(run.species)];
        let nearest_px = self.look.px_per_m(bounds.min.max(self.look.camera.eye.min(bounds.max))) * run.scales[1] * shape.height_m;
        if nearest_px < self.look.params.least_px as f32 {
            return;
        }
        let one_by_one = shape.is_near(nearest_px, self.look);
        if at.in_picture == Side::Across || one_by_one {
            let trees = run.trees.clone().filter_map(|tree| self.seen(run.species, tree, at, share));
            let trees: Vec<u32> = trees.collect();
            self.list(&trees, run, bounds, (first, PassKind::Temporary { wireframe: false }), share);
        } else if at.in_picture == Side::Inside {
            share.trees += run.trees.len();
            let trees: Vec<u32> = run.trees.clone().collect();
            self.list(&trees, run, bounds, (first, PassKind::Temporary { wireframe: false }), share);
        }
        if at.in_sun {
            // What grows in the picture casts its shadow with it.
            let drawn_alone = |tree: &u32| share.near.binary_search_by_key(tree, |(_, near)| *near).is_ok();
            let trees: Vec<u32> = run.trees.clone().filter(|tree| !one_by_one || !drawn_alone(tree)).collect();
            self.list(&trees, run, bounds, (self.groups + first, PassKind::Shadow), share);
        }
    }

    /// A tree that is in the picture and not drawn alone.
    fn seen(&self, species: u16, tree: u32, at: Where, share: &mut Share) -> Option<u32> {
        let shape = &self.shapes[usize::from(species)];
        let placed = &self.placed[tree as usize];
        let center = Vec3::from(placed.position) + placed.scale() * Vec3::Y * (shape.reach.center().y);
        let radius = placed.scale() * shape.radius_m + self.look.sway.reach_m(placed.scale() * shape.height_m);
        if at.in_picture == Side::Outside || self.frustum.of_ball(center, radius) == Side::Outside {
            return None;
        }
        share.trees += 1;
        let height_px = self.look.px_per_m(center) * placed.scale() * shape.height_m;
        if height_px < self.look.params.least_px as f32 {
            return None;
        }
        if shape.is_near(height_px, self.look) {
            share.near.push((species, tree));
            return None;
        }
        Some(tree)
    }

    /// Lists trees in each group in which they are seen, from list `first` on.
    fn list(&self, trees: &[u32], run: &Run, bounds: &Bounds, (first, kind): (usize, PassKind), share: &mut Share) {
        let shape = &self.shapes[usize::from(run.species)];
        for (group, seen) in shape.groups.iter().enumerate() {
            let list = &mut share.lists[first + group];
            match self.of_all(seen, shape.height_m, run, bounds) {
                Some(true) => list.extend(trees),
                Some(false) => {}
                None => list.extend(trees.iter().filter(|tree| {
                    let instance = self.placed[**tree as usize].instance(**tree);
                    self.look.viewer.share(shape.height_m, seen, &instance, kind) > 0.0
                })),
            }
        }
    }

    /// Whether a group is seen of every tree of a run, or of none; `None` for some.
    fn of_all(&self, seen: &Seen, height_m: f32, run: &Run, bounds: &Bounds) -> Option<bool> {
        let (eye, [plain, by_distance]) = self.look.viewer.eye_and_heights();
        let [nearest, farthest] = if by_distance < 0.0 {
            [plain; 2]
        } else {
            let nearest_m = eye.distance(eye.clamp(bounds.min, bounds.max));
            let farthest_m = (eye - bounds.min).abs().max((eye - bounds.max).abs()).length();
            let heights = |way_m: f32, scale: f32| (plain + by_distance * way_m) / (scale * height_m);
            [heights(nearest_m, run.scales[1]), heights(farthest_m, run.scales[0])]
        };
        if farthest <= seen.appears[0] && seen.appears[1] > 0.0 || nearest >= seen.vanishes[1] {
            return Some(false);
        }
        let all = nearest >= seen.appears[1] && farthest <= seen.vanishes[0];
        (all && matches!(seen.facing, Facing::Any | Facing::Own { .. })).then_some(true)
    }
}
