//! Milliseconds of each pass of a frame: timestamps that the device writes between passes where it can, else the clock on the wall with
//! the passes submitted and waited for one by one.

use std::time::Instant;

use super::{Gpu, read_buffer};
use crate::{Error, Result};

/// Most marks of a frame.
const MARKS: u32 = 32;

/// Times the passes of one frame. The first mark begins, every further one ends a pass.
#[derive(Debug)]
pub struct PassClock {
    passes: Vec<&'static str>,
    by: By,
}

#[derive(Debug)]
enum By {
    /// Ticks are written into the set.
    Device(wgpu::QuerySet),
    /// When each mark was reached.
    Wall(Vec<Instant>),
}

impl PassClock {
    /// The best clock that the device has.
    pub fn new(gpu: &Gpu) -> Self {
        let by = if gpu.has_timestamps() {
            let descriptor = wgpu::QuerySetDescriptor { label: Some("timing.ticks"), ty: wgpu::QueryType::Timestamp, count: MARKS };
            By::Device(gpu.device.create_query_set(&descriptor))
        } else {
            By::Wall(vec![])
        };
        Self { passes: vec![], by }
    }

    /// The clock on the wall, whatever the device has.
    pub fn wall() -> Self {
        Self { passes: vec![], by: By::Wall(vec![]) }
    }

    /// Marks the end of a pass (at the first call, the beginning). The clock on the wall submits what was encoded and goes on with a new
    /// encoder.
    ///
    /// # Errors
    /// [`Error::Device`] when the device fails, or after more marks than there is room for.
    pub fn passed(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, pass: &'static str) -> Result<()> {
        if self.passes.len() == MARKS as usize {
            return Err(Error::Internal { stage: "timing", what: format!("more than {MARKS} passes in a frame") });
        }
        match &mut self.by {
            By::Device(set) => encoder.write_timestamp(set, self.passes.len() as u32),
            By::Wall(reached) => {
                let next = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("timing.next") });
                gpu.queue.submit([std::mem::replace(encoder, next).finish()]);
                gpu.wait()?;
                reached.push(Instant::now());
            }
        }
        self.passes.push(pass);
        Ok(())
    }

    /// Every pass and its milliseconds, once the frame has been submitted.
    ///
    /// # Errors
    /// [`Error::Device`] when the device fails.
    pub fn read(self, gpu: &Gpu) -> Result<Vec<(&'static str, f64)>> {
        let reached_ms: Vec<f64> = match self.by {
            By::Device(set) => {
                let period_ms = f64::from(gpu.queue.get_timestamp_period()) / 1e6;
                ticks(gpu, &set, self.passes.len() as u32)?.into_iter().map(|tick| tick as f64 * period_ms).collect()
            }
            By::Wall(reached) => reached.iter().map(|at| at.duration_since(reached[0]).as_secs_f64() * 1e3).collect(),
        };
        // Two ticks out of order are one: a device may finish passes together.
        let lasted = reached_ms.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0));
        Ok(self.passes.iter().skip(1).copied().zip(lasted).collect())
    }
}

/// The first ticks of a set, counted from the first, so that few bits are enough.
fn ticks(gpu: &Gpu, set: &wgpu::QuerySet, count: u32) -> Result<Vec<u64>> {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("timing.resolved"),
        size: u64::from(MARKS) * 8,
        usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("timing.resolve") });
    encoder.resolve_query_set(set, 0..count, &buffer, 0);
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_buffer(gpu, &buffer)?;
    let all: Vec<u64> =
        bytes.chunks_exact(8).take(count as usize).map(|b| u64::from_le_bytes(b.try_into().expect("eight"))).collect();
    Ok(all.iter().map(|tick| tick.wrapping_sub(all[0])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::testing::software_gpu;

    /// A compute pass that counts for a while, twice as long the second time.
    fn busy(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, rounds: u32) {
        let text = format!(
            "@group(0) @binding(0) var<storage, read_write> sum: array<u32>;
             @compute @workgroup_size(64) fn cs_main(@builtin(global_invocation_id) id: vec3u) {{
                 var x = id.x;
                 for (var i = 0u; i < {rounds}u; i++) {{ x = x * 1664525u + 1013904223u + sum[(x + i) % 64u]; }}
                 sum[id.x % 64u] = x;
             }}"
        );
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("timing.busy"),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("timing.busy"),
            layout: None,
            module: &module,
            entry_point: Some("cs_main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("timing.busy"),
            size: 256,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("timing.busy"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("timing.busy"), timestamp_writes: None });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(256, 1, 1);
    }

    #[test]
    fn both_clocks_tell_a_long_pass_from_a_short_one_and_from_none() {
        let Some(gpu) = software_gpu() else { return };
        for mut clock in [PassClock::new(&gpu), PassClock::wall()] {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let label = format!("{clock:?}");
            clock.passed(&gpu, &mut encoder, "begin").unwrap();
            busy(&gpu, &mut encoder, 500);
            clock.passed(&gpu, &mut encoder, "short").unwrap();
            busy(&gpu, &mut encoder, 20_000);
            clock.passed(&gpu, &mut encoder, "long").unwrap();
            clock.passed(&gpu, &mut encoder, "nothing").unwrap();
            gpu.queue.submit([encoder.finish()]);
            let lasted = clock.read(&gpu).unwrap();
            assert_eq!(lasted.iter().map(|(pass, _)| *pass).collect::<Vec<_>>(), ["short", "long", "nothing"]);
            let [short, long, nothing] = [0, 1, 2].map(|i| lasted[i].1);
            assert!(long > 3.0 * short && long > 3.0 * nothing && short > 0.0, "{label}: {lasted:?}");
        }
    }

    #[test]
    fn too_many_passes_are_refused() {
        let Some(gpu) = software_gpu() else { return };
        let mut clock = PassClock::new(&gpu);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let marked: Vec<_> = (0..=MARKS).map(|_| clock.passed(&gpu, &mut encoder, "pass").is_ok()).collect();
        assert!(marked[..MARKS as usize].iter().all(|ok| *ok) && !marked[MARKS as usize]);
    }
}
