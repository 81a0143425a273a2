//! The ground: a height field, lit and shadowed as trees are, seen through the same air (She §3.5, fig. 19a).

use super::mesh::pipeline_of;
use super::placing::{Groups, Placing};
use super::targets::{COLOR, Targets, color_attachment, depth_attachment};
use crate::geom::HeightField;
use crate::gpu::{Gpu, Shader, layout, upload_buffer};

/// Ground on the device.
#[derive(Debug)]
pub struct Terrain {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
    lowest_m: f32,
}

impl Terrain {
    /// Puts it there.
    pub(super) fn upload(gpu: &Gpu, ground: &HeightField) -> Self {
        let mesh = ground.mesh();
        let vertex = |(position, normal): (&glam::Vec3, &glam::Vec3)| layout::Vertex {
            position: position.to_array(),
            normal: normal.to_array(),
            uv: [0.0; 2],
        };
        let vertices: Vec<_> = mesh.positions.iter().zip(&mesh.normals).map(vertex).collect();
        Self {
            vertices: upload_buffer(gpu, "terrain.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: upload_buffer(gpu, "terrain.indices", bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            count: mesh.indices.len() as u32,
            lowest_m: ground.bounds().min.y,
        }
    }

    /// Its lowest point, metres.
    pub fn lowest_m(&self) -> f32 {
        self.lowest_m
    }

    /// Its triangles.
    pub fn triangles(&self) -> u32 {
        self.count / 3
    }
}

/// Draws ground into the frame.
#[derive(Debug)]
pub struct TerrainDrawer {
    pipeline: wgpu::RenderPipeline,
}

impl TerrainDrawer {
    /// Compiles its pipeline.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let shader = Shader::load(gpu, "terrain");
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("terrain.layout"),
            bind_group_layouts: &[Some(&groups.frame), None, Some(&groups.sun)],
            immediate_size: 0,
        });
        let (buffers, fill) = (&Placing::Each.buffers()[..1], wgpu::PolygonMode::Fill);
        let cull = Some(wgpu::Face::Back);
        Self { pipeline: pipeline_of(gpu, "terrain.pipeline", &layout, &shader, buffers, Some(&[Some(COLOR.into())]), cull, fill) }
    }

    /// Draws it before the backdrop.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        sun: &wgpu::BindGroup,
        targets: &Targets,
        terrain: &Terrain,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("terrain"),
            color_attachments: &[color_attachment(&targets.frame_color, None)],
            depth_stencil_attachment: Some(depth_attachment(&targets.frame_depth, false)),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(2, sun, &[]);
        pass.set_vertex_buffer(0, terrain.vertices.slice(..));
        pass.set_index_buffer(terrain.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..terrain.count, 0, 0..1);
    }
}
