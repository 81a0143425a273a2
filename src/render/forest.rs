//! The drawer of leaves in many levels of detail (Rebollo §IV and V, fig. 7 and 10).
//!
//! Corners of the originals and all leaves of all levels are put onto the device once and are shared by every tree of the species. Each placed
//! tree has the list of the leaves that it shows and the level of each cluster; when the viewer moves, only what has changed of them is
//! sent. One draw a tree, of four corners a leaf, which its two triangles share.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Counted;
use super::drawer::{Drawer, PASSES, PassKind};
use super::part::{DevicePart, PartStore, PlaceInTree, Textures};
use super::pipelines::{Pipelines, Style};
use super::placing::Groups;
use super::scene::{Scene, turn_of};
use crate::Result;
use crate::geom::Surface;
use crate::gpu::{Gpu, layout, upload_buffer};
use crate::model::Part;
use crate::repr::BuiltPart;
use crate::repr::lodf::{ClusterLevel, LeafForest, LeafId, Sent, Shown, Viewer, foliage};

/// The foliage of a part on the device.
#[derive(Debug)]
pub struct ForestPart {
    /// What it is made of and when it is seen; it has no vertices of its own.
    pub part: DevicePart,
    forest: Arc<LeafForest>,
    corners: wgpu::Buffer,
    leaves: wgpu::Buffer,
    /// Two triangles of the four corners of each leaf that is shown: 0 1 2 and 0 2 3.
    indices: wgpu::Buffer,
    /// Unlike that of any other.
    number: u64,
}

impl ForestPart {
    /// Puts a part that is drawn as `forest` onto the device.
    pub fn upload(
        gpu: &Gpu,
        store: &PartStore,
        built: &BuiltPart,
        forest: &Arc<LeafForest>,
        place: PlaceInTree,
        textures: &mut Textures,
    ) -> Self {
        static UPLOADED: AtomicU64 = AtomicU64::new(0);
        let bare = BuiltPart { part: Part { surface: Surface::default(), ..built.part.clone() }, ..built.clone() };
        let storage = |label, contents: &[u8]| upload_buffer(gpu, label, contents, wgpu::BufferUsages::STORAGE);
        Self {
            part: store.upload(gpu, &bare.part, (&bare.drawn, &bare.seen), place, textures),
            corners: storage("forest.corners", bytemuck::cast_slice(&corners(&built.part.surface))),
            leaves: storage("forest.leaves", bytemuck::cast_slice(&leaves(forest))),
            indices: upload_buffer(
                gpu,
                "forest.indices",
                bytemuck::cast_slice(&indices(forest.forest.leaves())),
                wgpu::BufferUsages::INDEX,
            ),
            forest: forest.clone(),
            number: UPLOADED.fetch_add(1, Ordering::Relaxed),
        }
    }
}

fn corners(surface: &Surface) -> Vec<layout::LeafCorner> {
    let corner = |v: u32| {
        let v = v as usize;
        let [u, w] = surface.uvs.get(v).copied().unwrap_or_default().to_array();
        layout::LeafCorner {
            position: surface.mesh.positions[v].to_array(),
            u,
            normal: surface.normals.get(v).map_or([0.0, 1.0, 0.0], |n| n.to_array()),
            v: w,
        }
    };
    (0..surface.mesh.polygon_count() as u32).flat_map(|leaf| foliage::corners(&surface.mesh, leaf).map(corner)).collect()
}

fn indices(leaves: usize) -> Vec<u32> {
    (0..leaves as u32).flat_map(|leaf| [0, 1, 2, 0, 2, 3].map(|corner| 4 * leaf + corner)).collect()
}

/// All leaves of all levels, by [`lodf::Forest::flat`](crate::repr::lodf::Forest::flat).
fn leaves(forest: &LeafForest) -> Vec<layout::Leaf> {
    let structure = &forest.forest;
    let mut leaves = Vec::with_capacity(structure.all_leaves());
    for cluster in 0..structure.clusters() as u32 {
        let first = leaves.len();
        for number in 0..structure.order(cluster).len() as u16 {
            let shape = structure.shape(LeafId { cluster, number });
            leaves.push(layout::Leaf {
                corners: shape.corners.map(|c| c.leaf << 3 | u32::from(c.corner) << 1 | u32::from(c.turned)),
                wears: shape.wears,
                cluster,
                // Nothing is ever made of the last one; no cluster makes that leaf.
                into: layout::Leaf::NOTHING,
                heir: 0,
            });
        }
        for collapsed in 0..structure.size(cluster) - 1 {
            let Some([heir, absorbed, made]) = structure.next(cluster, collapsed) else { break };
            let into = structure.flat(LeafId { cluster, number: made });
            for (number, heir) in [(heir, 1), (absorbed, 0)] {
                let leaf = &mut leaves[first + usize::from(number)];
                (leaf.into, leaf.heir) = (into, heir);
            }
        }
    }
    leaves
}

/// Which placed tree: the part, and where it stands, so that trees in one place share what they show.
type Key = (u64, [u32; 8]);

/// What one placed tree shows.
#[derive(Debug)]
struct Placed {
    shown: Shown,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// The frame in which it was drawn last.
    used: u64,
}

/// Frames that a tree may be out of sight before what it shows is forgotten.
const FORGOTTEN: u64 = 120;

/// Bytes before the levels of the clusters.
const HEADER: u64 = 16;

/// Draws leaves.
#[derive(Debug)]
pub struct ForestDrawer {
    pipelines: Pipelines,
    layout: wgpu::BindGroupLayout,
    placed: HashMap<Key, Placed>,
    frame: u64,
}

impl ForestDrawer {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let layout = leaves_layout(gpu);
        let buffers = &[Some(layout::Instance::LAYOUT)];
        let style = Style { seen: "leaves", cast: "cast_leaves", buffers, solid: false, grows: false };
        let pipelines = Pipelines::new(gpu, style, groups, Some(&layout));
        Self { pipelines, layout, placed: HashMap::new(), frame: 0 }
    }

    /// Shows of a placed tree what its viewer asks for; gives the bytes sent.
    fn show(&mut self, gpu: &Gpu, part: &ForestPart, key: Key, viewer: &Viewer) -> u64 {
        let wanted = part.forest.wanted(viewer);
        if let Some(placed) = self.placed.get_mut(&key) {
            placed.used = self.frame;
            let sent = placed.shown.set(&part.forest, &wanted);
            return send(gpu, placed, &part.forest, sent);
        }
        let mut shown = Shown::finest(&part.forest);
        shown.set(&part.forest, &wanted);
        let whole = whole(&shown, part.forest.forest.leaves());
        let buffer = upload_buffer(gpu, "forest.shown", bytemuck::cast_slice(&whole), wgpu::BufferUsages::STORAGE);
        let entry = |binding, buffer: &'_ wgpu::Buffer| (binding, buffer.clone());
        let buffers = [entry(0, &part.corners), entry(1, &part.leaves), entry(2, &buffer)];
        let entries = buffers
            .each_ref()
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding: *binding, resource: buffer.as_entire_binding() });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("forest.group"),
            layout: &self.layout,
            entries: &entries,
        });
        self.placed.insert(key, Placed { shown, buffer, group, used: self.frame });
        size_of_val(&whole[..]) as u64
    }

    /// Leaves shown of all trees in the last frame.
    pub fn leaves_shown(&self) -> usize {
        self.placed.values().filter(|placed| placed.used == self.frame).map(|placed| placed.shown.entries().len()).sum()
    }

    /// Draw calls and triangles of leaves in a pass of the frame that was prepared last.
    pub fn counted(&self, scene: &Scene, kind: PassKind) -> Counted {
        let forests = scene.trees(kind).iter().flat_map(|placed| placed.tree.forests().iter().map(move |part| (placed, part)));
        let shown = forests.flat_map(|(placed, part)| {
            let instances = placed.instances(scene, part.part.group).iter();
            instances.filter_map(|instance| self.placed.get(&key(part, instance)))
        });
        shown.fold(Counted::default(), |sum, placed| sum + Counted { draws: 1, triangles: 2 * placed.shown.entries().len() as u64 })
    }
}

/// Everything that a placed tree has on the device, with room for `most` leaves.
fn whole(shown: &Shown, most: usize) -> Vec<u32> {
    let mut words = vec![shown.level().to_bits(), shown.levels().len() as u32, 0, 0];
    words.extend_from_slice(bytemuck::cast_slice(shown.levels()));
    words.extend_from_slice(shown.entries());
    words.resize(words.len() + most - shown.entries().len(), 0);
    words
}

/// Sends what has changed; gives the bytes.
fn send(gpu: &Gpu, placed: &Placed, forest: &LeafForest, sent: Sent) -> u64 {
    let Placed { shown, buffer, .. } = placed;
    let first_entry = HEADER + size_of_val(shown.levels()) as u64;
    gpu.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&shown.level()));
    for range in &sent.levels {
        let at = HEADER + (range.start * size_of::<ClusterLevel>()) as u64;
        gpu.queue.write_buffer(buffer, at, bytemuck::cast_slice(&shown.levels()[range.clone()]));
    }
    if forest.resent {
        // As the predecessor: all of it, whenever any of it changes.
        let anything = !sent.entries.is_empty() || !sent.levels.is_empty();
        if anything {
            gpu.queue.write_buffer(buffer, first_entry, bytemuck::cast_slice(shown.entries()));
            return (sent.levels.iter().map(|r| r.len() * size_of::<ClusterLevel>()).sum::<usize>()
                + size_of_val(shown.entries())
                + 4) as u64;
        }
        return 4;
    }
    for range in &sent.entries {
        let at = first_entry + 4 * range.start as u64;
        gpu.queue.write_buffer(buffer, at, bytemuck::cast_slice(&shown.entries()[range.clone()]));
    }
    sent.bytes() as u64
}

fn key(part: &ForestPart, instance: &layout::Instance) -> Key {
    // Which crowns grow is no matter of leaves.
    let place = layout::Instance { extra: 0, ..*instance };
    let words: &[u32] = bytemuck::cast_slice(std::slice::from_ref(&place));
    (part.number, std::array::from_fn(|k| words[k]))
}

/// Who looks, in the space of a placed tree.
fn viewer(scene: &Scene, instance: &layout::Instance, tree_height_m: f32) -> Viewer {
    let (eye, [plain, by_distance]) = scene.viewer.eye_and_heights();
    let own = turn_of(instance).inverse() * (eye - glam::Vec3::from(instance.position)) / instance.scale;
    // A told level is the same from everywhere.
    let told = by_distance < 0.0;
    let heights = if told { [plain, 0.0] } else { [plain / (instance.scale * tree_height_m), by_distance / tree_height_m] };
    Viewer { eye: own, heights }
}

impl Drawer for ForestDrawer {
    fn prepare(&mut self, gpu: &Gpu, scene: &Scene) -> Result<u64> {
        self.frame += 1;
        let mut sent = 0;
        for (kind, placed) in PASSES.iter().flat_map(|kind| scene.trees(*kind).iter().map(move |placed| (*kind, placed))) {
            for part in placed.tree.forests() {
                self.pipelines.ready(gpu, &part.part, kind, scene.traits);
                for instance in placed.instances(scene, part.part.group) {
                    let key = key(part, instance);
                    if self.placed.get(&key).is_none_or(|placed| placed.used != self.frame) {
                        let viewer = viewer(scene, instance, placed.tree.height_m());
                        sent += gpu.guarded(|| self.show(gpu, part, key, &viewer))?;
                    }
                }
            }
        }
        let frame = self.frame;
        self.placed.retain(|_, placed| placed.used + FORGOTTEN >= frame);
        Ok(sent)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        for tree in scene.trees(kind) {
            for part in tree.tree.forests() {
                let Some((bytes, _)) = tree.placed(part.part.group) else { continue };
                pass.set_pipeline(self.pipelines.of(&part.part, kind, scene.traits));
                pass.set_bind_group(1, &part.part.material, &[]);
                pass.set_index_buffer(part.indices.slice(..), wgpu::IndexFormat::Uint32);
                for (number, instance) in tree.instances(scene, part.part.group).iter().enumerate() {
                    let Some(placed) = self.placed.get(&key(part, instance)) else { continue };
                    let at = bytes.start + (number * size_of::<layout::Instance>()) as u64;
                    pass.set_vertex_buffer(0, scene.instances.slice(at..at + size_of::<layout::Instance>() as u64));
                    pass.set_bind_group(3, &placed.group, &[]);
                    pass.draw_indexed(0..6 * placed.shown.entries().len() as u32, 0, 0..1);
                }
            }
        }
    }
}

fn leaves_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("forest.layout"),
        entries: &[entry(0), entry(1), entry(2)],
    })
}
