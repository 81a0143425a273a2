//! Pictures of a source to put onto stand-ins (DESIGN §4, "Capture"): colour without light, coverage, depth and normals in parallel
//! projection. Injected, so that methods know nothing of devices: the software rasteriser here needs none and gives the same bytes
//! everywhere, `render::GpuCapture` is quicker.

use std::sync::{Arc, Mutex, PoisonError};

use image::RgbaImage;
use rayon::prelude::*;

use crate::Result;
use crate::model::Part;
use crate::raster::{self, Texture, View};

/// Takes pictures.
pub trait Capture: Sync {
    /// What `parts` look like from each of `views`, in order: see [`raster::Capture`].
    ///
    /// # Errors
    /// Those of [`raster::render`], or of a device.
    fn take(&self, parts: &[&Part], views: &[View]) -> Result<Vec<raster::Capture>>;
}

/// The software rasteriser: 9 samples a pixel, the same bytes on every machine. Keeps the textures that it has met, for as long as it lives.
#[derive(Debug, Default)]
pub struct SoftwareCapture {
    textures: Mutex<Vec<Known>>,
}

/// A picture, and the texture of it unless it is empty.
type Known = (Arc<RgbaImage>, Option<Arc<Texture>>);

impl SoftwareCapture {
    /// Without any texture yet.
    pub fn new() -> Self {
        Self::default()
    }

    fn texture(&self, picture: &Arc<RgbaImage>) -> Option<Arc<Texture>> {
        // A poisoned list is as good as any: what is in it was whole when it was put there.
        let mut known = self.textures.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, texture)) = known.iter().find(|(its, _)| Arc::ptr_eq(its, picture)) {
            return texture.clone();
        }
        let texture = Texture::of(picture).map(Arc::new);
        known.push((picture.clone(), texture.clone()));
        texture
    }
}

impl Capture for SoftwareCapture {
    fn take(&self, parts: &[&Part], views: &[View]) -> Result<Vec<raster::Capture>> {
        let surfaces: Vec<_> = parts.iter().map(|part| (&part.surface, part.material.raster())).collect();
        let textures: Vec<_> =
            parts.iter().map(|part| part.material.texture.as_ref().and_then(|picture| self.texture(picture))).collect();
        let textures: Vec<_> = textures.iter().map(Option::as_deref).collect();
        views.par_iter().map(|view| raster::render_with(&surfaces, &textures, view, None)).collect()
    }
}
