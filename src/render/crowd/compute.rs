//! Culling on the device: `shaders/cull.wgsl` asks each tree that may be seen, and fills the lists and the calls. Which cells are seen is
//! found on the processor all the same (`cull`): they are a sixty-fourth as many, growth and smoothing have to know of them before anything
//! is drawn, and their order, from front to back, is that of the lists. Trees that may be near enough to be drawn by themselves are asked
//! there too. Nothing is read back but by who asks for numbers after a frame.

use std::num::NonZeroU64;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use super::Shape;
use super::cull::{Candidates, MOST_CANDIDATES};
use crate::gpu::layout::{CullBlock, CullCall, CullGroup, CullList, CullLook, CullSpan};
use crate::gpu::{Gpu, KeptBuffer, Shader, read_buffer, upload_buffer};
use crate::render::bound::{bind, compute_pipeline, group_layout, storage};
use crate::render::part::{facing_bits, presence_of};
use crate::repr::{Drawn, Facing};
use crate::{Error, Result};

/// The steps.
#[derive(Debug)]
pub struct Culler {
    test: wgpu::ComputePipeline,
    sum: wgpu::ComputePipeline,
    list: wgpu::ComputePipeline,
    calls: wgpu::ComputePipeline,
    /// What every pass knows of the frame.
    frame: wgpu::Buffer,
    /// Layouts of groups 0 to 2.
    candidates: wgpu::BindGroupLayout,
    asked: wgpu::BindGroupLayout,
    result: wgpu::BindGroupLayout,
}

impl Culler {
    /// Compiles them; `frame` holds what every pass knows of the frame.
    pub fn new(gpu: &Gpu, frame: &wgpu::Buffer) -> Self {
        let (read, written) = (storage(true), storage(false));
        let layout = |label, types: &[wgpu::BindingType]| group_layout(gpu, label, wgpu::ShaderStages::COMPUTE, types);
        let candidates = layout("cull.candidates", &[read, read, written]);
        let asked = layout("cull.asked", &[read; 3]);
        let result = layout("cull.result", &[written; 3]);
        let shader = Shader::load(gpu, "cull");
        let pipeline = |label, entry_point, groups: &[_]| compute_pipeline(gpu, label, &shader.0, entry_point, groups);
        let summing = [Some(&candidates), None, Some(&result)];
        Self {
            test: pipeline("cull.test", "cs_main_test", &[Some(&candidates), Some(&asked)]),
            sum: pipeline("cull.sum", "cs_main_sum", &summing),
            list: pipeline("cull.list", "cs_main_list", &summing),
            calls: pipeline("cull.calls", "cs_main_calls", &summing),
            frame: frame.clone(),
            candidates,
            asked,
            result,
        }
    }

    /// Does what a pass's lists ask for, if that has not been done yet; gives whether it had not.
    pub fn run(&self, encoder: &mut wgpu::CommandEncoder, asking: &Asking) -> bool {
        let due = asking.due.swap(false, Ordering::Relaxed);
        let (true, Some(groups)) = (due, &asking.groups) else { return false };
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("cull"), timestamp_writes: None });
        for (group, bound) in (0..).zip(groups) {
            pass.set_bind_group(group, bound, &[]);
        }
        let mut step = |pipeline, [across, down]: [u32; 2]| {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(across, down, 1);
        };
        step(&self.test, asking.block_rows);
        step(&self.sum, asking.list_rows);
        step(&self.list, asking.block_rows);
        step(&self.calls, [asking.calls.div_ceil(CullBlock::CANDIDATES), 1]);
        true
    }
}

/// What the device has to know of the trees once and for all.
#[derive(Debug)]
pub struct Places {
    /// Where they stand.
    placed: wgpu::Buffer,
    /// A [`CullGroup`] for each list.
    groups: wgpu::Buffer,
}

impl Places {
    /// Trees of these species, whose places `placed` holds.
    pub fn new(gpu: &Gpu, shapes: &[Shape], placed: wgpu::Buffer) -> Self {
        let sized = |shape: &Shape, seen: &crate::repr::Seen| CullGroup {
            seen: presence_of(&Drawn::Still, seen),
            // What has sides of its own is seen of one tree as of another.
            facing: if matches!(seen.facing, Facing::Own { .. }) { 0 } else { facing_bits(seen) },
            height_m: shape.height_m,
            radius_m: shape.radius_m,
            center_m: shape.reach.center().dot(Vec3::Y),
        };
        let of_groups = shapes.iter().flat_map(|shape| shape.groups.iter().map(move |seen| sized(shape, seen)));
        // Of each species one more, by which those in the picture are counted.
        let counted = shapes.iter().map(|shape| sized(shape, &crate::repr::Seen::default()));
        let groups: Vec<CullGroup> = of_groups.chain(counted).collect();
        let none = [bytemuck::Zeroable::zeroed()];
        let groups = if groups.is_empty() { &none[..] } else { &groups[..] };
        let usage = wgpu::BufferUsages::STORAGE;
        Self { placed, groups: upload_buffer(gpu, "cull.groups", bytemuck::cast_slice(groups), usage) }
    }
}

/// What a pass asks the device.
#[derive(Debug)]
pub struct Asking {
    look: KeptBuffer,
    spans: KeptBuffer,
    blocks: KeptBuffer,
    lists: KeptBuffer,
    /// Groups 0 to 2.
    groups: Option<[wgpu::BindGroup; 3]>,
    block_rows: [u32; 2],
    list_rows: [u32; 2],
    calls: u32,
    /// It was not done yet.
    due: AtomicBool,
}

impl Asking {
    /// Nothing.
    pub fn new(gpu: &Gpu) -> Self {
        let kept = |label| KeptBuffer::new(gpu, label, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        Self {
            look: kept("cull.look"),
            spans: kept("cull.spans"),
            blocks: kept("cull.blocks"),
            lists: kept("cull.lists"),
            groups: None,
            block_rows: [0; 2],
            list_rows: [0; 2],
            calls: 0,
            due: false.into(),
        }
    }

    /// Sends what is to be asked, and makes room for who is found. Gives how many bytes that were.
    ///
    /// # Errors
    /// [`Error::ShaderRoom`] for more than the adapter's shaders can be given, [`Error::Device`] when memory runs out.
    pub fn fill(
        &mut self,
        gpu: &Gpu,
        (culler, places): (&Culler, &Places),
        (look, candidates): (CullLook, &Candidates),
        entries: &mut KeptBuffer,
        (calls, number): (&KeptBuffer, usize),
    ) -> Result<u64> {
        (self.groups, self.due) = (None, false.into());
        let most = room(gpu);
        let Candidates { count, spans, blocks, lists, .. } = candidates;
        let needed = count * size_of::<u32>() as u64;
        if needed > most || *count > MOST_CANDIDATES {
            return Err(too_much(gpu, "trees that may be seen", needed, "leave out --culling compute"));
        }
        let axis = gpu.device.limits().max_compute_workgroups_per_dimension;
        (self.block_rows, self.list_rows, self.calls) = (rows(blocks.len(), axis), rows(lists.len(), axis), number as u32);
        // Workgroups that only fill up the last row find nobody, in a span that is not reached and has one behind it to stop at.
        let nobody = CullSpan { at: u32::MAX, tree: 0, count_and_tests: 0 };
        let all_spans: Vec<CullSpan> = spans.iter().copied().chain([nobody; 2]).collect();
        let idle = CullBlock { first_span: spans.len() as u32, ..bytemuck::Zeroable::zeroed() };
        let mut all_blocks = blocks.clone();
        all_blocks.resize(self.block_rows.iter().product::<u32>() as usize, idle);
        let contents: [(&mut KeptBuffer, &[u8]); 4] = [
            (&mut self.look, bytemuck::bytes_of(&look)),
            (&mut self.spans, bytemuck::cast_slice(&all_spans)),
            (&mut self.blocks, bytemuck::cast_slice(&all_blocks)),
            (&mut self.lists, bytemuck::cast_slice(lists)),
        ];
        let mut sent = 0;
        for (buffer, contents) in contents {
            sent += contents.len() as u64;
            buffer.fill(gpu, contents)?;
        }
        entries.room(gpu, needed)?;
        if blocks.is_empty() || number == 0 {
            return Ok(sent);
        }
        let part = |buffer: &'_ KeptBuffer, bytes: usize| (buffer.get().clone(), bytes as u64);
        let frame = (culler.frame.clone(), culler.frame.size());
        let candidates = [frame, part(&self.spans, size_of_val(&all_spans[..])), part(&self.blocks, size_of_val(&all_blocks[..]))];
        let result = [
            part(&self.lists, size_of_val(&lists[..])),
            part(entries, needed as usize),
            part(calls, number * size_of::<CullCall>()),
        ];
        self.groups = Some(gpu.guarded(|| {
            let asked = [self.look.get(), &places.placed, &places.groups].map(wgpu::Buffer::as_entire_binding);
            [
                bind(gpu, "cull.candidates", &culler.candidates, &candidates.each_ref().map(first_bytes)),
                bind(gpu, "cull.asked", &culler.asked, &asked),
                bind(gpu, "cull.result", &culler.result, &result.each_ref().map(first_bytes)),
            ]
        })?);
        self.due = true.into();
        Ok(sent)
    }

    /// How many trees were found for each list, once that was done. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Device`].
    pub fn counts(&self, gpu: &Gpu, lists: usize) -> Result<Vec<u32>> {
        if self.groups.is_none() {
            return Ok(vec![0; lists]);
        }
        let all: Vec<CullList> =
            bytemuck::pod_collect_to_vec(&read_buffer(gpu, self.lists.get())?[..lists * size_of::<CullList>()]);
        Ok(all.iter().map(|list| list.kept).collect())
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        [&self.look, &self.spans, &self.blocks, &self.lists].iter().map(|buffer| buffer.get().size()).sum()
    }
}

fn first_bytes((buffer, bytes): &(wgpu::Buffer, u64)) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: NonZeroU64::new(*bytes) })
}

/// Most bytes of a buffer that shaders are given.
pub fn room(gpu: &Gpu) -> u64 {
    let limits = gpu.device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// Says that it is more.
pub fn too_much(gpu: &Gpu, what: &'static str, needed: u64, instead: &'static str) -> Error {
    let mb = |bytes: u64| bytes as f64 / 1e6;
    Error::ShaderRoom { adapter: gpu.info.name.clone(), what, needed_mb: mb(needed), most_mb: mb(room(gpu)), instead }
}

/// So many workgroups in rows that are no longer than `most`.
fn rows(workgroups: usize, most: u32) -> [u32; 2] {
    let down = (workgroups as u32).div_ceil(most).max(1);
    [(workgroups as u32).div_ceil(down), down]
}

#[cfg(test)]
mod tests {
    use super::rows;

    #[test]
    fn rows_hold_all_workgroups_and_leave_less_than_a_row_idle() {
        assert_eq!(rows(0, 65_535), [0, 1]);
        for workgroups in [1, 64, 65_535, 65_536, 100_003, 70_000_000] {
            let [across, down] = rows(workgroups, 65_535);
            let all = u64::from(across) * u64::from(down);
            assert!(across <= 65_535 && all >= workgroups as u64 && all - (workgroups as u64) < u64::from(down.max(across)));
        }
    }
}
