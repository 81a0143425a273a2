//! The drawer of octahedral impostors (Brucks 2018): `shaders/shared/octahedral.wgsl` has the method.

use super::drawer::{Drawer, PassKind};
use super::mesh::{TARGETS, pipeline, pipeline_layout};
use super::part::PartStore;
use super::scene::Scene;
use crate::gpu::{Gpu, Shader};

/// How far an impostor's card reaches from its middle, in radii of what was captured: the corners of a square of that half side.
pub const REACH: f32 = 1.415;

/// Draws octahedral impostors.
#[derive(Debug)]
pub struct ImpostorDrawer {
    seen: wgpu::RenderPipeline,
    cast: wgpu::RenderPipeline,
}

impl ImpostorDrawer {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout, store: &PartStore, sun: &wgpu::BindGroupLayout) -> Self {
        let (seen, cast) = (Shader::load(gpu, "impostor"), Shader::load(gpu, "impostor_cast"));
        let seen_layout = pipeline_layout(gpu, "impostor.layout", &[frame, &store.layout, sun]);
        let cast_layout = pipeline_layout(gpu, "impostor_cast.layout", &[frame, &store.layout]);
        let fill = wgpu::PolygonMode::Fill;
        Self {
            seen: pipeline(gpu, "impostor.pipeline", &seen_layout, &seen, Some(&TARGETS), None, fill),
            cast: pipeline(gpu, "impostor_cast.pipeline", &cast_layout, &cast, Some(&[]), None, fill),
        }
    }
}

impl Drawer for ImpostorDrawer {
    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        pass.set_pipeline(if kind == PassKind::Shadow { &self.cast } else { &self.seen });
        for placed in scene.trees(kind) {
            for part in placed.tree.impostors() {
                let Some((bytes, count)) = placed.placed(part.group) else { continue };
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                part.draw(pass, count);
            }
        }
    }
}
