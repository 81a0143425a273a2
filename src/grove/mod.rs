//! Groves: what stands where, on which ground, seen along which path. Plain data, metres, +Y up, +X east, -Z north.

pub mod against;
pub mod chains;
pub mod culling;
pub mod drive;
pub mod export;
pub mod inventory;
pub mod page;
pub mod path;
pub mod photos;
pub mod placement;
pub mod plots;
pub mod record;
pub mod scene;
pub mod stock;
pub mod terrain;
pub mod trail;

use glam::Vec3;

pub use path::{CameraParams, Key, Look, Path};
pub use scene::{Scene, SceneFile, lay_out};

/// A tree that stands somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planted {
    /// Which of the scene's species.
    pub species: u16,
    /// Where its foot goes, metres: sunk into the ground as far as no part of the trunk's foot hangs over a slope.
    pub position: Vec3,
    /// Turned about the vertical, radians, 0 to 2π.
    pub yaw_rad: f32,
    /// Times its species' size.
    pub scale: f32,
}
