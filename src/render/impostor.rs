//! The drawer of octahedral impostors (Brucks 2018): `shaders/shared/octahedral.wgsl` has the method.

use super::drawer::{Drawer, PassKind};
use super::mesh::{TARGETS, pipeline_of};
use super::placing::{Groups, Placing};
use super::scene::Scene;
use crate::gpu::Gpu;

/// How far an impostor's card reaches from its middle, in radii of what was captured: the corners of a square of that half side.
pub const REACH: f32 = 1.415;

/// Draws octahedral impostors.
#[derive(Debug)]
pub struct ImpostorDrawer {
    /// Of trees that are placed one by one: for the picture, for the sun.
    each: [wgpu::RenderPipeline; 2],
    /// Of those of a crowd.
    many: [wgpu::RenderPipeline; 2],
}

impl ImpostorDrawer {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let pipelines = |placing: Placing| {
            let names = [["impostor", "impostor_of_many"], ["impostor_cast", "impostor_cast_of_many"]];
            let [seen, cast] = placing.shaders(gpu, names);
            let layout = |name, lit| groups.layout(gpu, name, placing, lit);
            let (buffers, fill) = (placing.buffers(), wgpu::PolygonMode::Fill);
            let pipeline = |name, lit, shader, targets| {
                pipeline_of(gpu, name, &layout(name, lit), shader, &buffers, Some(targets), None, fill)
            };
            [pipeline("impostor", true, &seen, &TARGETS[..]), pipeline("impostor_cast", false, &cast, &[])]
        };
        Self { each: pipelines(Placing::Each), many: pipelines(Placing::Many) }
    }
}

impl Drawer for ImpostorDrawer {
    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        let of_kind = usize::from(kind == PassKind::Shadow);
        pass.set_pipeline(&self.each[of_kind]);
        for placed in scene.trees(kind) {
            for part in placed.tree.impostors() {
                let Some((bytes, count)) = placed.placed(part.group) else { continue };
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                part.draw(pass, count);
            }
        }
        if let Some(crowd) = scene.crowd {
            crowd.draw(pass, kind, true, |pass, _| pass.set_pipeline(&self.many[of_kind]));
        }
    }
}
