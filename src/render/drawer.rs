//! What draws one kind of part (DESIGN §4). What it draws was put onto the device once, when its [`Tree`](super::Tree) was uploaded; in
//! every frame it prepares what depends on the viewer, and then draws into the passes of the frame.

use super::scene::Scene;
use crate::Result;
use crate::gpu::Gpu;

/// A pass that drawers draw into. Its groups 0 (the frame) and, where it is lit, 2 (the sun's map) are bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PassKind {
    /// The trees' temporary colour, depth and id (She §3.4).
    Temporary,
    /// The sun's map: depth alone.
    Shadow,
}

/// All of them.
pub const PASSES: [PassKind; 2] = [PassKind::Temporary, PassKind::Shadow];

/// Draws one kind of part.
pub trait Drawer {
    /// Puts onto the device what has changed since the last frame; gives how many bytes that were.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    fn prepare(&mut self, _gpu: &Gpu, _scene: &Scene) -> Result<u64> {
        Ok(0)
    }

    /// Draws every part of its kind that is seen.
    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind);
}
