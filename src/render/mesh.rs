//! The drawer of surfaces: crowns, trunks, branches, leaves.

use bytemuck::Zeroable;
use image::{Rgba, RgbaImage};
use wgpu::util::DeviceExt;

use super::targets::{COLOR, ID, Targets, color_attachment, depth_attachment, nearer};
use crate::geom::Bounds;
use crate::gpu::{Gpu, Shader, layout, upload_mips};
use crate::model::{Growth, GrowthProfile, Material, Part, Wrap, bounds};
use glam::Vec3;

/// A tree on the device.
#[derive(Debug)]
pub struct Tree {
    parts: Vec<DrawnPart>,
    bounds: Option<Bounds>,
    triangles: usize,
    crowns: Vec<CrownShape>,
    growth: Growth,
}

/// What growth has to know of a crown; object space, metres.
#[derive(Debug, Clone, Copy)]
pub struct CrownShape {
    /// From where all of it is seen.
    pub center: Vec3,
    /// Half axes of the ellipsoid that is like it.
    pub half_axes: Vec3,
    /// The box around it.
    pub bounds: Bounds,
}

impl CrownShape {
    fn of(part: &Part) -> Option<Self> {
        let (center, bounds) = (part.crown_center?, part.surface.mesh.bounds()?);
        let half_axes = (0.5 * bounds.size()).max(Vec3::splat(1e-4));
        Some(Self { center, half_axes, bounds })
    }
}

impl Tree {
    /// The same tree, whose outlines grow so.
    pub fn growing(self, growth: Growth) -> Self {
        Self { growth, ..self }
    }

    /// How its outlines grow.
    pub fn growth(&self) -> Growth {
        self.growth
    }

    /// Its sphere-board crowns.
    pub fn crowns(&self) -> &[CrownShape] {
        &self.crowns
    }

    /// The box around it, object space; `None` for a tree of nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// Triangles of one instance.
    pub fn triangles(&self) -> usize {
        self.triangles
    }
}

/// One part on the device.
#[derive(Debug)]
struct DrawnPart {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
    material: wgpu::BindGroup,
}

/// Instances on the device.
#[derive(Debug)]
pub struct Placed {
    buffer: wgpu::Buffer,
    count: u32,
}

/// Draws surfaces into the temporary buffers.
#[derive(Debug)]
pub struct MeshDrawer {
    pipeline: wgpu::RenderPipeline,
    material_layout: wgpu::BindGroupLayout,
    clamp: wgpu::Sampler,
    repeat: wgpu::Sampler,
}

impl MeshDrawer {
    /// Compiles its pipeline.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout) -> Self {
        let material_layout = material_layout(gpu);
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("mesh.layout"),
            bind_group_layouts: &[Some(frame), Some(&material_layout)],
            immediate_size: 0,
        });
        let shader = Shader::load(gpu, "mesh");
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("mesh.pipeline"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &shader.0,
                entry_point: Some("vs_main"),
                compilation_options: Default::default(),
                buffers: &[Some(layout::Vertex::LAYOUT), Some(layout::Instance::LAYOUT)],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(nearer()),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader.0,
                entry_point: Some("fs_main"),
                compilation_options: Default::default(),
                targets: &[Some(COLOR.into()), Some(ID.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = |label, mode| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                address_mode_u: mode,
                address_mode_v: mode,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            })
        };
        let clamp = sampler("mesh.clamp", wgpu::AddressMode::ClampToEdge);
        let repeat = sampler("mesh.repeat", wgpu::AddressMode::Repeat);
        Self { pipeline, material_layout, clamp, repeat }
    }

    /// Puts a tree onto the device.
    pub fn upload(&self, gpu: &Gpu, parts: &[Part]) -> Tree {
        let drawable = parts.iter().filter(|part| part.surface.mesh.polygon_count() > 0);
        let mut crowns = vec![];
        let mut drawn = vec![];
        for part in drawable {
            let crown = CrownShape::of(part);
            crowns.extend(crown);
            drawn.push(self.upload_part(gpu, part, if crown.is_some() { crowns.len() as u32 } else { 0 }));
        }
        let bounds = bounds(parts);
        let height_m = bounds.map_or(1.0, |b| f64::from(b.size().y));
        Tree {
            parts: drawn,
            bounds,
            crowns,
            growth: Growth::likely(GrowthProfile::Broadleaf, height_m),
            triangles: parts.iter().map(|part| part.surface.mesh.triangulated().count()).sum(),
        }
    }

    fn upload_part(&self, gpu: &Gpu, part: &Part, crown: u32) -> DrawnPart {
        let surface = &part.surface;
        let vertex = |i: usize| layout::Vertex {
            position: surface.mesh.positions[i].to_array(),
            normal: surface.normals.get(i).map_or([0.0, 1.0, 0.0], |n| n.to_array()),
            uv: surface.uvs.get(i).map_or([0.0; 2], |uv| uv.to_array()),
        };
        let vertices: Vec<_> = (0..surface.mesh.positions.len()).map(vertex).collect();
        let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
        let buffer = |label, contents, usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        DrawnPart {
            vertices: buffer("mesh.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer("mesh.indices", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            count: indices.len() as u32,
            material: self.upload_material(gpu, part, crown),
        }
    }

    fn upload_material(&self, gpu: &Gpu, part: &Part, crown: u32) -> wgpu::BindGroup {
        let Material { factor, texture, wrap, alpha_cutoff, two_sided } = &part.material;
        let values = layout::Material {
            factor: *factor,
            crown_center: part.crown_center.unwrap_or_default().to_array(),
            alpha_cutoff: alpha_cutoff.unwrap_or(0.0),
            grows: crown,
            two_sided: u32::from(*two_sided),
            ..layout::Material::zeroed()
        };
        let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("mesh.material"),
            contents: bytemuck::bytes_of(&values),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let plain = RgbaImage::from_pixel(1, 1, Rgba([255; 4]));
        let view = upload_mips(gpu, "mesh.texture", &[texture.as_deref().unwrap_or(&plain).clone()]);
        let sampler = if *wrap == Wrap::Clamp { &self.clamp } else { &self.repeat };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("mesh.material"),
            layout: &self.material_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(sampler) },
            ],
        })
    }

    /// Puts instances onto the device.
    pub fn place(&self, gpu: &Gpu, instances: &[layout::Instance]) -> Placed {
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("mesh.instances"),
            contents: bytemuck::cast_slice(instances),
            usage: wgpu::BufferUsages::VERTEX,
        });
        Placed { buffer, count: instances.len() as u32 }
    }

    /// Draws trees into the temporary colour, depth and id buffers.
    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::BindGroup, targets: &Targets, trees: &[(&Tree, Placed)]) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("trees"),
            color_attachments: &[
                color_attachment(&targets.tree_color, Some(wgpu::Color::TRANSPARENT)),
                color_attachment(&targets.tree_id, Some(wgpu::Color::TRANSPARENT)),
            ],
            depth_stencil_attachment: Some(depth_attachment(&targets.tree_depth, true)),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame, &[]);
        for (tree, placed) in trees {
            pass.set_vertex_buffer(1, placed.buffer.slice(..));
            for part in &tree.parts {
                pass.set_bind_group(1, &part.material, &[]);
                pass.set_vertex_buffer(0, part.vertices.slice(..));
                pass.set_index_buffer(part.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..part.count, 0, 0..placed.count);
            }
        }
    }
}

fn material_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let uniform =
        wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("mesh.material"),
        entries: &[
            entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, uniform),
            entry(1, wgpu::ShaderStages::FRAGMENT, texture),
            entry(2, wgpu::ShaderStages::FRAGMENT, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ],
    })
}
