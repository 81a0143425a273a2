//! Which adapters the machine has, for `doctor`.

use super::{AdapterChoice, instance};

/// One adapter and what it offers.
#[derive(Debug, Clone)]
pub struct Found {
    /// Name, kind, driver.
    pub info: wgpu::AdapterInfo,
    /// Longest side of a picture, pixels.
    pub max_side_px: u32,
    /// Largest buffer that a shader may write, bytes.
    pub max_storage_bytes: u64,
    /// Whether it times passes itself; else the clock on the wall does.
    pub timestamps: bool,
    /// Whether it draws triangles as lines, for the wireframe of `view`.
    pub lines: bool,
}

/// All adapters, in the drivers' order, and the number of the one that `choice` would use.
pub fn survey(choice: &AdapterChoice) -> (Vec<Found>, Option<usize>) {
    let adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::all()));
    let found: Vec<Found> = adapters.iter().map(about).collect();
    let used = choice.best(found.iter().map(|f| &f.info));
    (found, used)
}

fn about(adapter: &wgpu::Adapter) -> Found {
    let (limits, features) = (adapter.limits(), adapter.features());
    Found {
        info: adapter.get_info(),
        max_side_px: limits.max_texture_dimension_2d,
        max_storage_bytes: limits.max_storage_buffer_binding_size,
        timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS),
        lines: features.contains(wgpu::Features::POLYGON_MODE_LINE),
    }
}
