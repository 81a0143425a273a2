//! Geometry: polygon meshes of triangles and quads, and what can be said of their topology.

mod mesh;
mod surface;
mod topology;

pub use mesh::{Bounds, PolyMesh};
pub use surface::Surface;
pub use topology::{Edges, Topology};
