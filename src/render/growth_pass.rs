//! The passes that grow the outlines in the trees' temporary pictures (She §3.3, fig. 13), and what they keep between frames.

use super::bound::{PLAIN_COLOR, bind, compute_pipeline, group_layout, storage, texture, view};
use super::growth::GrowthInput;
use super::limb::Twigs;
use super::screen::ScreenPipeline;
use super::targets::{COLOR, ID, Targets, color_attachment, depth_attachment, listed_pixels, nearer};
use crate::gpu::{Gpu, KeptBuffer, Shader, layout};
use crate::{Result, Seed};

/// The passes of growth, and their buffers.
#[derive(Debug)]
pub struct GrowthPass {
    layouts: Layouts,
    detect: wgpu::ComputePipeline,
    plan: wgpu::ComputePipeline,
    walks: [wgpu::ComputePipeline; 4],
    points: wgpu::RenderPipeline,
    plan_buffer: wgpu::Buffer,
    plan_group: wgpu::BindGroup,
    sampler: wgpu::Sampler,
    values: KeptBuffer,
    limbs: KeptBuffer,
    tiles: KeptBuffer,
    /// As large as the targets need.
    buffers: Option<Buffers>,
    /// Of all buffers and targets as they are.
    groups: Option<Groups>,
    /// The twigs of every crown.
    pub twigs: Twigs,
}

/// What each group of `shaders/growth.wgsl` binds.
#[derive(Debug)]
struct Layouts {
    common: wgpu::BindGroupLayout,
    detect: wgpu::BindGroupLayout,
    plan: wgpu::BindGroupLayout,
    walk: wgpu::BindGroupLayout,
}

#[derive(Debug)]
struct Groups {
    common: wgpu::BindGroup,
    detect: wgpu::BindGroup,
    walk: wgpu::BindGroup,
    points: wgpu::BindGroup,
}

/// Buffers of one picture size. Any pixel may be a root, and any may be grown over.
#[derive(Debug)]
struct Buffers {
    counts: wgpu::Buffer,
    roots: wgpu::Buffer,
    nearest: wgpu::Buffer,
    keys: wgpu::Buffer,
    places: wgpu::Buffer,
    colors: wgpu::Buffer,
}

/// The largest of a pixel's entries in them, bytes.
const BYTES_PER_PX: u64 = 8;

impl Buffers {
    fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self> {
        let pixels = listed_pixels(gpu, size_px, BYTES_PER_PX)?;
        let buffer = |label, size: u64, usage| {
            let usage = wgpu::BufferUsages::STORAGE | usage;
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let none = wgpu::BufferUsages::empty();
        let counted = wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST;
        gpu.guarded(|| Self {
            counts: buffer("growth.counts", size_of::<layout::Counts>() as u64, counted),
            roots: buffer("growth.roots", 8 * pixels, none),
            nearest: buffer("growth.nearest", 4 * pixels, none),
            keys: buffer("growth.keys", 4 * pixels, none),
            places: buffer("growth.places", size_of::<layout::GrownPlace>() as u64 * pixels, none),
            colors: buffer("growth.colors", size_of::<layout::GrownColor>() as u64 * pixels, none),
        })
    }
}

impl GrowthPass {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu) -> Self {
        let layouts = Layouts::new(gpu);
        let shader = Shader::load(gpu, "growth");
        let pipeline = |label, entry_point, groups: &[_]| compute_pipeline(gpu, label, &shader.0, entry_point, groups);
        let walk = |label, entry_point| pipeline(label, entry_point, &[Some(&layouts.common), None, None, Some(&layouts.walk)]);
        let plan_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("growth.plan"),
            size: 12,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
            mapped_at_creation: false,
        });
        Self {
            detect: pipeline("growth.detect", "cs_main_detect", &[Some(&layouts.common), Some(&layouts.detect)]),
            plan: pipeline("growth.plan", "cs_main_plan", &[Some(&layouts.common), None, Some(&layouts.plan)]),
            walks: [
                walk("growth.nearest", "cs_main_nearest"),
                walk("growth.settle", "cs_main_settle"),
                walk("growth.emit", "cs_main_emit"),
                walk("growth.forget", "cs_main_forget"),
            ],
            points: points_pipeline(gpu),
            plan_group: bind(gpu, "growth.plan", &layouts.plan, &[plan_buffer.as_entire_binding()]),
            plan_buffer,
            layouts,
            // Nearest, clamped to the edge.
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor { label: Some("growth.sampler"), ..Default::default() }),
            values: KeptBuffer::new(gpu, "growth.frame", wgpu::BufferUsages::STORAGE),
            limbs: KeptBuffer::new(gpu, "growth.limbs", wgpu::BufferUsages::STORAGE),
            tiles: KeptBuffer::new(gpu, "growth.tiles", wgpu::BufferUsages::STORAGE),
            buffers: None,
            groups: None,
            twigs: Twigs::new(Seed(0)),
        }
    }

    /// Drops whatever belongs to targets that there will be no more.
    pub fn forget_targets(&mut self) {
        (self.buffers, self.groups) = (None, None);
    }

    /// Grows the outlines in the trees' temporary buffers. `crowns` holds those of `input` on the device, the same buffer in every frame.
    ///
    /// # Errors
    /// [`Error::OutlineSize`](crate::Error::OutlineSize) for a picture that is too large to grow in, [`Error::Device`](crate::Error::Device) when memory runs out.
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
        self.fill(gpu, targets, input, crowns)?;
        let (Some(buffers), Some(groups)) = (&self.buffers, &self.groups) else { return Ok(()) };
        gpu.queue.write_buffer(
            &buffers.counts,
            0,
            bytemuck::bytes_of(&layout::Counts { instances: 1, ..bytemuck::Zeroable::zeroed() }),
        );
        self.compute(encoder, groups, input.tiles.len() as u32);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("growth.points"),
            color_attachments: &[color_attachment(&targets.tree_color, None), color_attachment(&targets.tree_id, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.tree_depth, false)),
            ..Default::default()
        });
        pass.set_pipeline(&self.points);
        pass.set_bind_group(0, &groups.points, &[]);
        pass.draw_indirect(&buffers.counts, 0);
        Ok(())
    }

    /// Puts `input` onto the device; makes buffers and groups where they are missing or too small.
    fn fill(&mut self, gpu: &Gpu, targets: &Targets, input: &GrowthInput, crowns: &wgpu::Buffer) -> Result<()> {
        let frame = layout::GrowthFrame { tile_count: input.tiles.len() as u32, ..input.frame };
        let contents = [bytemuck::bytes_of(&frame), bytemuck::cast_slice(&input.limbs), bytemuck::cast_slice(&input.tiles)];
        for (buffer, contents) in [&mut self.values, &mut self.limbs, &mut self.tiles].into_iter().zip(contents) {
            if buffer.fill(gpu, contents)? {
                self.groups = None;
            }
        }
        if self.buffers.is_none() {
            self.buffers = Some(Buffers::new(gpu, targets.size_px)?);
        }
        if let (None, Some(buffers)) = (&self.groups, &self.buffers) {
            self.groups = Some(gpu.guarded(|| self.bound(gpu, targets, buffers, crowns))?);
        }
        Ok(())
    }

    fn bound(&self, gpu: &Gpu, targets: &Targets, buffers: &Buffers, crowns: &wgpu::Buffer) -> Groups {
        let Buffers { counts, roots, nearest, keys, places, colors } = buffers;
        let values = self.values.get().as_entire_binding();
        Groups {
            common: bind(
                gpu,
                "growth.common",
                &self.layouts.common,
                &[
                    values.clone(),
                    view(&targets.tree_color),
                    view(&targets.tree_depth),
                    counts.as_entire_binding(),
                    roots.as_entire_binding(),
                ],
            ),
            detect: bind(
                gpu,
                "growth.detect",
                &self.layouts.detect,
                &[
                    crowns.as_entire_binding(),
                    self.limbs.get().as_entire_binding(),
                    self.tiles.get().as_entire_binding(),
                    view(&targets.tree_id),
                    wgpu::BindingResource::Sampler(&self.sampler),
                ],
            ),
            walk: bind(
                gpu,
                "growth.walk",
                &self.layouts.walk,
                &[nearest, keys, places, colors].map(wgpu::Buffer::as_entire_binding),
            ),
            points: bind(
                gpu,
                "growth.points",
                &self.points.get_bind_group_layout(0),
                &[values, places.as_entire_binding(), colors.as_entire_binding()],
            ),
        }
    }

    fn compute(&self, encoder: &mut wgpu::CommandEncoder, groups: &Groups, tiles: u32) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("growth"), timestamp_writes: None });
        pass.set_bind_group(0, &groups.common, &[]);
        pass.set_bind_group(1, &groups.detect, &[]);
        pass.set_pipeline(&self.detect);
        pass.dispatch_workgroups(tiles.min(32768), tiles.div_ceil(32768), 1);
        pass.set_bind_group(2, &self.plan_group, &[]);
        pass.set_pipeline(&self.plan);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_bind_group(3, &groups.walk, &[]);
        for walk in &self.walks {
            pass.set_pipeline(walk);
            pass.dispatch_workgroups_indirect(&self.plan_buffer, 0);
        }
    }
}

impl Layouts {
    fn new(gpu: &Gpu) -> Self {
        let (read, written) = (storage(true), storage(false));
        let layout = |label, types: &[wgpu::BindingType]| group_layout(gpu, label, wgpu::ShaderStages::COMPUTE, types);
        let color = texture(PLAIN_COLOR);
        let depth = texture(wgpu::TextureSampleType::Depth);
        let id = texture(wgpu::TextureSampleType::Uint);
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering);
        Self {
            common: layout("growth.common", &[read, color, depth, written, written]),
            detect: layout("growth.detect", &[read, read, read, id, sampler]),
            plan: layout("growth.plan", &[written]),
            walk: layout("growth.walk", &[written; 4]),
        }
    }
}

fn points_pipeline(gpu: &Gpu) -> wgpu::RenderPipeline {
    let shader = Shader::load(gpu, "grown");
    let over = wgpu::ColorTargetState {
        format: COLOR,
        blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    };
    let targets = [Some(over), Some(ID.into())];
    let pipeline = ScreenPipeline {
        topology: wgpu::PrimitiveTopology::PointList,
        depth: Some(nearer()),
        ..ScreenPipeline::new("growth.points", &shader, &targets)
    };
    pipeline.compiled(gpu)
}
