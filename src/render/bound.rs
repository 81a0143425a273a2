//! Groups of resources that one pass alone binds, numbered in order from 0.

use crate::gpu::{Gpu, Target};

/// The layout of a group that binds these.
pub fn group_layout(gpu: &Gpu, label: &str, visibility: wgpu::ShaderStages, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
    let entry = |(&ty, binding)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = types.iter().zip(0..).map(entry).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// Binds them.
pub fn bind(gpu: &Gpu, label: &str, layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource]) -> wgpu::BindGroup {
    let numbered = resources.iter().zip(0..);
    let entries: Vec<_> =
        numbered.map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// All of a target.
pub fn view(target: &Target) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::TextureView(&target.view)
}

/// A texture without filtering.
pub fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// Colour that is read pixel by pixel.
pub const PLAIN_COLOR: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

/// A storage buffer.
pub fn storage(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A compute pipeline of some groups.
pub fn compute_pipeline(
    gpu: &Gpu,
    label: &str,
    shader: &wgpu::ShaderModule,
    entry_point: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    let descriptor = wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: groups, immediate_size: 0 };
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&gpu.device.create_pipeline_layout(&descriptor)),
        module: shader,
        entry_point: Some(entry_point),
        compilation_options: Default::default(),
        cache: None,
    })
}
