//! The ground: a height field, lit and shadowed as trees are, seen through the same air (She §3.5, fig. 19a).

use super::pipelines::pipeline_of;
use super::placing::{Groups, Placing};
use super::targets::COLOR;
use crate::geom::{GroundMesh, HeightField, skirt};
use crate::gpu::{Gpu, Shader, layout, upload_buffer};

/// Ground on the device, and how it goes on beyond its edge.
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
        let (mesh, skirt) = (ground.mesh(), skirt(ground));
        let vertex = |(position, normal): (&glam::Vec3, &glam::Vec3)| layout::Vertex {
            position: position.to_array(),
            normal: normal.to_array(),
            uv: [0.0; 2],
        };
        let of = |mesh: &GroundMesh| mesh.positions.iter().zip(&mesh.normals).map(vertex).collect::<Vec<_>>();
        let vertices = [of(&mesh), of(&skirt)].concat();
        let first = mesh.positions.len() as u32;
        let indices: Vec<u32> = mesh.indices.into_iter().chain(skirt.indices.iter().map(|index| first + index)).collect();
        Self {
            vertices: upload_buffer(gpu, "terrain.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: upload_buffer(gpu, "terrain.indices", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            count: indices.len() as u32,
            lowest_m: ground.bounds().min.y,
        }
    }

    /// Its lowest point, metres.
    pub fn lowest_m(&self) -> f32 {
        self.lowest_m
    }

    /// Its triangles, and those that go on beyond its edge.
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

    /// Draws it, before whatever stands behind.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, terrain: &Terrain) {
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, terrain.vertices.slice(..));
        pass.set_index_buffer(terrain.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..terrain.count, 0, 0..1);
    }
}
