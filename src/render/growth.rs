//! Growth of crown outlines on the device (She §3.3, fig. 13): which crowns are near enough, the tables they grow by, and the passes.

use std::cell::Cell;

use glam::{Mat4, Quat, Vec3};

use super::limb::{LimbView, Twigs};
use super::mesh::CrownShape;
use super::targets::{COLOR, ID, Targets, color_attachment, depth_attachment, nearer};
use super::tiles::{Tiles, screen_rect};
use super::wind::Sway;
use super::{Camera, Projection, Shot, Stage, Stand};
use crate::geom::Bounds;
use crate::gpu::{Gpu, Shader, layout, upload_buffer};
use crate::model::{Growth, GrowthProfile};
use crate::{Error, Result, Seed};

crate::choices! {
    /// How outlines grow.
    pub enum GrowthChoice {
        /// As the model says.
        Auto = "auto",
        /// Narrow twigs of unlike length: conifers.
        Needle = "needle",
        /// Rounded tufts: broadleaved trees.
        Broadleaf = "broadleaf",
        /// Not at all.
        None = "none",
    }
}

crate::choices! {
    /// What the lengths and directions of growth are keyed by.
    pub enum GrowthKeys {
        /// By the place on the crown: a still camera gives identical frames.
        Steady = "steady",
        /// By pixel and frame, as in the paper: flickers.
        Random = "random",
    }
}

crate::choices! {
    /// Which pixels of an outline grow.
    pub enum GrowthRoots {
        /// Those with exactly one background neighbour, as in the paper.
        Sides = "sides",
        /// And those with two beside each other, between them.
        Corners = "corners",
    }
}

crate::choices! {
    /// Which outlines grow.
    pub enum GrowthEdges {
        /// Those before deeper trees and lobes too.
        All = "all",
        /// Those before nothing at all, as in the paper.
        Outer = "outer",
    }
}

crate::params! {
    /// How the outlines of crowns grow.
    pub struct GrowthParams {
        /// What grows out of the outline of a crown.
        growth: GrowthChoice = GrowthChoice::Auto, unit "", source "ours: species differ (She §4)";
        /// Longest growth on the crown, Qmax; 0 takes the model's.
        growth_max_m: f64 = 0.0, in 0.0..=10.0, unit "m", source "ours: measured on the photograph's outline";
        /// Shortest growth on the crown, Qmin; it is never more than the longest, and 0 takes the model's.
        growth_min_m: f64 = 0.0, in 0.0..=10.0, unit "m", source "ours: measured on the photograph's outline";
        /// Which outlines grow.
        growth_edges: GrowthEdges = GrowthEdges::All, unit "", source "ours: lobes are reshaped too (She §4 leaves it open)";
        /// Which pixels of an outline are roots.
        growth_roots: GrowthRoots = GrowthRoots::Corners, unit "", source "ours: slanted outlines would grow combs (She fig. 13b: sides)";
        /// What the growth is keyed by.
        growth_keys: GrowthKeys = GrowthKeys::Steady, unit "", source "ours: no flicker";
    }
}

impl GrowthParams {
    /// The growth of a tree of which `own` is known.
    fn of(&self, own: Growth) -> Option<Growth> {
        let profile = match self.growth {
            GrowthChoice::None => return None,
            GrowthChoice::Auto => own.profile,
            GrowthChoice::Needle => GrowthProfile::Needle,
            GrowthChoice::Broadleaf => GrowthProfile::Broadleaf,
        };
        let given = |value: f64, own: f64| if value > 0.0 { value } else { own };
        let max_m = given(self.growth_max_m, own.max_m);
        Some(Growth { profile, max_m, min_m: given(self.growth_min_m, own.min_m).min(max_m), ..own })
    }
}

/// What a frame's growth is computed from, beside the pictures; the CPU twin takes the same.
#[derive(Debug, Clone)]
pub struct GrowthInput {
    /// Sizes, scales and switches.
    pub frame: layout::GrowthFrame,
    /// Crowns by slot; the first stands for none.
    pub crowns: Vec<layout::GrowingCrown>,
    /// The tables round their limbs.
    pub limbs: Vec<u32>,
    /// Where to look for outlines.
    pub tiles: Vec<u32>,
    /// Every tile that a tree or its growth touches.
    pub tree_tiles: Vec<u32>,
    /// First slot of each instance of each stand; 0 where it does not grow.
    pub slots: Vec<Vec<u32>>,
}

/// Slots that the id target can tell apart, the empty one among them.
pub const SLOTS: usize = 4096;
/// Longest growth, pixels; `shaders/growth.wgsl` has the same.
const LONGEST_PX: f32 = 31.0;
/// What lies deeper by so much of a crown's mean radius is background to it.
const GAP: f32 = 0.35;

impl GrowthInput {
    /// What grows in a picture.
    pub fn new(shot: &Shot, stands: &[Stand], twigs: &Twigs) -> Self {
        let mut input = Self {
            frame: frame_of(shot),
            crowns: vec![bytemuck::Zeroable::zeroed()],
            limbs: vec![0],
            tiles: vec![],
            tree_tiles: vec![],
            slots: stands.iter().map(|stand| vec![0; stand.instances.len()]).collect(),
        };
        let seer = Seer::new(shot);
        let (mut tiles, mut tree_tiles) = (Tiles::none(shot.size_px), Tiles::none(shot.size_px));
        for stand in stands {
            for instance in stand.instances {
                // Smooth outlines reach a pixel farther.
                seer.rect(stand.tree.bounds(), instance).into_iter().for_each(|rect| tree_tiles.add(grown_by(rect, 1.0)));
            }
        }
        if shot.stage == Stage::Unshaped {
            input.tree_tiles = tree_tiles.list();
            return input;
        }
        for (number, stand) in stands.iter().enumerate() {
            let Some(growth) = shot.growth.of(stand.tree.growth()) else { continue };
            for (i, instance) in stand.instances.iter().enumerate() {
                if input.crowns.len() + stand.tree.crowns().len() > SLOTS {
                    break;
                }
                let first = input.crowns.len() as u32;
                let mut any = false;
                let seen: Vec<_> = stand.tree.crowns().iter().map(|crown| seer.see(crown, instance, &growth)).collect();
                if seen.iter().all(Option::is_none) {
                    continue;
                }
                for (crown, seen) in stand.tree.crowns().iter().zip(seen) {
                    any |= seen.is_some();
                    input.add(crown, seen, instance.scale, &growth, twigs, &mut tiles);
                }
                if any {
                    input.slots[number][i] = first;
                }
            }
        }
        input.frame.alike = seer.alike(&input.crowns);
        tree_tiles.merge(&tiles);
        (input.tiles, input.tree_tiles) = (tiles.list(), tree_tiles.list());
        input
    }

    /// Adds a crown in the next slot; one that is not seen gets a slot in which nothing grows.
    fn add(&mut self, crown: &CrownShape, seen: Option<Seen>, scale: f32, growth: &Growth, twigs: &Twigs, tiles: &mut Tiles) {
        let Some(Seen { view, rect, longest_px }) = seen else {
            self.crowns.push(bytemuck::Zeroable::zeroed());
            return;
        };
        tiles.add(grown_by(rect, longest_px + 2.0));
        let plane = view.plane();
        let table = view.table(twigs, growth);
        // Sixteenths of a pixel from 1/256 pixel per metre.
        let units = |metres: f64| metres as f32 * scale / 16.0;
        self.crowns.push(layout::GrowingCrown {
            limb_x: (plane.x / crown.half_axes).to_array(),
            min_units: units(growth.min_m),
            limb_y: (plane.y / crown.half_axes).to_array(),
            max_units: units(growth.max_m),
            gap_m: GAP * crown.half_axes.element_sum() / 3.0 * scale,
            first: self.limbs.len() as u32,
            count: table.len() as u32,
            pad: 0,
        });
        self.limbs.extend(table);
    }
}

/// A rectangle with a margin.
fn grown_by([left, top, right, bottom]: [f32; 4], margin: f32) -> [f32; 4] {
    [left - margin, top - margin, right + margin, bottom + margin]
}

fn frame_of(shot: &Shot) -> layout::GrowthFrame {
    let whole = 16_777_216.0;
    let (depth_units, orthographic) = match shot.camera.projection {
        Projection::Perspective { near_m, .. } => (near_m * whole, 0),
        Projection::Orthographic { near_m, far_m, .. } => (far_m - near_m, 1),
    };
    layout::GrowthFrame {
        size_px: shot.size_px,
        px_per_m: shot.camera.px_per_m(shot.size_px[1]),
        depth_units,
        orthographic,
        tips: u32::from(matches!(shot.stage, Stage::Antialiased | Stage::Lit)),
        inner: u32::from(shot.growth.growth_edges == GrowthEdges::All),
        random: u32::from(shot.growth.growth_keys == GrowthKeys::Random),
        frame: shot.frame,
        corners: u32::from(shot.growth.growth_roots == GrowthRoots::Corners),
        pad: 0,
        alike: [0.0, 0.0],
        root_limit: 0,
        grown_limit: 0,
    }
}

/// The viewer, and what it needs to see crowns.
struct Seer<'a> {
    camera: &'a Camera,
    clip_from_world: Mat4,
    size_px: [u32; 2],
    px_per_m: [f32; 2],
    sway: Sway,
    /// Of the far sides of all crowns seen so far.
    farthest_m: Cell<f32>,
}

/// A crown as seen.
struct Seen {
    view: LimbView,
    rect: [f32; 4],
    longest_px: f32,
}

impl<'a> Seer<'a> {
    fn new(shot: &'a Shot) -> Self {
        let [width, height] = shot.size_px;
        Self {
            camera: &shot.camera,
            clip_from_world: shot.camera.clip_from_world(width as f32 / height as f32),
            size_px: shot.size_px,
            px_per_m: shot.camera.px_per_m(height),
            sway: Sway::of(&shot.wind),
            farthest_m: Cell::new(0.0),
        }
    }

    /// [`layout::GrowthFrame::alike`] for these crowns: half of the smallest gap, as seen at the farthest crown.
    fn alike(&self, crowns: &[layout::GrowingCrown]) -> [f32; 2] {
        let gap_m = crowns.iter().map(|crown| crown.gap_m).filter(|gap| *gap > 0.0).fold(f32::MAX, f32::min);
        match self.camera.projection {
            _ if gap_m == f32::MAX => [0.0, 0.0],
            // z / (z + gap) of the farthest pixel that a crown near enough to grow can have.
            Projection::Perspective { .. } => [1.0 - 0.5 * gap_m / (self.farthest_m.get() + gap_m), 0.0],
            Projection::Orthographic { near_m, far_m, .. } => [1.0, 0.5 * gap_m / (far_m - near_m)],
        }
    }

    /// Where a box of an instance may be seen, wherever the wind pushes it.
    fn rect(&self, bounds: Option<Bounds>, instance: &layout::Instance) -> Option<[f32; 4]> {
        let (world_from_object, _) = placed(instance);
        let bounds = bounds?;
        let reach = Vec3::splat(self.sway.reach_m(bounds.max.y));
        let swayed = Bounds { min: bounds.min - reach, max: bounds.max + reach };
        screen_rect(&(self.clip_from_world * world_from_object), swayed, self.size_px)
    }

    /// The crown of an instance, where it is in the picture and grows by a pixel or more.
    fn see(&self, crown: &CrownShape, instance: &layout::Instance, growth: &Growth) -> Option<Seen> {
        let (world_from_object, turn) = placed(instance);
        let rect = self.rect(Some(crown.bounds), instance)?;
        let center = world_from_object.transform_point3(crown.center);
        // Of its nearest point: nothing of the crown grows longer.
        let radius = crown.half_axes.max_element() * instance.scale;
        let to_eye = match self.camera.projection {
            Projection::Perspective { .. } => self.camera.eye - center,
            Projection::Orthographic { .. } => self.camera.axes[2],
        };
        let scale_at = |distance_m: f32| match self.camera.projection {
            Projection::Perspective { near_m, .. } => self.px_per_m[1] * near_m / distance_m.max(near_m),
            Projection::Orthographic { .. } => self.px_per_m[0],
        };
        let distance = (self.camera.eye - center).dot(self.camera.axes[2]);
        let longest_px = growth.max_m as f32 * instance.scale * scale_at(distance - radius);
        if longest_px < 1.0 {
            return None;
        }
        let reach_m = crown.bounds.size().length() * instance.scale + self.sway.reach_m(crown.bounds.max.y);
        self.farthest_m.set(self.farthest_m.get().max(distance + reach_m));
        let object = |v: Vec3| turn.inverse() * v;
        let view = LimbView {
            half_axes: crown.half_axes,
            toward_eye: object(to_eye.normalize_or(self.camera.axes[2])),
            screen: [object(self.camera.axes[0]), object(self.camera.axes[1])],
            px_per_m: scale_at(distance) * instance.scale,
        };
        Some(Seen { view, rect, longest_px: longest_px.min(LONGEST_PX) })
    }
}

/// World from object space, and the turn in it.
fn placed(instance: &layout::Instance) -> (Mat4, Quat) {
    let part = |i: usize| f32::from(instance.rotation[i]) / f32::from(i16::MAX);
    let turn = Quat::from_xyzw(part(0), part(1), part(2), part(3)).normalize();
    (Mat4::from_scale_rotation_translation(Vec3::splat(instance.scale), turn, Vec3::from(instance.position)), turn)
}

/// The passes of growth, and their buffers.
#[derive(Debug)]
pub struct GrowthPass {
    group_layout: wgpu::BindGroupLayout,
    detect: wgpu::ComputePipeline,
    plan: wgpu::ComputePipeline,
    walks: [wgpu::ComputePipeline; 4],
    points: wgpu::RenderPipeline,
    plan_buffer: wgpu::Buffer,
    plan_group: wgpu::BindGroup,
    sampler: wgpu::Sampler,
    buffers: Option<Buffers>,
    /// The twigs of every crown.
    pub twigs: Twigs,
}

/// Buffers of one picture size.
#[derive(Debug)]
struct Buffers {
    size_px: [u32; 2],
    counts: wgpu::Buffer,
    roots: wgpu::Buffer,
    nearest: wgpu::Buffer,
    keys: wgpu::Buffer,
    grown: wgpu::Buffer,
}

impl Buffers {
    fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self> {
        let pixels = u64::from(size_px[0]) * u64::from(size_px[1]);
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        if 4 * pixels > limit {
            return Err(Error::GrowthSize { found: size_px, limit_px: limit / 4 });
        }
        let buffer = |label, size: u64, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | usage,
                mapped_at_creation: false,
            })
        };
        let none = wgpu::BufferUsages::empty();
        Ok(Self {
            size_px,
            counts: buffer("growth.counts", 32, wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST),
            roots: buffer("growth.roots", (8 * roots_for(pixels)).min(limit), none),
            nearest: buffer("growth.nearest", 4 * pixels, none),
            keys: buffer("growth.keys", 4 * pixels, none),
            grown: buffer("growth.grown", (16 * grown_for(pixels)).min(limit), none),
        })
    }
}

/// Room for so many roots: no more than a third of the pixels of a picture can be roots that grow.
fn roots_for(pixels: u64) -> u64 {
    (pixels / 3).max(1024)
}

/// Room for so many grown pixels: half of the picture.
fn grown_for(pixels: u64) -> u64 {
    (pixels / 2).max(1024)
}

impl GrowthPass {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu) -> Self {
        let group_layout = group_layout(gpu);
        let shader = Shader::load(gpu, "growth");
        let plan_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("growth.plan"),
            entries: &[storage(0, false)],
        });
        let pipeline = |label, entry_point, groups: &[Option<&wgpu::BindGroupLayout>]| {
            let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: groups,
                immediate_size: 0,
            });
            gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                module: &shader.0,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let main = &[Some(&group_layout)];
        let plan_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("growth.plan"),
            size: 12,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
            mapped_at_creation: false,
        });
        let plan_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("growth.plan"),
            layout: &plan_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: plan_buffer.as_entire_binding() }],
        });
        Self {
            detect: pipeline("growth.detect", "cs_main_detect", main),
            plan: pipeline("growth.plan", "cs_main_plan", &[Some(&group_layout), Some(&plan_layout)]),
            walks: [
                pipeline("growth.nearest", "cs_main_nearest", main),
                pipeline("growth.settle", "cs_main_settle", main),
                pipeline("growth.emit", "cs_main_emit", main),
                pipeline("growth.forget", "cs_main_forget", main),
            ],
            points: points_pipeline(gpu),
            group_layout,
            plan_buffer,
            plan_group,
            // Nearest, clamped to the edge.
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor { label: Some("growth.sampler"), ..Default::default() }),
            buffers: None,
            twigs: Twigs::new(Seed(0)),
        }
    }

    /// Grows the outlines in the trees' temporary buffers. `crowns` holds those of `input` on the device.
    ///
    /// # Errors
    /// [`Error::GrowthSize`] for a picture that is too large to grow in.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        input: &GrowthInput,
        crowns: &wgpu::Buffer,
    ) -> Result<()> {
        if input.tiles.is_empty() {
            return Ok(());
        }
        if self.buffers.as_ref().is_none_or(|buffers| buffers.size_px != targets.size_px) {
            self.buffers = None; // the old ones go before the new ones come
            self.buffers = Some(Buffers::new(gpu, targets.size_px)?);
        }
        let buffers = self.buffers.as_ref().expect("just made");
        let frame = layout::GrowthFrame {
            root_limit: (buffers.roots.size() / 8) as u32,
            grown_limit: (buffers.grown.size() / 16) as u32,
            ..input.frame
        };
        gpu.queue.write_buffer(&buffers.counts, 0, bytemuck::cast_slice(&[0u32, 1, 0, 0, 0, 0, 0, 0]));
        let filled = |label, contents: &[u8], usage| upload_buffer(gpu, label, contents, usage);
        let values = filled("growth.frame", bytemuck::bytes_of(&frame), wgpu::BufferUsages::STORAGE);
        let limbs = filled("growth.limbs", bytemuck::cast_slice(&input.limbs), wgpu::BufferUsages::STORAGE);
        let tiles = filled("growth.tiles", bytemuck::cast_slice(&input.tiles), wgpu::BufferUsages::STORAGE);
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("growth.group"),
            layout: &self.group_layout,
            entries: &[
                entry(0, values.as_entire_binding()),
                entry(1, crowns.as_entire_binding()),
                entry(2, limbs.as_entire_binding()),
                entry(3, tiles.as_entire_binding()),
                entry(4, wgpu::BindingResource::TextureView(&targets.tree_color.view)),
                entry(5, wgpu::BindingResource::TextureView(&targets.tree_depth.view)),
                entry(6, wgpu::BindingResource::TextureView(&targets.tree_id.view)),
                entry(7, buffers.counts.as_entire_binding()),
                entry(8, buffers.roots.as_entire_binding()),
                entry(9, buffers.nearest.as_entire_binding()),
                entry(10, buffers.keys.as_entire_binding()),
                entry(11, buffers.grown.as_entire_binding()),
                entry(12, wgpu::BindingResource::Sampler(&self.sampler)),
            ],
        });
        self.compute(encoder, &group, input.tiles.len() as u32);
        let points = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("growth.points"),
            layout: &self.points.get_bind_group_layout(0),
            entries: &[entry(0, values.as_entire_binding()), entry(1, buffers.grown.as_entire_binding())],
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("growth.points"),
            color_attachments: &[color_attachment(&targets.tree_color, None), color_attachment(&targets.tree_id, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.tree_depth, false)),
            ..Default::default()
        });
        pass.set_pipeline(&self.points);
        pass.set_bind_group(0, &points, &[]);
        pass.draw_indirect(&buffers.counts, 0);
        Ok(())
    }

    fn compute(&self, encoder: &mut wgpu::CommandEncoder, group: &wgpu::BindGroup, tiles: u32) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("growth"), timestamp_writes: None });
        pass.set_bind_group(0, group, &[]);
        pass.set_pipeline(&self.detect);
        pass.dispatch_workgroups(tiles.min(32768), tiles.div_ceil(32768), 1);
        pass.set_pipeline(&self.plan);
        pass.set_bind_group(1, &self.plan_group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        for walk in &self.walks {
            pass.set_pipeline(walk);
            pass.dispatch_workgroups_indirect(&self.plan_buffer, 0);
        }
    }
}

fn storage(binding: u32, read_only: bool) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Storage { read_only };
    compute_entry(binding, wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None })
}

fn compute_entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}

fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("growth.layout"),
        entries: &[
            storage(0, true),
            storage(1, true),
            storage(2, true),
            storage(3, true),
            compute_entry(4, texture(wgpu::TextureSampleType::Float { filterable: false })),
            compute_entry(5, texture(wgpu::TextureSampleType::Depth)),
            compute_entry(6, texture(wgpu::TextureSampleType::Uint)),
            storage(7, false),
            storage(8, false),
            storage(9, false),
            storage(10, false),
            storage(11, false),
            compute_entry(12, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)),
        ],
    })
}

fn points_pipeline(gpu: &Gpu) -> wgpu::RenderPipeline {
    let shader = Shader::load(gpu, "grown");
    let over = wgpu::ColorTargetState {
        format: COLOR,
        blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("growth.points"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &shader.0,
            entry_point: Some("vs_main"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::PointList, ..Default::default() },
        depth_stencil: Some(nearer()),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &shader.0,
            entry_point: Some("fs_main"),
            compilation_options: Default::default(),
            targets: &[Some(over), Some(ID.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
