//! GLB files (glTF 2.0, binary): tree models, written and read back bit for bit, and grown trees, written (DESIGN §5).
//!
//! One root node `tree` with the nodes `crown_0`, `crown_1`, … and `trunk`. Triangles come first, then every quad as two
//! triangles; how many there are of each, and all else that glTF has no word for, rides in `extras.sphereboard`.
//!
//! Grown trees have the nodes `wood` and `leaves`; leaf `i` of the latter is its quad `i`: triangles `2i` and `2i + 1`, vertices
//! `4i..4i + 4`. What a method has built of a tree ([`Assembly`]) has a node for every part in every level. Groves ([`Instanced`])
//! have each tree once, and lists of where its copies stand.
//!
//! Crowns are `alphaMode: MASK` and single-sided: through a gap in the near wall one looks past the culled inside of the far wall
//! at the sky, so that the gap fraction seen is the one photographed, not its square.

mod assembly;
mod instances;
mod read;
mod write;
mod writer;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use assembly::{Assembly, Piece, Plainly, Tier, read_assembly, write_assembly};
pub use instances::{Batch, EXTENSION, Instanced, Kind, write_instances};
pub use read::read;
pub use write::{write, write_parts};

/// Longest side of a texture that is written or read; many GPUs take no more.
pub const MAX_TEXTURE_PX: u32 = 8192;

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
    Wood {},
    Leaves {},
}
