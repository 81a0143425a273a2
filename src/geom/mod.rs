//! Geometry: polygon meshes of triangles and quads, and what can be said of their topology.

mod delaunay;
mod mesh;
mod quads;
mod surface;
mod topology;

pub use delaunay::sphere_delaunay;
pub use mesh::{Bounds, PolyMesh};
pub use quads::{QuadRules, pair_into_quads};
pub use surface::Surface;
pub use topology::{Edges, Topology};
