//! From a photograph to what it shows of one tree: pixels, masks, outline, bark and a square of foliage (She §3.1–3.2, fig. 6–7).
//!
//! Everything here is in pixels of the photograph, x to the right, y down, the top left corner of the top left pixel at (0, 0).

pub mod contour;
pub mod decode;
pub mod delight;
pub mod exemplar;
mod exemplar_window;
mod profile;
mod rare_tiff;
pub mod roughness;
pub mod segment;
pub mod silhouette;
pub mod trunk;

pub use decode::{DecodeParams, Photo};
pub use exemplar::{Exemplar, ExemplarParams};
pub use roughness::Roughness;
pub use segment::{Hints, SegmentParams, Segmentation};
pub use silhouette::{Axis, Silhouette, SilhouetteParams};
pub use trunk::TrunkCues;
