//! The drawer of leaves in many levels of detail (Rebollo §IV and V, fig. 7 and 10).
//!
//! The vertices of all leaves of all levels are put onto the device once and are shared by every tree of the species. Each placed tree has
//! lists of those that it shows, as indices; when the viewer moves, only what has changed of them is sent. Two draws a tree: most leaves are
//! as they are and cost what leaves of plain surfaces do; two of each cluster are on their way into one, and the vertex stage reckons where
//! that has brought them.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::Counted;
use super::drawer::{Drawer, PASSES, PassKind};
use super::part::{DevicePart, PartStore, PlaceInTree, Textures};
use super::pipelines::{Pipelines, Style};
use super::placing::{Groups, Placing};
use super::scene::{Scene, SceneTree, turn_of};
use crate::Result;
use crate::geom::{PolyMesh, Surface};
use crate::gpu::{Changes, Gpu, KeptBuffer, layout, storage_layout, upload_buffer};
use crate::model::Part;
use crate::repr::BuiltPart;
use crate::repr::lodf::{ClusterLevel, LISTED, LeafForest, LeafId, Sent, Shown, Viewer, foliage};

/// The foliage of a part on the device.
#[derive(Debug)]
pub struct ForestPart {
    /// What it is made of, when it is seen, and four vertices of each leaf of each level, by
    /// [`lodf::Forest::flat`](crate::repr::lodf::Forest::flat); which of them are shown is up to each placed tree.
    pub part: DevicePart,
    forest: Arc<LeafForest>,
    /// [`layout::Becoming`] each, beside the vertices.
    becoming: wgpu::Buffer,
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
        let surface = corners(&built.part.surface, forest);
        let becoming = becoming(&surface, forest);
        let part = Part { surface, ..built.part.clone() };
        Self {
            part: store.upload(gpu, &part, (&built.drawn, &built.seen), place, textures),
            becoming: upload_buffer(gpu, "forest.becoming", bytemuck::cast_slice(&becoming), wgpu::BufferUsages::VERTEX),
            forest: forest.clone(),
            number: UPLOADED.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// Sets its material and the vertices of its leaves.
    fn bind(&self, pass: &mut wgpu::RenderPass) {
        pass.set_bind_group(1, &self.part.material, &[]);
        pass.set_vertex_buffer(0, self.part.vertices.slice(..));
        pass.set_vertex_buffer(2, self.becoming.slice(..));
    }
}

/// The vertices of all leaves of all levels, four each.
fn corners(surface: &Surface, forest: &LeafForest) -> Surface {
    let structure = &forest.forest;
    let of_cluster = |cluster| (0..structure.order(cluster).len() as u16).map(move |number| LeafId { cluster, number });
    let leaves = (0..structure.clusters() as u32).flat_map(of_cluster);
    let all: Vec<_> = leaves.flat_map(|leaf| foliage::drawn(surface, &structure.shape(leaf))).collect();
    Surface {
        mesh: PolyMesh { positions: all.iter().map(|corner| corner.position).collect(), ..PolyMesh::default() },
        normals: all.iter().map(|corner| corner.normal).collect(),
        uvs: all.iter().map(|corner| corner.uv).collect(),
        ..Surface::default()
    }
}

/// What becomes of each.
fn becoming(corners: &Surface, forest: &LeafForest) -> Vec<layout::Becoming> {
    let structure = &forest.forest;
    let (positions, normals) = (&corners.mesh.positions, &corners.normals);
    let place = |leaf: u32, k: usize| 4 * leaf as usize + k;
    let mut becoming = vec![bytemuck::Zeroable::zeroed(); positions.len()];
    for cluster in 0..structure.clusters() as u32 {
        for [heir, absorbed, made] in (0..structure.size(cluster)).map_while(|collapsed| structure.next(cluster, collapsed)) {
            let [heir, absorbed, made] = [heir, absorbed, made].map(|number| structure.flat(LeafId { cluster, number }));
            let middle = 0.25 * (0..4).map(|k| positions[place(absorbed, k)]).sum::<Vec3>();
            for k in 0..4 {
                let (position, normal) = (positions[place(made, k)].to_array(), normals[place(made, k)].to_array());
                becoming[place(heir, k)] = layout::Becoming { position, cluster, normal, heir: 1 };
                let (position, normal) = (middle.to_array(), normals[place(absorbed, k)].to_array());
                becoming[place(absorbed, k)] = layout::Becoming { position, cluster, normal, heir: 0 };
            }
        }
    }
    becoming
}

/// Two triangles of the four vertices of a leaf.
fn indices(leaf: u32) -> [u32; 6] {
    [0, 1, 2, 0, 2, 3].map(|corner| 4 * leaf + corner)
}

/// Which placed tree: the part, and where it stands, so that trees in one place share what they show.
type Key = (u64, [u32; 8]);

/// What one placed tree shows.
#[derive(Debug)]
struct Placed {
    shown: Shown,
    /// The level, and what is under way in each cluster.
    levels: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Those of the pairs, with room for one of each cluster; then those of the other leaves.
    indices: wgpu::Buffer,
    first_still: u64,
    /// The frame in which it was drawn last.
    used: u64,
}

impl Placed {
    fn new(gpu: &Gpu, layout: &wgpu::BindGroupLayout, forest: &LeafForest, shown: Shown) -> (Self, u64) {
        let mut words = vec![shown.level().to_bits(), 0, 0, 0];
        words.extend_from_slice(bytemuck::cast_slice(shown.levels()));
        let levels = upload_buffer(gpu, "forest.levels", bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE);
        let first_still = 2 * LISTED as u64 * forest.forest.clusters() as u64;
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("forest.indices"),
            size: first_still + (LISTED * forest.forest.leaves()) as u64,
            usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let lists = [(0, shown.pairs().as_flattened()), (first_still, shown.still())];
        for (at, leaves) in lists.into_iter().filter(|(_, leaves)| !leaves.is_empty()) {
            gpu.queue.write_buffer(&buffer, at, bytemuck::cast_slice(&listed(leaves)));
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("forest.group"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: levels.as_entire_binding() }],
        });
        let bytes = size_of_val(&words[..]) + LISTED * shown.leaves();
        (Self { shown, levels, group, indices: buffer, first_still, used: 0 }, bytes as u64)
    }

    /// What of it has changed; gives the bytes.
    fn change(&self, forest: &LeafForest, sent: Sent, changes: &mut Changes) -> u64 {
        let Self { shown, levels, indices, first_still, .. } = self;
        if sent.level {
            changes.write(levels, 0, bytemuck::bytes_of(&shown.level()));
        }
        for range in &sent.levels {
            let at = HEADER + (range.start * size_of::<ClusterLevel>()) as u64;
            changes.write(levels, at, bytemuck::cast_slice(&shown.levels()[range.clone()]));
        }
        // As the predecessor: all of it, whenever any of it changes.
        let all = forest.resent && sent.bytes() > size_of::<f32>();
        let sent = if all { shown.whole(sent) } else { sent };
        for range in &sent.pairs {
            changes.write(
                indices,
                (2 * LISTED * range.start) as u64,
                bytemuck::cast_slice(&listed(shown.pairs()[range.clone()].as_flattened())),
            );
        }
        for range in &sent.still {
            changes.write(
                indices,
                first_still + (LISTED * range.start) as u64,
                bytemuck::cast_slice(&listed(&shown.still()[range.clone()])),
            );
        }
        sent.bytes() as u64
    }

    /// Indices of the leaves that are as they are.
    fn still(&self) -> Range<u32> {
        let first = (self.first_still / size_of::<u32>() as u64) as u32;
        first..first + 6 * self.shown.still().len() as u32
    }

    /// Of those that are on their way.
    fn pairs(&self) -> Range<u32> {
        0..12 * self.shown.pairs().len() as u32
    }
}

/// The indices of leaves.
fn listed(leaves: &[u32]) -> Vec<[u32; 6]> {
    leaves.iter().map(|leaf| indices(*leaf)).collect()
}

/// Frames that a tree may be out of sight before what it shows is forgotten.
const FORGOTTEN: u64 = 120;

/// Bytes before the levels of the clusters.
const HEADER: u64 = 16;

/// Draws leaves.
#[derive(Debug)]
pub struct ForestDrawer {
    /// Of leaves that are as they are.
    still: Pipelines,
    /// Of those on their way into another.
    pairs: Pipelines,
    layout: wgpu::BindGroupLayout,
    placed: HashMap<Key, Placed>,
    staging: KeptBuffer,
    frame: u64,
}

/// A placed tree whose leaves a frame shows.
struct Asked<'a> {
    part: &'a ForestPart,
    key: Key,
    viewer: Viewer,
    placed: Option<Placed>,
}

impl ForestDrawer {
    /// Without any pipeline yet.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        const BUFFERS: &[Option<wgpu::VertexBufferLayout<'static>>] =
            &[Some(layout::Vertex::LAYOUT), Some(layout::Instance::LAYOUT), Some(layout::Becoming::LAYOUT)];
        let layout = storage_layout(gpu, "forest.layout");
        let style = Style { seen: "leaves", cast: "cast_leaves", buffers: BUFFERS, solid: false, grows: false };
        Self {
            still: Pipelines::of_parts(gpu, groups, Placing::Each, ["mesh", "cast"], true),
            pairs: Pipelines::new(gpu, style, groups, Some(&layout)),
            layout,
            placed: HashMap::new(),
            staging: KeptBuffer::new(gpu, "forest.changes", wgpu::BufferUsages::COPY_SRC),
            frame: 0,
        }
    }

    /// Shows of placed trees what their viewers ask for; gives the bytes sent.
    fn show(&mut self, gpu: &Gpu, mut asked: Vec<Asked>) -> Result<u64> {
        let told = asked.par_iter_mut().map(|Asked { part, viewer, placed, .. }| {
            let wanted = part.forest.wanted(viewer);
            match placed {
                Some(placed) => {
                    let sent = placed.shown.set(&part.forest, &wanted);
                    Err(placed.shown.tidied(&part.forest, sent))
                }
                None => Ok(Shown::at(&part.forest, &wanted)),
            }
        });
        let told: Vec<_> = told.collect();
        let (mut bytes, mut changes) = (0, Changes::default());
        for (Asked { part, key, placed, .. }, told) in asked.into_iter().zip(told) {
            let (placed, sent) = match (placed, told) {
                (Some(placed), Err(sent)) => {
                    let sent = placed.change(&part.forest, sent, &mut changes);
                    (placed, sent)
                }
                (_, Ok(shown)) => gpu.guarded(|| Placed::new(gpu, &self.layout, &part.forest, shown))?,
                (None, Err(_)) => continue,
            };
            self.placed.insert(key, Placed { used: self.frame, ..placed });
            bytes += sent;
        }
        changes.send(gpu, &mut self.staging)?;
        Ok(bytes)
    }

    /// Leaves shown of all trees in the last frame.
    pub fn leaves_shown(&self) -> usize {
        self.placed.values().filter(|placed| placed.used == self.frame).map(|placed| placed.shown.leaves()).sum()
    }

    /// Draw calls and triangles of leaves in a pass of the frame that was prepared last.
    pub fn counted(&self, scene: &Scene, kind: PassKind) -> Counted {
        let of = |(_, placed): (Standing, &Placed)| {
            let lists = [placed.still(), placed.pairs()];
            let indices: u64 = lists.iter().map(|list| list.len() as u64).sum();
            Counted { draws: lists.iter().filter(|list| !list.is_empty()).count() as u64, triangles: indices / 3 }
        };
        self.standing(scene, kind).map(of).fold(Counted::default(), |sum, counted| sum + counted)
    }

    /// All placed trees of a pass.
    fn standing<'a>(&'a self, scene: &'a Scene, kind: PassKind) -> impl Iterator<Item = (Standing<'a>, &'a Placed)> {
        let forests = scene.trees(kind).iter().flat_map(|tree| tree.tree.forests().iter().map(move |part| (tree, part)));
        forests.flat_map(move |(tree, part)| {
            let instances = tree.instances(scene, part.part.group).iter().enumerate();
            instances.filter_map(move |(number, instance)| {
                Some((Standing { tree, part, number, instance }, self.placed.get(&key(part, instance))?))
            })
        })
    }
}

/// The foliage of a part where it stands.
struct Standing<'a> {
    tree: &'a SceneTree<'a>,
    part: &'a ForestPart,
    /// Among the instances of the part's group.
    number: usize,
    instance: &'a layout::Instance,
}

impl Standing<'_> {
    /// Where its instance lies on the device.
    fn bytes(&self) -> Option<Range<u64>> {
        let (all, _) = self.tree.placed(self.part.part.group)?;
        let size = size_of::<layout::Instance>() as u64;
        let at = all.start + self.number as u64 * size;
        Some(at..at + size)
    }
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
        let (mut asked, mut known) = (vec![], HashSet::new());
        for (kind, placed) in PASSES.iter().flat_map(|kind| scene.trees(*kind).iter().map(move |placed| (*kind, placed))) {
            for part in placed.tree.forests() {
                self.still.ready(gpu, &part.part, kind, scene.traits);
                self.pairs.ready(gpu, &part.part, kind, scene.traits);
                for instance in placed.instances(scene, part.part.group) {
                    let key = key(part, instance);
                    if known.insert(key) {
                        let viewer = viewer(scene, instance, placed.tree.height_m());
                        asked.push(Asked { part, key, viewer, placed: self.placed.remove(&key) });
                    }
                }
            }
        }
        let sent = self.show(gpu, asked)?;
        let frame = self.frame;
        self.placed.retain(|_, placed| placed.used + FORGOTTEN >= frame);
        Ok(sent)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        let mut standing: Vec<_> = self.standing(scene, kind).collect();
        // What is before others goes first, so that fewer fragments are worked on that are hidden.
        let away = |at: &Standing| scene.viewer.away_m(Vec3::from(at.instance.position));
        standing.sort_by(|(a, _), (b, _)| away(a).total_cmp(&away(b)));
        for (pipelines, pairs) in [(&self.still, false), (&self.pairs, true)] {
            for (at, placed) in &standing {
                let list = if pairs { placed.pairs() } else { placed.still() };
                let Some(bytes) = at.bytes().filter(|_| !list.is_empty()) else { continue };
                pass.set_pipeline(pipelines.of(&at.part.part, kind, scene.traits));
                at.part.bind(pass);
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                pass.set_index_buffer(placed.indices.slice(..), wgpu::IndexFormat::Uint32);
                if pairs {
                    pass.set_bind_group(3, &placed.group, &[]);
                }
                pass.draw_indexed(list, 0, 0..1);
            }
        }
    }
}
