//! Pictures of a source to put onto stand-ins (DESIGN §4, "Capture"): colour without light, coverage, depth and normals in parallel
//! projection. Injected, so that methods know nothing of devices: the software rasteriser here needs none and gives the same bytes
//! everywhere, `render::GpuCapture` is quicker.

use crate::Result;
use crate::model::Part;
use crate::raster::{self, View};

/// Takes pictures.
pub trait Capture: Sync {
    /// What `parts` look like from each of `views`, in order: see [`raster::Capture`].
    ///
    /// # Errors
    /// Those of [`raster::render`], or of a device.
    fn take(&self, parts: &[&Part], views: &[View]) -> Result<Vec<raster::Capture>>;
}

/// The software rasteriser: 9 samples a pixel, the same bytes on every machine.
#[derive(Debug, Default)]
pub struct SoftwareCapture;

impl Capture for SoftwareCapture {
    fn take(&self, parts: &[&Part], views: &[View]) -> Result<Vec<raster::Capture>> {
        let surfaces: Vec<_> = parts.iter().map(|part| (&part.surface, part.material.raster())).collect();
        views.iter().map(|view| raster::render(&surfaces, view, None)).collect()
    }
}
