//! The drawer of surfaces: crowns, trunks, branches, leaves, cards that stand or turn.

use super::Crowd;
use super::drawer::{Drawer, PASSES, PassKind};
use super::pipelines::Pipelines;
use super::placing::{Groups, Placing};
use super::scene::Scene;
use crate::Result;
use crate::gpu::Gpu;

/// Draws surfaces.
#[derive(Debug)]
pub struct MeshDrawer {
    /// Of trees that are placed one by one.
    each: Pipelines,
    /// Of those of a crowd.
    many: Pipelines,
    /// Of those of a crowd in batches.
    batched: Pipelines,
}

impl MeshDrawer {
    /// Without any pipeline yet.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        let of = |placing, shaders| Pipelines::of_parts(gpu, groups, placing, shaders, true);
        let of_many = ["mesh_of_many", "cast_of_many"];
        Self { each: of(Placing::Each, ["mesh", "cast"]), many: of(Placing::Many, of_many), batched: of(Placing::Batched, of_many) }
    }
}

impl Drawer for MeshDrawer {
    fn prepare(&mut self, gpu: &Gpu, scene: &Scene) -> Result<u64> {
        for kind in PASSES {
            for placed in scene.trees(kind) {
                let drawn = placed.tree.meshes().iter().filter(|part| placed.placed(part.group).is_some());
                drawn.for_each(|part| self.each.ready(gpu, part, kind, scene.traits));
            }
            for part in scene.crowd.iter().flat_map(|crowd| crowd.drawn(kind, false)) {
                let batched = scene.crowd.is_some_and(Crowd::is_batched);
                let of_crowd = if batched { &mut self.batched } else { &mut self.many };
                of_crowd.ready(gpu, part, kind, scene.traits);
            }
        }
        Ok(0)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        for placed in scene.trees(kind) {
            for part in placed.tree.meshes() {
                let Some((bytes, count)) = placed.placed(part.group) else { continue };
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                pass.set_pipeline(self.each.of(part, kind, scene.traits));
                part.draw(pass, count);
            }
        }
        if let Some(crowd) = scene.crowd {
            let of_crowd = if crowd.is_batched() { &self.batched } else { &self.many };
            crowd.draw(pass, kind, false, |pass, part| pass.set_pipeline(of_crowd.of(part, kind, scene.traits)));
        }
    }
}
