//! What of the placed trees is drawn in a frame: which instances of which parts are seen at all, by the viewer and by the sun. Parts that
//! are seen at the same distances and from the same sides share their list of instances.

use std::ops::Range;

use glam::{Quat, Vec3};

use super::drawer::PassKind;
use super::growth::GrowthInput;
use super::pipelines::FrameTraits;
use super::shadow::SunView;
use super::tree::Tree;
use super::wind::Sway;
use super::world::Placed as PlacedWorld;
use super::{Camera, Counted, Crowd, Projection, Shot, Stand};
use crate::Result;
use crate::gpu::{Gpu, KeptBuffer, layout};
use crate::repr::Seen;

/// Who looks, as far as it decides what is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    camera: Camera,
    heights: [f32; 2],
    level_eye: Vec3,
    toward_sun: Vec3,
}

impl Viewer {
    /// Of a picture.
    pub fn of(shot: &Shot) -> Self {
        let toward_sun = shot.toward_sun.normalize_or(Vec3::Y);
        Self { camera: shot.camera, heights: shot.heights(), level_eye: shot.level_eye(), toward_sun }
    }

    /// The same who sees a tree as large as it is on the sun's map, wherever it stands.
    pub fn at_sun(self, view: &SunView) -> Self {
        // Where the viewer stands must not matter, or the map would be another with every step.
        let camera = Camera::orbit(Vec3::ZERO, 0.0, 0.0, 1.0);
        Self { heights: [view.level_m(), 0.0], camera, level_eye: camera.eye, ..self }
    }

    /// From where levels are told, world space, and how far a thing `d` metres away is in the picture for which distances are told:
    /// `x + y · d`.
    pub fn eye_and_heights(&self) -> (Vec3, [f32; 2]) {
        (self.level_eye, self.heights)
    }

    /// How far away a place is, in parallel projection from the viewer's plane.
    pub fn away_m(&self, place: Vec3) -> f32 {
        let way = self.camera.eye - place;
        match self.camera.projection {
            Projection::Perspective { .. } => way.length(),
            Projection::Orthographic { .. } => way.dot(self.camera.axes[2]),
        }
    }

    /// How far it is from a point of a placed tree that is so tall, in heights of the tree, as [`Seen`] has distances.
    pub fn distance(&self, height_m: f32, at: Vec3, instance: &layout::Instance) -> f32 {
        let [plain, by_distance] = self.heights;
        if by_distance < 0.0 {
            return plain;
        }
        let way_m = (self.level_eye - placed_point(instance, at)).length();
        (plain + by_distance * way_m) / (instance.scale * height_m)
    }

    /// How much is seen of a part of a placed tree; `shaders/shared/presence.wgsl` reckons the same.
    pub fn share(&self, height_m: f32, seen: &Seen, instance: &layout::Instance, kind: PassKind) -> f32 {
        let by_distance = self.share_by_distance(height_m, seen, instance);
        if by_distance <= 0.0 {
            return 0.0;
        }
        let toward = match (kind, self.camera.projection) {
            (PassKind::Shadow, _) => self.toward_sun,
            (_, Projection::Perspective { .. }) => {
                (self.camera.eye - placed_point(instance, seen.anchor)).normalize_or(self.camera.axes[2])
            }
            (_, Projection::Orthographic { .. }) => self.camera.axes[2],
        };
        by_distance * seen.share_toward(turn_of(instance).inverse() * toward)
    }

    /// The same from whatever side.
    pub fn share_by_distance(&self, height_m: f32, seen: &Seen, instance: &layout::Instance) -> f32 {
        let away = |anchor| self.distance(height_m, anchor, instance);
        seen.share_between(away(seen.anchor), away(seen.vanish_anchor.unwrap_or(seen.anchor)))
    }
}

/// How an instance is turned.
pub fn turn_of(instance: &layout::Instance) -> Quat {
    Quat::from_array(instance.rotation.map(f32::from)).normalize()
}

/// Where a point of an instance's tree stands in still air, world space.
pub fn placed_point(instance: &layout::Instance, at: Vec3) -> Vec3 {
    Vec3::from(instance.position) + instance.scale * (turn_of(instance) * at)
}

/// Instances on the device: bytes of the buffer that holds those of the whole frame.
pub type Placed = Range<u64>;

/// A tree and where it is drawn.
#[derive(Debug)]
pub struct SceneTree<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// For each of its [groups](Tree::groups): the instances of which it is seen.
    placed: Vec<Placed>,
}

impl SceneTree<'_> {
    /// Where the parts of a group are drawn, and how often; `None` for nowhere.
    pub fn placed(&self, group: usize) -> Option<(Placed, u32)> {
        let bytes = self.placed[group].clone();
        let count = (bytes.end - bytes.start) / size_of::<layout::Instance>() as u64;
        (count > 0).then_some((bytes, count as u32))
    }

    /// Where they are.
    pub fn instances<'s>(&self, scene: &'s Scene, group: usize) -> &'s [layout::Instance] {
        let Range { start, end } = &self.placed[group];
        let number = |bytes: &u64| *bytes as usize / size_of::<layout::Instance>();
        &scene.all[number(start)..number(end)]
    }
}

/// All trees of a frame.
#[derive(Debug)]
pub struct Scene<'a> {
    seen: Vec<SceneTree<'a>>,
    cast: Vec<SceneTree<'a>>,
    /// Many trees.
    pub crowd: Option<&'a Crowd>,
    /// Of all trees, on the device.
    pub instances: &'a wgpu::Buffer,
    /// The same here.
    all: &'a [layout::Instance],
    /// Who looks.
    pub viewer: Viewer,
    /// What is known of the picture.
    pub traits: FrameTraits,
}

impl Scene<'_> {
    /// What a pass shows.
    pub fn trees(&self, kind: PassKind) -> &[SceneTree<'_>] {
        if kind == PassKind::Shadow { &self.cast } else { &self.seen }
    }

    /// Draw calls and triangles of the picture, and of the sun's map if that is drawn, but for foliage in levels of detail and for crowds.
    pub fn counted(&self, with_map: bool) -> Counted {
        let of_kind = |kind| {
            let parts = self.trees(kind).iter().flat_map(|placed| {
                let parts = placed.tree.meshes().iter().chain(placed.tree.impostors());
                parts.filter_map(|part| Some((part, placed.placed(part.group)?.1)))
            });
            parts.fold(Counted::default(), |sum, (part, count)| {
                sum + Counted { draws: 1, triangles: u64::from(count) * u64::from(part.count / 3) }
            })
        };
        of_kind(PassKind::Temporary) + if with_map { of_kind(PassKind::Shadow) } else { Counted::default() }
    }
}

/// The instances of a frame, kept on the device until others are wanted.
#[derive(Debug)]
pub struct Instances {
    kept: Vec<layout::Instance>,
    buffer: KeptBuffer,
}

impl Instances {
    /// None.
    pub fn new(gpu: &Gpu) -> Self {
        Self { kept: vec![], buffer: KeptBuffer::new(gpu, "scene.instances", wgpu::BufferUsages::VERTEX) }
    }

    /// Finds what is seen of `stands`, and in the map of `sun`; gives it with the bytes sent to the device.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    pub fn scene<'a>(
        &'a mut self,
        gpu: &Gpu,
        shot: &Shot,
        placed: &PlacedWorld<'a>,
        growing: &GrowthInput,
        sun: Option<(SunView, u32)>,
    ) -> Result<(Scene<'a>, u64)> {
        let (viewer, stands) = (Viewer::of(shot), placed.stands);
        let mut placing = Placing { viewer, all: Vec::with_capacity(self.kept.len()) };
        let seen = stands.iter().zip(&growing.slots).map(|(stand, slots)| {
            let with_slots = stand.instances.iter().zip(slots).map(|(place, slot)| layout::Instance { extra: *slot, ..*place });
            placing.place(stand.tree, with_slots.collect(), PassKind::Temporary)
        });
        let seen = seen.collect();
        let sway = Sway::of(&shot.wind);
        let cast = sun.into_iter().flat_map(|sun| stands[..placed.casters].iter().map(move |stand| (stand, sun)));
        let cast = cast
            .map(|(stand, (view, size_px))| placing.place(stand.tree, casters_of(stand, sway, view, size_px), PassKind::Shadow));
        let cast = cast.collect();
        let bytes: &[u8] = bytemuck::cast_slice(&placing.all);
        let sent = if self.kept == placing.all { 0 } else { bytes.len() as u64 };
        if sent > 0 {
            self.kept.clear(); // forgotten if the device refuses
            self.buffer.fill(gpu, bytes)?;
            self.kept = placing.all;
        }
        let instances = self.buffer.get();
        Ok((Scene { seen, cast, crowd: placed.crowd, instances, all: &self.kept, viewer, traits: FrameTraits::of(shot) }, sent))
    }
}

/// Instances being listed.
struct Placing {
    viewer: Viewer,
    all: Vec<layout::Instance>,
}

impl Placing {
    /// Lists where each group of a tree is seen. Equal lists are kept once.
    fn place<'a>(&mut self, tree: &'a Tree, instances: Vec<layout::Instance>, kind: PassKind) -> SceneTree<'a> {
        let mut lists: Vec<(Vec<u32>, Placed)> = vec![];
        let everywhere: Vec<u32> = (0..instances.len() as u32).collect();
        let placed = tree.groups().iter().map(|seen| {
            let is_seen = |i: &u32| self.viewer.share(tree.height_m(), seen, &instances[*i as usize], kind) > 0.0;
            let list = match seen.is_always() {
                true => everywhere.clone(),
                false => everywhere.iter().copied().filter(is_seen).collect(),
            };
            if let Some((_, placed)) = lists.iter().find(|(known, _)| *known == list) {
                return placed.clone();
            }
            let begin = size_of_val(&self.all[..]) as u64;
            self.all.extend(list.iter().map(|i| instances[*i as usize]));
            let placed = begin..size_of_val(&self.all[..]) as u64;
            lists.push((list, placed.clone()));
            placed
        });
        SceneTree { tree, placed: placed.collect() }
    }
}

/// The instances that the sun's map of `size_px` texels a side may show.
fn casters_of(stand: &Stand, sway: Sway, view: SunView, size_px: u32) -> Vec<layout::Instance> {
    let Some(reach) = stand.tree.reach() else { return vec![] };
    let radius = 0.5 * reach.size().length() + sway.reach_m(stand.tree.height_m());
    let seen = |i: &&layout::Instance| view.sees(placed_point(i, reach.center()), radius * i.scale, size_px);
    stand.instances.iter().filter(seen).copied().collect()
}
