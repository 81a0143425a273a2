//! The drawer of octahedral impostors (Brucks 2018): `shaders/shared/octahedral.wgsl` has the method.

use super::Crowd;
use super::drawer::{Drawer, PASSES, PassKind};
use super::pipelines::Pipelines;
use super::placing::{Groups, Placing};
use super::scene::Scene;
use crate::Result;
use crate::gpu::Gpu;

/// How far an impostor's card reaches from its middle, in radii of what was captured: the corners of a square of that half side.
pub const REACH: f32 = 1.415;

/// Draws octahedral impostors.
#[derive(Debug)]
pub struct ImpostorDrawer {
    /// Of trees that are placed one by one.
    each: Pipelines,
    /// Of those of a crowd.
    many: Pipelines,
    /// Of those of a crowd in batches.
    batched: Pipelines,
}

impl ImpostorDrawer {
    /// Without any pipeline yet.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let of = |placing, shaders| Pipelines::of_parts(gpu, groups, placing, shaders, false);
        let of_many = ["impostor_of_many", "impostor_cast_of_many"];
        Self {
            each: of(Placing::Each, ["impostor", "impostor_cast"]),
            many: of(Placing::Many, of_many),
            batched: of(Placing::Batched, of_many),
        }
    }
}

impl Drawer for ImpostorDrawer {
    fn prepare(&mut self, gpu: &Gpu, scene: &Scene) -> Result<u64> {
        for kind in PASSES {
            for placed in scene.trees(kind) {
                let drawn = placed.tree.impostors().iter().filter(|part| placed.placed(part.group).is_some());
                drawn.for_each(|part| self.each.ready(gpu, part, kind, scene.traits));
            }
            for part in scene.crowd.iter().flat_map(|crowd| crowd.drawn(kind, true)) {
                let batched = scene.crowd.is_some_and(Crowd::is_batched);
                let of_crowd = if batched { &mut self.batched } else { &mut self.many };
                of_crowd.ready(gpu, part, kind, scene.traits);
            }
        }
        Ok(0)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        for placed in scene.trees(kind) {
            for part in placed.tree.impostors() {
                let Some((bytes, count)) = placed.placed(part.group) else { continue };
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                pass.set_pipeline(self.each.of(part, kind, scene.traits));
                part.draw(pass, count);
            }
        }
        if let Some(crowd) = scene.crowd {
            let of_crowd = if crowd.is_batched() { &self.batched } else { &self.many };
            crowd.draw(pass, kind, true, |pass, part| pass.set_pipeline(of_crowd.of(part, kind, scene.traits)));
        }
    }
}
