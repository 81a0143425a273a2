//! Geometry: polygon meshes of triangles and quads and what can be said of their topology, and ground as a field of heights.

mod delaunay;
mod height_field;
mod mesh;
mod quads;
mod skirt;
mod surface;
mod topology;

pub use delaunay::sphere_delaunay;
pub use height_field::{FARTHEST_M, GroundMesh, HeightField, MOST_POINTS};
pub use mesh::{Bounds, PolyMesh};
pub use quads::{QuadRules, pair_into_quads};
pub use skirt::skirt;
pub use surface::Surface;
pub use topology::{Edges, Topology};
