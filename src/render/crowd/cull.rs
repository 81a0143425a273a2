//! Which of many trees a picture shows, and in which of their groups: cells against the picture's planes first, then whole cells against the
//! distances at which a group is seen, and single trees only where a cell lies across one or the other. In parallel over cells; the lists do
//! not depend on how many threads there are. Where the device culls, single trees are left to it: then what comes out are the spans of those
//! that may be in a list, in the same order. Trees that may be near enough to be drawn by themselves are always asked here.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::cells::{Cell, Cells, Run};
use super::frustum::{Frustum, Side};
use super::{Batch, CullParams, Shape};
use crate::geom::Bounds;
use crate::gpu::layout::{self, CullBlock, CullList, CullSpan, Placed};
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

    /// Whether the device asks.
    pub fn on_device(&self) -> bool {
        self.params.on_device()
    }

    /// The same for the device.
    pub fn for_device(&self) -> layout::CullLook {
        let [plain, by_depth] = self.camera.px_per_m(self.size_px[1]);
        let (near_m, px_per_m) = match self.camera.projection {
            Projection::Perspective { near_m, .. } => (near_m, [0.0, by_depth * near_m]),
            Projection::Orthographic { .. } => (1.0, [plain, 0.0]),
        };
        let still = self.sway.reach_m(0.0);
        layout::CullLook {
            planes: Frustum::new(&self.clip_from_world()).planes(),
            eye: self.camera.eye.to_array(),
            near_m,
            px_per_m,
            sway: [self.sway.reach_m(1.0) - still, still],
            least_px: self.params.least_px as f32,
            ..bytemuck::Zeroable::zeroed()
        }
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

/// Neighbouring trees of a species, and what is still to be asked of them: [`CullSpan`]'s bits.
#[derive(Debug, Clone, PartialEq)]
struct Span {
    trees: Range<u32>,
    tests: u32,
}

/// Lists of trees: one for each group of each species.
#[derive(Debug, Default, PartialEq)]
pub struct Lists {
    /// Numbers of trees: one list after the other.
    pub entries: Vec<u32>,
    /// Where each list lies.
    pub lists: Vec<Range<u32>>,
}

/// Trees that may be in such lists: one of candidates for each, and one for each species of those of whom only that picture is to be asked,
/// so that they can be counted. Each begins with a whole block.
#[derive(Debug, Default, PartialEq)]
pub struct Candidates {
    /// How many there are, with those that are missing to whole blocks; with more than [`MOST_CANDIDATES`] nothing else is here.
    pub count: u64,
    /// Who they are.
    pub spans: Vec<CullSpan>,
    /// Blocks of them.
    pub blocks: Vec<CullBlock>,
    /// The lists.
    pub lists: Vec<CullList>,
    /// Where each has room.
    pub rooms: Vec<Range<u32>>,
}

/// Four gigabytes of them.
pub const MOST_CANDIDATES: u64 = 1 << 30;

/// Trees that are drawn together.
#[derive(Debug, PartialEq)]
pub enum Found {
    /// These.
    Lists(Lists),
    /// Some of these; the device finds out which.
    Candidates(Candidates),
}

impl Found {
    /// Where each list lies, or has room for all its candidates.
    pub fn rooms(&self) -> &[Range<u32>] {
        match self {
            Self::Lists(lists) => &lists.lists,
            Self::Candidates(candidates) => &candidates.rooms,
        }
    }
}

/// What a picture shows of many trees.
#[derive(Debug, PartialEq)]
pub struct Culled {
    /// Those that are drawn together.
    pub found: Found,
    /// Trees that are near enough to be drawn one by one: their outlines grow, or their foliage has levels of its own.
    pub near: Vec<(u16, u32)>,
    /// Where in the picture trees may be: left, top, right, bottom in pixels.
    pub rects: Vec<[f32; 4]>,
    /// Trees in the picture, those left out that the device counts.
    pub trees: usize,
}

/// What a number of cells add to it.
#[derive(Default)]
struct Share {
    lists: Vec<Vec<u32>>,
    spans: Vec<Vec<Span>>,
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

impl Candidates {
    fn of(shares: &[Share], lists: usize) -> Self {
        let of_list = |list: usize| shares.iter().flat_map(move |share| &share.spans[list]);
        let in_blocks = |trees: usize| trees.next_multiple_of(CullBlock::CANDIDATES as usize) as u64;
        let count = (0..lists).map(|list| in_blocks(of_list(list).map(|span| span.trees.len()).sum())).sum();
        let mut all = Self { count, ..Self::default() };
        if count > MOST_CANDIDATES {
            return all;
        }
        for list in 0..lists as u32 {
            let first_block = all.blocks.len() as u32;
            let begin = first_block * CullBlock::CANDIDATES;
            let mut at = begin;
            for Span { trees, tests } in of_list(list as usize) {
                let (first_span, count) = (all.spans.len() as u32, trees.len() as u32);
                all.spans.push(CullSpan { at, tree: trees.start, count_and_tests: count | tests });
                at += count;
                let blocks = at.div_ceil(CullBlock::CANDIDATES) as usize;
                all.blocks.resize(blocks, CullBlock { list, first_span, kept_low: 0, kept_high: 0, before: 0 });
            }
            all.lists.push(CullList { first_block, blocks: all.blocks.len() as u32 - first_block, kept: 0 });
            all.rooms.push(begin..at);
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
    /// The device asks single trees.
    pub on_device: bool,
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
        let mut culled = Culled { found: self.found(&shares), near: vec![], rects: vec![], trees: 0 };
        for share in shares {
            culled.near.extend(share.near);
            culled.rects.extend(share.rects);
            culled.trees += share.trees;
        }
        culled.near.sort_unstable();
        culled
    }

    /// What casts shadows on the sun's map.
    pub fn cast(self, look: &SunLook) -> Found {
        let cells: Vec<&Cell> = self.cells.cells.iter().collect();
        let shares = self.shares(&cells, &|cell, share| {
            let bounds = swayed(cell, look.sway);
            if !look.view.sees(bounds.center(), 0.5 * bounds.size().length(), look.size_px) {
                return false;
            }
            for run in self.runs(cell) {
                let all = Span { trees: run.trees.clone(), tests: 0 };
                self.list(&[all], (run, &bounds), (&look.viewer, PassKind::Shadow), share);
            }
            true
        });
        self.found(&shares)
    }

    fn found(self, shares: &[Share]) -> Found {
        if self.on_device {
            return Found::Candidates(Candidates::of(shares, self.groups() + self.shapes.len()));
        }
        Found::Lists(Lists::of(shares, self.groups()))
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
            let lists = if self.on_device { 0 } else { groups };
            let spans = if self.on_device { groups + self.shapes.len() } else { 0 };
            let mut share = Share { lists: vec![vec![]; lists], spans: vec![vec![]; spans], ..Share::default() };
            let asked = cells.iter().filter(|cell| ask(cell, &mut share)).count();
            (asked > 0).then_some(share)
        };
        chunks.filter_map(share).collect()
    }

    /// Lists trees of a run in each group in which they are seen.
    fn list(self, spans: &[Span], (run, bounds): (&Run, &Bounds), (viewer, kind): (&Viewer, PassKind), share: &mut Share) {
        let species = usize::from(run.species);
        let shape = &self.shapes[species];
        let first: usize = self.shapes[..species].iter().map(|shape| shape.groups.len()).sum();
        for (group, seen) in shape.groups.iter().enumerate() {
            let all = of_all(seen, shape.height_m, viewer, (run, bounds));
            if all == Some(false) {
                continue;
            }
            if self.on_device {
                let level = if all.is_none() { CullSpan::LEVEL } else { 0 };
                share.spans[first + group].extend(spans.iter().map(|span| Span { tests: span.tests | level, ..span.clone() }));
                continue;
            }
            let seen_of = |tree: &u32| {
                let instance = self.placed[*tree as usize].instance(*tree);
                all == Some(true) || viewer.share(shape.height_m, seen, &instance, kind) > 0.0
            };
            let list = &mut share.lists[first + group];
            spans.iter().for_each(|span| list.extend(span.trees.clone().filter(seen_of)));
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
            let spans = if shape.is_near(tallest_px, self.look) || side == Side::Across && !self.many.on_device {
                spans_of(run.trees.clone().filter(|tree| self.shows(run.species, *tree, share)))
            } else if side == Side::Across {
                let asked = Span { trees: run.trees.clone(), tests: CullSpan::IN_PICTURE };
                share.spans[self.many.groups() + usize::from(run.species)].push(asked.clone());
                vec![asked]
            } else {
                share.trees += run.trees.len();
                vec![Span { trees: run.trees.clone(), tests: 0 }]
            };
            self.many.list(&spans, (run, &bounds), (&self.look.viewer, PassKind::Temporary), share);
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

/// Rising numbers of trees of whom nothing is to be asked any more.
fn spans_of(trees: impl Iterator<Item = u32>) -> Vec<Span> {
    let mut spans: Vec<Span> = vec![];
    for tree in trees {
        match spans.last_mut() {
            Some(last) if last.trees.end == tree => last.trees.end += 1,
            _ => spans.push(Span { trees: tree..tree + 1, tests: 0 }),
        }
    }
    spans
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
