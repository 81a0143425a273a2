//! Buffers with something in them.

use super::Gpu;

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
