//! GLB files (glTF 2.0, binary) of tree models: written and read back bit for bit (DESIGN §5).
//!
//! One root node `tree` with the nodes `crown_0`, `crown_1`, … and `trunk`. Triangles come first, then every quad as two
//! triangles; how many there are of each, and all else that glTF has no word for, rides in `extras.sphereboard`.
//!
//! Crowns are `alphaMode: MASK` and single-sided: through a gap in the near wall one looks past the culled inside of the far wall
//! at the sky, so that the gap fraction seen is the one photographed, not its square.

mod read;
mod write;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use read::read;
pub use write::write;

/// Longest side of a texture that is written or read; many GPUs take no more.
pub const MAX_TEXTURE_PX: u32 = 8192;

/// Below this alpha a texel is a gap.
const ALPHA_CUTOFF: f32 = 0.5;

/// `extras` of the file or of a mesh: all of ours stands under one name.
#[derive(Serialize, Deserialize)]
struct Extras<T> {
    sphereboard: T,
}

/// What a mesh says of itself.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshExtras {
    part: Part,
    triangles: usize,
    quads: usize,
}

/// What a mesh stands for.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Part {
    Crown { center: Vec3 },
    Trunk {},
}

/// An sRGB byte as linear light, 0 to 1 (IEC 61966-2-1).
fn linear_from_srgb(value: u8) -> f32 {
    let v = f64::from(value) / 255.0;
    (if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
}

/// Linear light as the nearest sRGB byte.
fn srgb_from_linear(value: f32) -> u8 {
    let v = f64::from(value).clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (255.0 * v).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_linear_light() {
        assert!((0..=255).all(|v| srgb_from_linear(linear_from_srgb(v)) == v));
        assert!((linear_from_srgb(188) - 0.5029).abs() < 1e-4);
    }
}
