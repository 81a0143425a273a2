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
    grows: bool,
    params: CullParams,
}

impl Look {
    /// Of a picture; `frozen`: the camera that culls instead of the picture's own.
    pub fn new(shot: &Shot, frozen: Option<Camera>, params: &CullParams) -> Self {
        Self {
            viewer: Viewer::of(shot),
            camera: frozen.unwrap_or(shot.camera),
            size_px: shot.size_px,
            sway: Sway::of(&shot.wind),
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

/// What the sun looks at: its map, on which trees are as large as their texels let them be, wherever the viewer stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunLook {
    /// The map.
    pub view: SunView,
    /// Its side, texels.
    pub size_px: u32,
    viewer: Viewer,
    sway: Sway,
}

impl SunLook {
    /// Of a picture.
    pub fn new(shot: &Shot, (view, size_px): (SunView, u32)) -> Self {
        Self { view, size_px, viewer: Viewer::of(shot).at_sun(&view), sway: Sway::of(&shot.wind) }
    }
}

/// Lists of trees: one for each group of each species.
#[derive(Debug, Default, PartialEq)]
pub struct Lists {
    /// Numbers of trees: one list after the other.
    pub entries: Vec<u32>,
    /// Where each list lies.
    pub lists: Vec<Range<u32>>,
}

/// What a picture shows of many trees.
#[derive(Debug, Default, PartialEq)]
pub struct Culled {
    /// Those that are drawn together.
    pub lists: Lists,
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

impl Lists {
    fn of(shares: &[Share], groups: usize) -> Self {
        let mut all = Self::default();
        for list in 0..groups {
            let begin = all.entries.len() as u32;
            shares.iter().for_each(|share| all.entries.extend(&share.lists[list]));
            all.lists.push(begin..all.entries.len() as u32);
        }
        all
    }
}

/// Many trees, as they are asked for.
#[derive(Clone, Copy)]
pub struct Many<'a> {
    /// Where they stand.
    pub cells: &'a Cells,
    /// Each of them.
    pub placed: &'a [Placed],
    /// What they are of.
    pub shapes: &'a [Shape],
}

impl Many<'_> {
    /// What a picture shows of them.
    pub fn seen(self, look: &Look) -> Culled {
        let asking = InPicture { many: self, look, frustum: Frustum::new(&look.clip_from_world()) };
        // From front to back, so that what is hidden need not be shaded.
        let away = |cell: &Cell| look.camera.eye.distance(look.camera.eye.clamp(cell.bounds.min, cell.bounds.max));
        let mut cells: Vec<(f32, &Cell)> = self.cells.cells.par_iter().map(|cell| (away(cell), cell)).collect();
        cells.par_sort_by(|a, b| a.0.total_cmp(&b.0));
        let cells: Vec<&Cell> = cells.into_iter().map(|(_, cell)| cell).collect();
        let shares = self.shares(&cells, &|cell, share| asking.cell(cell, share));
        let mut culled = Culled { lists: Lists::of(&shares, self.groups()), ..Culled::default() };
        for share in shares {
            culled.near.extend(share.near);
            culled.rects.extend(share.rects);
            culled.trees += share.trees;
        }
        culled.near.sort_unstable();
        culled
    }

    /// What casts shadows on the sun's map.
    pub fn cast(self, look: &SunLook) -> Lists {
        let cells: Vec<&Cell> = self.cells.cells.iter().collect();
        let shares = self.shares(&cells, &|cell, share| {
            let bounds = swayed(cell, look.sway);
            if !look.view.sees(bounds.center(), 0.5 * bounds.size().length(), look.size_px) {
                return false;
            }
            for run in self.runs(cell) {
                let trees: Vec<u32> = run.trees.clone().collect();
                self.list(&trees, (run, &bounds), (&look.viewer, PassKind::Shadow), share);
            }
            true
        });
        Lists::of(&shares, self.groups())
    }

    fn groups(self) -> usize {
        self.shapes.iter().map(|shape| shape.groups.len()).sum()
    }

    fn runs(&self, cell: &Cell) -> &[Run] {
        &self.cells.runs[cell.runs.start as usize..cell.runs.end as usize]
    }

    /// What `ask` adds for each cell; it says whether anything of a cell may be seen.
    fn shares(self, cells: &[&Cell], ask: &(dyn Fn(&Cell, &mut Share) -> bool + Sync)) -> Vec<Share> {
        let groups = self.groups();
        let chunks = cells.par_chunks(CELLS_AT_ONCE);
        let share = |cells: &[&Cell]| {
            let mut share = Share { lists: vec![vec![]; groups], ..Share::default() };
            let asked = cells.iter().filter(|cell| ask(cell, &mut share)).count();
            (asked > 0).then_some(share)
        };
        chunks.filter_map(share).collect()
    }

    /// Lists trees of a run in each group in which they are seen.
    fn list(self, trees: &[u32], (run, bounds): (&Run, &Bounds), (viewer, kind): (&Viewer, PassKind), share: &mut Share) {
        let species = usize::from(run.species);
        let shape = &self.shapes[species];
        let first: usize = self.shapes[..species].iter().map(|shape| shape.groups.len()).sum();
        for (group, seen) in shape.groups.iter().enumerate() {
            let list = &mut share.lists[first + group];
            match of_all(seen, shape.height_m, viewer, (run, bounds)) {
                Some(true) => list.extend(trees),
                Some(false) => {}
                None => list.extend(trees.iter().filter(|tree| {
                    let instance = self.placed[**tree as usize].instance(**tree);
                    viewer.share(shape.height_m, seen, &instance, kind) > 0.0
                })),
            }
        }
    }
}

/// A cell's box, wherever the wind may push its trees.
fn swayed(cell: &Cell, sway: Sway) -> Bounds {
    let reach = Vec3::splat(sway.reach_m(cell.tallest_m));
    Bounds { min: cell.bounds.min - reach, max: cell.bounds.max + reach }
}

/// Asks what a picture shows.
struct InPicture<'a> {
    many: Many<'a>,
    look: &'a Look,
    frustum: Frustum,
}

impl InPicture<'_> {
    fn cell(&self, cell: &Cell, share: &mut Share) -> bool {
        let bounds = swayed(cell, self.look.sway);
        let side = self.frustum.of_box(&bounds);
        if side == Side::Outside {
            return false;
        }
        share.rects.extend(screen_rect(&self.look.clip_from_world(), bounds, self.look.size_px));
        for run in self.many.runs(cell) {
            let shape = &self.many.shapes[usize::from(run.species)];
            let nearest = self.look.camera.eye.clamp(bounds.min, bounds.max);
            let tallest_px = self.look.px_per_m(nearest) * run.scales[1] * shape.height_m;
            if tallest_px < self.look.params.least_px as f32 {
                continue;
            }
            let trees: Vec<u32> = if side == Side::Across || shape.is_near(tallest_px, self.look) {
                run.trees.clone().filter(|tree| self.shows(run.species, *tree, share)).collect()
            } else {
                share.trees += run.trees.len();
                run.trees.clone().collect()
            };
            self.many.list(&trees, (run, &bounds), (&self.look.viewer, PassKind::Temporary), share);
        }
        true
    }

    /// Whether a tree is in the picture and not drawn by itself.
    fn shows(&self, species: u16, tree: u32, share: &mut Share) -> bool {
        let shape = &self.many.shapes[usize::from(species)];
        let placed = &self.many.placed[tree as usize];
        let scale = placed.scale();
        let center = Vec3::from(placed.position) + scale * shape.reach.center().y * Vec3::Y;
        let radius = scale * shape.radius_m + self.look.sway.reach_m(scale * shape.height_m);
        if self.frustum.of_ball(center, radius) == Side::Outside {
            return false;
        }
        let height_px = self.look.px_per_m(center) * scale * shape.height_m;
        if height_px < self.look.params.least_px as f32 {
            return false;
        }
        share.trees += 1;
        let near = shape.is_near(height_px, self.look);
        if near {
            share.near.push((species, tree));
        }
        !near
    }
}

/// Whether a group is seen of every tree of a run, or of none; `None` for some.
fn of_all(seen: &Seen, height_m: f32, viewer: &Viewer, (run, bounds): (&Run, &Bounds)) -> Option<bool> {
    let (eye, [plain, by_distance]) = viewer.eye_and_heights();
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
