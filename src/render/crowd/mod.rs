//! Many placed trees on the device: a grove. Trees of a species share what was uploaded of it; each takes 16 bytes, and 4 more in each list
//! of what is seen. In every frame `cull` says which trees a picture shows in which of their species' groups; a group is drawn by one
//! indirect call for each of its parts, however many trees there are. While nothing moves, nothing is culled and nothing is sent.

mod cells;
mod compute;
mod cull;
mod device;
mod frustum;
mod vbo;

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;

use super::drawer::PassKind;
use super::part::DevicePart;
use super::shadow::SunView;
use super::tree::Tree;
use super::{Camera, Shot, Stage};
use crate::geom::Bounds;
use crate::gpu::{Gpu, layout, storage_layout, upload_buffer};
use crate::repr::Seen;
use crate::{Error, Result};

use cells::Cells;
pub(super) use compute::Culler;
use compute::Places;
pub(super) use cull::SunLook;
use cull::{Culled, Found, Look, Many};
use device::Device;
use vbo::Batches;

crate::params! {
    /// Which of many trees are drawn, and how.
    pub struct CullParams {
        /// Trees lower than that in the picture are left out.
        least_px: f64 = 0.7, in 0.0..=100.0, unit "px", source "ours: what is less than a pixel high is hardly there";
        /// Sphere-boards at least so high in the picture are reshaped: their outlines grow.
        reshape_px: f64 = 48.0, in 1.0..=4096.0, unit "px", source "She §3.5: 140 of 540, those that are near; ours: by size on the screen";
        /// How many are drawn by one call.
        batch: Batch = Batch::Indirect, unit "", source "ours; Truelsen §5.3 has the other two";
        /// Who asks which trees are seen; `compute` needs the batch `indirect`.
        culling: Culling = Culling::Auto, unit "", source "ours: measured at the start, with the scene at hand";
    }
}

impl CullParams {
    /// Whether the device asks.
    pub fn on_device(&self) -> bool {
        self.culling == Culling::Compute && self.batch == Batch::Indirect
    }
}

crate::choices! {
    /// Who culls many trees.
    pub enum Culling {
        /// Whoever is faster at the start; the processor where nobody has measured.
        Auto = "auto",
        /// The processor, with all its cores.
        Cpu = "cpu",
        /// The device: a compute shader.
        Compute = "compute",
    }
}

crate::choices! {
    /// How many trees a draw call draws (Truelsen §5, fig. 32).
    pub enum Batch {
        /// One: the brute force.
        Naive = "naive",
        /// All that share a part, through an index buffer that is written anew in every frame: Truelsen's batches.
        Vbo = "vbo",
        /// All that share a part, through a buffer of numbers and an indirect call.
        Indirect = "indirect",
    }
}

/// What culling has to know of a species; object space, metres.
#[derive(Debug, Clone)]
pub struct Shape {
    /// When its parts are seen.
    pub groups: Vec<Seen>,
    /// The box around whatever is drawn of it.
    pub reach: Bounds,
    /// Around that, from the point of its axis at half its height.
    pub radius_m: f32,
    /// Its height.
    pub height_m: f32,
    /// It has outlines that grow.
    pub grows: bool,
    /// Its foliage is drawn tree by tree.
    pub alone: bool,
}

impl Shape {
    fn of(tree: &Tree) -> Option<Self> {
        let reach = tree.reach()?;
        let across = reach.min.abs().max(reach.max.abs()).with_y(0.5 * reach.size().y);
        Some(Self {
            groups: tree.groups().to_vec(),
            reach,
            radius_m: across.length(),
            height_m: tree.height_m(),
            grows: !tree.crowns().is_empty(),
            alone: !tree.forests().is_empty(),
        })
    }

    /// The box around a placed tree, however it is turned.
    fn reach_at(&self, placed: &layout::Placed) -> Bounds {
        let across = Vec3::new(self.radius_m, 0.0, self.radius_m);
        let (foot, scale) = (Vec3::from(placed.position), placed.scale());
        Bounds {
            min: foot + scale * (self.reach.min.y * Vec3::Y - across),
            max: foot + scale * (self.reach.max.y * Vec3::Y + across),
        }
    }

    /// Whether a tree so high in the picture is drawn by itself.
    fn is_near(&self, height_px: f32, look: &Look) -> bool {
        self.alone || self.grows && look.reshapes(height_px)
    }
}

/// A tree of a crowd: its species and where it stands.
pub use cells::Standing;

/// Many placed trees.
#[derive(Debug)]
pub struct Crowd {
    species: Vec<Tree>,
    shapes: Vec<Shape>,
    cells: Cells,
    placed: Vec<layout::Placed>,
    bounds: Option<Bounds>,
    /// The placed trees on the device, as the drawers bind them.
    group: wgpu::BindGroup,
    /// And as compute culling does.
    places: Places,
    /// The lists for the picture, and for the sun's map.
    device: [Device; 2],
    /// For what they were made.
    kept: Option<(Look, Culled)>,
    kept_sun: Option<(SunLook, Found)>,
    /// How many trees are in each list: of those that the device asks as many as may be, until it was asked in turn.
    counts: [Vec<u32>; 2],
    /// What [`Batch::Vbo`] draws, once that was asked for.
    batches: Option<Batches>,
    /// Unlike that of any other.
    number: u64,
}

/// How the drawers bind the placed trees: their group 3.
pub fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    storage_layout(gpu, "crowd.layout")
}

impl Crowd {
    /// Trees of these species at these places.
    ///
    /// # Errors
    /// [`Error::Device`] when they do not fit; [`Error::Internal`] where a tree is of a species that is not there.
    pub(super) fn new(gpu: &Gpu, layout: &wgpu::BindGroupLayout, species: Vec<Tree>, trees: &[Standing]) -> Result<Self> {
        let nothing = Shape {
            groups: vec![],
            reach: Bounds { min: Vec3::ZERO, max: Vec3::ZERO },
            radius_m: 0.0,
            height_m: 1.0,
            grows: false,
            alone: false,
        };
        let shapes: Vec<Shape> = species.iter().map(|tree| Shape::of(tree).unwrap_or_else(|| nothing.clone())).collect();
        if let Some((which, _)) = trees.iter().find(|(which, _)| usize::from(*which) >= species.len()) {
            return Err(Error::NoSuchSpecies { found: *which, species: species.len() });
        }
        let bytes = size_of_val(trees) as u64;
        if bytes > compute::room(gpu) {
            return Err(compute::too_much(gpu, "places of trees", bytes, "plant fewer"));
        }
        let (cells, placed) = Cells::sort(trees, &shapes);
        let bounds = Bounds::of(cells.cells.iter().flat_map(|cell| [cell.bounds.min, cell.bounds.max]));
        let buffer = gpu.guarded(|| {
            let none = [bytemuck::Zeroable::zeroed()];
            let placed = if placed.is_empty() { &none[..] } else { &placed[..] };
            upload_buffer(gpu, "crowd.placed", bytemuck::cast_slice(placed), wgpu::BufferUsages::STORAGE)
        })?;
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("crowd.group"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let places = Places::new(gpu, &shapes, buffer);
        static PLANTED: AtomicU64 = AtomicU64::new(0);
        let number = PLANTED.fetch_add(1, Ordering::Relaxed);
        let device = [Device::new(gpu), Device::new(gpu)];
        let (kept, kept_sun, counts) = (None, None, [vec![], vec![]]);
        Ok(Self { species, shapes, cells, placed, bounds, group, places, device, kept, kept_sun, counts, batches: None, number })
    }

    /// Its species.
    pub fn species(&self) -> &[Tree] {
        &self.species
    }

    /// Around all trees, in still air.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// The tallest tree, metres.
    pub fn tallest_m(&self) -> f32 {
        self.cells.cells.iter().map(|cell| cell.tallest_m).fold(0.0, f32::max)
    }

    /// How many trees there are.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Bytes on the device beyond what the species hold: places, lists, calls.
    pub fn device_bytes(&self) -> u64 {
        let placed = size_of_val(&self.placed[..]) as u64;
        placed + self.device.iter().map(Device::bytes).sum::<u64>() + self.batches.as_ref().map_or(0, Batches::bytes)
    }

    /// Finds what a picture shows and what casts shadows on it, and sends the lists that have changed, or what `culler` has to know to fill
    /// them; gives how many bytes that were.
    ///
    /// # Errors
    /// [`Error::Device`] when memory runs out, [`Error::ShaderRoom`] for more trees than the culler can be given.
    pub(super) fn see(
        &mut self,
        gpu: &Gpu,
        shot: &Shot,
        frozen: Option<Camera>,
        sun: Option<(SunView, u32)>,
        (params, culler): (&CullParams, Option<&Culler>),
    ) -> Result<u64> {
        let (look, sun) = (Look::new(shot, frozen, params), sun.map(|sun| SunLook::new(shot, sun)));
        let mut sent = 0;
        let batched = params.batch == Batch::Vbo;
        if batched != self.batches.is_some() {
            (self.kept, self.kept_sun) = (None, None);
            self.batches = None;
            if batched {
                self.batches = Some(Batches::new(gpu, &self.species, &self.cells, self.placed.len())?);
            }
        }
        if self.kept.as_ref().is_none_or(|(kept, _)| *kept != look) {
            if self.kept.as_ref().is_some_and(|(kept, _)| kept.on_device() != look.on_device()) {
                self.kept_sun = None;
            }
            self.kept = None; // forgotten if the device refuses
            let culled = self.many(culler).seen(&look);
            sent += self.send(gpu, PassKind::Temporary, &culled.found, culler.map(|culler| (culler, look.for_device())))?;
            self.kept = Some((look, culled));
        }
        if self.kept_sun.as_ref().map(|(kept, _)| *kept) != sun {
            self.kept_sun = None;
            if let Some(look) = sun {
                let found = self.many(culler).cast(&look);
                let for_device = layout::CullLook { for_sun: 1, ..bytemuck::Zeroable::zeroed() };
                sent += self.send(gpu, PassKind::Shadow, &found, culler.map(|culler| (culler, for_device)))?;
                self.kept_sun = Some((look, found));
            }
        }
        Ok(sent)
    }

    fn many(&self, culler: Option<&Culler>) -> Many<'_> {
        Many { cells: &self.cells, placed: &self.placed, shapes: &self.shapes, on_device: culler.is_some() }
    }

    /// Sends what was found for a pass.
    fn send(&mut self, gpu: &Gpu, kind: PassKind, found: &Found, culler: Option<(&Culler, layout::CullLook)>) -> Result<u64> {
        let shadow = usize::from(kind == PassKind::Shadow);
        self.counts[shadow] = found.rooms().iter().map(|room| room.len() as u32).collect();
        let device = &mut self.device[shadow];
        match (found, culler) {
            (Found::Candidates(candidates), Some((culler, look))) => {
                device.ask(gpu, (culler, &self.places), &self.species, (look, candidates))
            }
            (Found::Candidates(_), None) => Err(Error::Internal { stage: "culling", what: "nobody to ask".to_owned() }),
            (Found::Lists(lists), _) => match &mut self.batches {
                Some(batches) => batches.fill(gpu, kind, &self.species, (&lists.entries, &lists.lists)),
                None => device.fill(gpu, &self.species, lists),
            },
        }
    }

    /// Has the device fill the lists that it has to; gives whether there were any.
    pub(super) fn cull(&self, encoder: &mut wgpu::CommandEncoder, culler: &Culler) -> bool {
        let run = |device: &Device| device.asking.as_ref().is_some_and(|asking| culler.run(encoder, asking));
        self.device.iter().map(run).fold(false, |any, ran| any | ran)
    }

    /// Asks the device how many trees it has found, after a frame: [`Crowd::shown`] and [`Crowd::trees_seen`] know it from then on. Waits for
    /// it; does nothing where the processor culls.
    ///
    /// # Errors
    /// [`Error::Device`] when the device fails.
    pub fn tally(&mut self, gpu: &Gpu) -> Result<()> {
        for (counts, device) in self.counts.iter_mut().zip(&self.device) {
            if let Some(asking) = &device.asking {
                *counts = asking.counts(gpu, counts.len())?;
            }
        }
        Ok(())
    }

    /// What the sun's map shows of it, and of which crowd: while that stays, the map does.
    pub(super) fn cast(&self) -> Option<(u64, SunLook)> {
        self.kept_sun.as_ref().map(|(look, _)| (self.number, *look))
    }

    /// Where the lists of a pass lie, or may; none before the first picture.
    fn lists(&self, kind: PassKind) -> &[Range<u32>] {
        match kind {
            PassKind::Temporary => self.kept.as_ref().map_or(&[], |(_, culled)| culled.found.rooms()),
            PassKind::Shadow => self.kept_sun.as_ref().map_or(&[], |(_, found)| found.rooms()),
        }
    }

    /// What the last picture showed.
    ///
    /// # Panics
    /// Before the first.
    pub(super) fn seen(&self) -> &Culled {
        &self.kept.as_ref().expect("see comes first").1
    }

    /// Trees of the last picture that are drawn by themselves, species by species.
    pub(super) fn near(&self) -> Vec<(usize, Vec<layout::Instance>)> {
        let instance = |(_, tree): &(u16, u32)| self.placed[*tree as usize].instance(*tree);
        let of_one = |run: &[(u16, u32)]| (usize::from(run[0].0), run.iter().map(instance).collect());
        self.seen().near.chunk_by(|a, b| a.0 == b.0).map(of_one).collect()
    }

    /// Trees in the last picture; see [`Crowd::tally`].
    pub fn trees_seen(&self) -> usize {
        let groups: usize = self.shapes.iter().map(|shape| shape.groups.len()).sum();
        let counted: u32 = self.counts[0].iter().skip(groups).sum();
        self.kept.as_ref().map_or(0, |(_, culled)| culled.trees + counted as usize)
    }

    /// Those of them that are drawn by themselves.
    pub fn trees_near(&self) -> usize {
        self.kept.as_ref().map_or(0, |(_, culled)| culled.near.len())
    }

    /// How many trees the last picture showed in each group of a species, those that are drawn alone left out; see [`Crowd::tally`].
    pub fn shown(&self, species: usize) -> Vec<usize> {
        let first: usize = self.shapes[..species].iter().map(|shape| shape.groups.len()).sum();
        let counts = &self.counts[0];
        (0..self.shapes[species].groups.len()).map(|group| counts.get(first + group).map_or(0, |count| *count as usize)).collect()
    }

    /// Those of its parts, meshes or impostors, that the last picture shows in a pass.
    pub(super) fn drawn(&self, kind: PassKind, impostors: bool) -> impl Iterator<Item = &DevicePart> {
        let lists = self.lists(kind);
        let firsts = self.species.iter().scan(0, |sum, tree| Some(std::mem::replace(sum, *sum + tree.groups().len())));
        self.species.iter().zip(firsts).flat_map(move |(tree, first)| {
            let of = if impostors { tree.impostors() } else { tree.meshes() };
            of.iter().filter(move |part| lists.get(first + part.group).is_some_and(|list| !list.is_empty()))
        })
    }

    /// Whether its trees are drawn as Truelsen's batches.
    pub(super) fn is_batched(&self) -> bool {
        self.batches.is_some()
    }

    /// Draws those of its parts that are meshes, or those that are impostors; `ready` sets the pipeline of each.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass,
        kind: PassKind,
        impostors: bool,
        ready: impl Fn(&mut wgpu::RenderPass, &DevicePart),
    ) {
        let (Some((look, _)), lists) = (&self.kept, self.lists(kind)) else { return };
        if lists.is_empty() {
            return;
        }
        let device = &self.device[usize::from(kind == PassKind::Shadow)];
        let (mut first, mut call) = (0, 0);
        pass.set_bind_group(3, &self.group, &[]);
        for (species, tree) in self.species.iter().enumerate() {
            for (number, part) in parts(tree).enumerate() {
                let list = &lists[first + part.group];
                if list.is_empty() || impostors != (number >= tree.meshes().len()) {
                    continue;
                }
                ready(pass, part);
                part.bind(pass);
                if let Some(batches) = &self.batches {
                    batches.draw(pass, kind, species, number);
                    continue;
                }
                let bytes = |number: u32| u64::from(number) * size_of::<u32>() as u64;
                pass.set_vertex_buffer(1, device.lists.get().slice(bytes(list.start)..bytes(list.end)));
                match look.batch() {
                    Batch::Naive => (0..list.len() as u32).for_each(|one| pass.draw_indexed(0..part.count, 0, one..one + 1)),
                    Batch::Indirect | Batch::Vbo => {
                        let arguments = (call + number) * size_of::<layout::CullCall>();
                        pass.draw_indexed_indirect(device.calls.get(), arguments as u64);
                    }
                }
            }
            first += tree.groups().len();
            call += parts(tree).count();
        }
    }

    /// Draw calls and triangles of the last picture, those of the sun's map among them if that was drawn; see [`Crowd::tally`].
    pub(super) fn counted_of(&self, with_map: bool) -> Counted {
        let map = if with_map { self.counted(PassKind::Shadow) } else { Counted::default() };
        self.counted(PassKind::Temporary) + map
    }

    fn counted(&self, kind: PassKind) -> Counted {
        let (Some((look, _)), lists) = (&self.kept, self.lists(kind)) else { return Counted::default() };
        let mut counted = Counted::default();
        if lists.is_empty() {
            return counted;
        }
        let mut first = 0;
        for tree in &self.species {
            for part in parts(tree) {
                let trees = u64::from(self.counts[usize::from(kind == PassKind::Shadow)][first + part.group]);
                let called = u64::from(!lists[first + part.group].is_empty());
                counted.draws += if look.batch() == Batch::Naive { trees } else { called };
                counted.triangles += trees * u64::from(part.count / 3);
            }
            first += tree.groups().len();
        }
        counted
    }
}

/// The parts of a tree that a crowd draws.
fn parts(tree: &Tree) -> impl Iterator<Item = &DevicePart> {
    tree.meshes().iter().chain(tree.impostors())
}

/// What a frame has drawn of trees.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counted {
    /// Draw calls.
    pub draws: u64,
    /// Triangles, seen or not.
    pub triangles: u64,
}

impl std::ops::Add for Counted {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { draws: self.draws + other.draws, triangles: self.triangles + other.triangles }
    }
}

impl Shot {
    /// Whether outlines grow in it.
    fn grows(&self) -> bool {
        self.stage != Stage::Unshaped && self.growth.growth != super::GrowthChoice::None
    }
}

#[cfg(test)]
mod compute_tests;
#[cfg(test)]
mod tests;
