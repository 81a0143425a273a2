//! Smooth outlines (She fig. 15 d): which pixels lie on outlines is found in the trees' temporary picture, and what they show in the end is
//! mixed for them alone; as points they then go into the frame over whole pixels.

use super::bound::{PLAIN_COLOR, bind, compute_pipeline, group_layout, storage, texture, view};
use super::screen::ScreenPipeline;
use super::targets::{COLOR, Targets, listed_pixels, nearer};
use crate::Result;
use crate::gpu::{Gpu, KeptBuffer, Shader, layout};

/// The passes of smoothing, and their buffers.
#[derive(Debug)]
pub struct Smoothing {
    common_layout: wgpu::BindGroupLayout,
    collect: wgpu::ComputePipeline,
    plan: wgpu::ComputePipeline,
    mix: wgpu::ComputePipeline,
    points: wgpu::RenderPipeline,
    plan_buffer: wgpu::Buffer,
    plan_group: wgpu::BindGroup,
    sampler: wgpu::Sampler,
    /// As large as the targets need.
    buffers: Option<Buffers>,
    /// Of all buffers and targets as they are.
    groups: Option<Groups>,
}

#[derive(Debug)]
struct Groups {
    common: wgpu::BindGroup,
    points: wgpu::BindGroup,
}

/// Buffers of one picture size. Any pixel may lie on an outline.
#[derive(Debug)]
struct Buffers {
    counts: wgpu::Buffer,
    pixels: wgpu::Buffer,
    colors: wgpu::Buffer,
}

/// A pixel's entry among the colours, bytes.
const BYTES_PER_PX: u64 = 8;

impl Buffers {
    fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self> {
        let pixels = listed_pixels(gpu, size_px, BYTES_PER_PX)?;
        let buffer = |label, size, usage| {
            let usage = wgpu::BufferUsages::STORAGE | usage;
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let none = wgpu::BufferUsages::empty();
        gpu.guarded(|| Self {
            counts: buffer(
                "smooth.counts",
                size_of::<layout::Smoothed>() as u64,
                wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST,
            ),
            pixels: buffer("smooth.pixels", 4 * pixels, none),
            colors: buffer("smooth.colors", BYTES_PER_PX * pixels, none),
        })
    }
}

impl Smoothing {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout) -> Self {
        let compute = wgpu::ShaderStages::COMPUTE;
        let (color, depth) = (texture(PLAIN_COLOR), texture(wgpu::TextureSampleType::Depth));
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering);
        let (read, written) = (storage(true), storage(false));
        let common_layout =
            group_layout(gpu, "smooth.common", compute, &[depth, color, color, depth, sampler, read, written, written, written]);
        let plan_layout = group_layout(gpu, "smooth.plan", compute, &[written]);
        let shader = Shader::load(gpu, "smooth");
        let pipeline = |label, entry_point, plan: Option<_>| {
            let groups = [Some(frame), Some(&common_layout), plan];
            compute_pipeline(gpu, label, &shader.0, entry_point, &groups[..if plan.is_some() { 3 } else { 2 }])
        };
        let plan_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("smooth.plan"),
            size: 12,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
            mapped_at_creation: false,
        });
        Self {
            collect: pipeline("smooth.collect", "cs_main_collect", None),
            plan: pipeline("smooth.plan", "cs_main_plan", Some(&plan_layout)),
            mix: pipeline("smooth.mix", "cs_main_mix", None),
            points: points_pipeline(gpu),
            plan_group: bind(gpu, "smooth.plan", &plan_layout, &[plan_buffer.as_entire_binding()]),
            plan_buffer,
            // Nearest, clamped to the edge.
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor { label: Some("smooth.sampler"), ..Default::default() }),
            common_layout,
            buffers: None,
            groups: None,
        }
    }

    /// Drops what belongs to targets that there will be no more.
    pub fn forget_targets(&mut self) {
        (self.buffers, self.groups) = (None, None);
    }

    /// Drops what binds a buffer of tiles that there will be no more.
    pub fn forget_tiles(&mut self) {
        self.groups = None;
    }

    /// Finds the pixels on outlines in the first `count` of `tiles`, and what they show in the end. Before the trees come into the frame.
    ///
    /// # Errors
    /// [`Error::OutlineSize`](crate::Error::OutlineSize) for a picture that is too large to list its pixels,
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    pub fn mix(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        targets: &Targets,
        tiles: &KeptBuffer,
        count: u32,
    ) -> Result<()> {
        if self.buffers.is_none() {
            self.buffers = Some(Buffers::new(gpu, targets.size_px)?);
        }
        if let (None, Some(buffers)) = (&self.groups, &self.buffers) {
            self.groups = Some(gpu.guarded(|| self.bound(gpu, targets, buffers, tiles.get()))?);
        }
        let (Some(buffers), Some(groups)) = (&self.buffers, &self.groups) else { return Ok(()) };
        let begun = layout::Smoothed { instances: 1, tiles: count, ..bytemuck::Zeroable::zeroed() };
        gpu.queue.write_buffer(&buffers.counts, 0, bytemuck::bytes_of(&begun));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("smooth"), timestamp_writes: None });
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &groups.common, &[]);
        pass.set_pipeline(&self.collect);
        pass.dispatch_workgroups(count.min(32768), count.div_ceil(32768), 1);
        pass.set_bind_group(2, &self.plan_group, &[]);
        pass.set_pipeline(&self.plan);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_pipeline(&self.mix);
        pass.dispatch_workgroups_indirect(&self.plan_buffer, 0);
        Ok(())
    }

    /// Draws them into the frame.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        let (Some(buffers), Some(groups)) = (&self.buffers, &self.groups) else { return };
        pass.set_pipeline(&self.points);
        pass.set_bind_group(0, &groups.points, &[]);
        pass.draw_indirect(&buffers.counts, 0);
    }

    fn bound(&self, gpu: &Gpu, targets: &Targets, buffers: &Buffers, tiles: &wgpu::Buffer) -> Groups {
        let Buffers { counts, pixels, colors } = buffers;
        let common = [
            view(&targets.tree_depth),
            view(&targets.tree_color),
            view(&targets.frame_color),
            view(&targets.frame_depth),
            wgpu::BindingResource::Sampler(&self.sampler),
            tiles.as_entire_binding(),
            counts.as_entire_binding(),
            pixels.as_entire_binding(),
            colors.as_entire_binding(),
        ];
        let points = [view(&targets.tree_depth), pixels.as_entire_binding(), colors.as_entire_binding()];
        Groups {
            common: bind(gpu, "smooth.common", &self.common_layout, &common),
            points: bind(gpu, "smooth.points", &self.points.get_bind_group_layout(0), &points),
        }
    }
}

/// The colours are final: they neither blend nor ask for depth.
fn points_pipeline(gpu: &Gpu) -> wgpu::RenderPipeline {
    let shader = Shader::load(gpu, "smoothed");
    let targets = [Some(COLOR.into())];
    let always = wgpu::DepthStencilState {
        depth_write_enabled: Some(false),
        depth_compare: Some(wgpu::CompareFunction::Always),
        ..nearer()
    };
    let pipeline = ScreenPipeline {
        topology: wgpu::PrimitiveTopology::PointList,
        depth: Some(always),
        ..ScreenPipeline::new("smooth.points", &shader, &targets)
    };
    pipeline.compiled(gpu)
}
