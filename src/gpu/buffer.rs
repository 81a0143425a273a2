//! Buffers with something in them.

use std::ops::Range;

use super::Gpu;
use crate::Result;

/// A buffer that holds `contents`, a whole number of 4-byte words. Through the queue: wgpu's own `create_buffer_init` maps the new
/// buffer, and panics where the device was lost or memory ran out.
pub fn upload_buffer(gpu: &Gpu, label: &'static str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: contents.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    if !contents.is_empty() {
        gpu.queue.write_buffer(&buffer, 0, contents);
    }
    buffer
}

/// A buffer that is filled anew in every frame, and made anew only when it has become too small.
#[derive(Debug)]
pub struct KeptBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: wgpu::Buffer,
}

impl KeptBuffer {
    /// A small one.
    pub fn new(gpu: &Gpu, label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { label, usage, buffer: upload_buffer(gpu, label, &[0; 256], usage) }
    }

    /// Puts `contents`, a whole number of 4-byte words, at its beginning. Gives whether that took another buffer: whatever binds the old
    /// one has to be made anew then.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when there is no room for them; the old buffer stays.
    pub fn fill(&mut self, gpu: &Gpu, contents: &[u8]) -> Result<bool> {
        let grows = self.room(gpu, contents.len() as u64)?;
        if !contents.is_empty() {
            gpu.queue.write_buffer(&self.buffer, 0, contents);
        }
        Ok(grows)
    }

    /// Makes room for so many bytes, which something on the device will write. Gives whether that took another buffer.
    ///
    /// # Errors
    /// As [`KeptBuffer::fill`].
    pub fn room(&mut self, gpu: &Gpu, needed: u64) -> Result<bool> {
        let grows = needed > self.buffer.size();
        if grows {
            let descriptor = wgpu::BufferDescriptor {
                label: Some(self.label),
                size: needed.next_power_of_two(),
                usage: self.usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            };
            self.buffer = gpu.guarded(|| gpu.device.create_buffer(&descriptor))?;
        }
        Ok(grows)
    }

    /// The buffer as it is now.
    pub fn get(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}

/// Small changes of many buffers, sent together: each write through the queue takes a buffer of its own on the way.
#[derive(Debug, Default)]
pub struct Changes {
    bytes: Vec<u8>,
    /// Which buffer, from which byte on, and where `bytes` has what comes there.
    copies: Vec<(wgpu::Buffer, u64, Range<u64>)>,
}

impl Changes {
    /// Puts `contents`, a whole number of 4-byte words, into a buffer at a byte.
    pub fn write(&mut self, buffer: &wgpu::Buffer, at: u64, contents: &[u8]) {
        let begin = self.bytes.len() as u64;
        self.bytes.extend_from_slice(contents);
        self.copies.push((buffer.clone(), at, begin..self.bytes.len() as u64));
    }

    /// Sends all by way of `staging`, which is for copying from.
    ///
    /// # Errors
    /// Those of [`KeptBuffer::fill`].
    pub fn send(self, gpu: &Gpu, staging: &mut KeptBuffer) -> Result<()> {
        if self.copies.is_empty() {
            return Ok(());
        }
        staging.fill(gpu, &self.bytes)?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("changes") });
        for (buffer, at, Range { start, end }) in &self.copies {
            encoder.copy_buffer_to_buffer(staging.get(), *start, buffer, *at, end - start);
        }
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// A group of one buffer that vertex stages read.
pub fn storage_layout(gpu: &Gpu, label: &str) -> wgpu::BindGroupLayout {
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: true },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{read_buffer, testing::software_gpu};

    #[test]
    fn a_kept_buffer_is_made_anew_only_when_it_is_too_small() {
        let Some(gpu) = software_gpu() else { return };
        let mut kept = KeptBuffer::new(&gpu, "test", wgpu::BufferUsages::COPY_SRC);
        let filled = |kept: &mut KeptBuffer, byte: u8, count: usize| {
            let anew = kept.fill(&gpu, &vec![byte; count]).unwrap();
            assert!(read_buffer(&gpu, kept.get()).unwrap()[..count].iter().all(|b| *b == byte));
            anew
        };
        assert_eq!(
            [64, 1000, 4, 1024, 1028, 0].map(|count| filled(&mut kept, count as u8 ^ 7, count)),
            [false, true, false, false, true, false]
        );
        assert!(kept.fill(&gpu, &[1; 4]).is_ok());
    }

    #[test]
    fn changes_come_to_where_they_belong_and_nowhere_else() {
        let Some(gpu) = software_gpu() else { return };
        let [one, two] = [1u8, 2].map(|byte| upload_buffer(&gpu, "test", &[byte; 16], wgpu::BufferUsages::COPY_SRC));
        let mut staging = KeptBuffer::new(&gpu, "staging", wgpu::BufferUsages::COPY_SRC);
        let mut changes = Changes::default();
        changes.write(&one, 4, &[7; 4]);
        changes.write(&two, 0, &[8; 8]);
        changes.write(&one, 12, &[9; 4]);
        changes.send(&gpu, &mut staging).unwrap();
        assert_eq!(read_buffer(&gpu, &one).unwrap(), [[1; 4], [7; 4], [1; 4], [9; 4]].concat());
        assert_eq!(read_buffer(&gpu, &two).unwrap(), [[8; 8], [2; 8]].concat());
        Changes::default().send(&gpu, &mut staging).unwrap();
    }
}
