//! The tree model, the pipeline that makes it from a photograph, and its GLB file (DESIGN §4–5).
//!
//! Everything here is in object space: metres, +Y up, origin at the foot of the trunk, +Z towards the photographer.

pub mod glb;
pub mod grown;
mod growth;
pub mod import;
pub mod obj;
mod part;
pub mod pipeline;
pub mod reference;
pub mod trunk;

use glam::{DVec2, Vec3};
use image::RgbaImage;
use serde::{Deserialize, Serialize};

use crate::geom::Surface;
use crate::raster::Rect;
use crate::{Error, Result};

pub use crate::raster::Wrap;
pub use growth::{Growth, GrowthProfile, ProfileChoice, ProfileParams};
pub use part::{Material, Part, bounds};
pub use trunk::TrunkShape;

/// A tree as a renderer needs it: closed crowns (She fig. 4b has several), a trunk, and where it all came from.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeModel {
    /// At least one crown.
    pub crowns: Vec<ModelCrown>,
    /// The trunk, as seen or a likely one; a file of other origin may have none.
    pub trunk: Option<Trunk>,
    /// Where the model came from.
    pub about: About,
}

/// One closed, textured crown (She §3.1–3.2).
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCrown {
    /// Triangles and quads with normals and texture coordinates.
    pub surface: Surface,
    /// sRGB colour; alpha below 128 is a gap through which the sky shows.
    pub texture: RgbaImage,
    /// The point from which all of the surface is seen.
    pub center: Vec3,
}

/// The trunk: an untextured closed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Trunk {
    /// Triangles and quads with normals, no texture coordinates.
    pub surface: Surface,
    /// Bark colour, 8-bit sRGB.
    pub bark: [u8; 3],
}

/// What rides in the file's `extras.sphereboard` beside the geometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// Version of these extras; see [`About::FORMAT`].
    pub format: u32,
    /// Name and version of the program that made the model.
    pub program: String,
    /// Seed of every random number.
    pub seed: u64,
    /// File names of the photographs, without folders.
    pub sources: Vec<String>,
    /// Height of the tree.
    pub height_m: f64,
    /// Whether the height is a guess, since nobody gave it.
    pub height_guessed: bool,
    /// Every effective parameter by name.
    pub parameters: serde_json::Map<String, serde_json::Value>,
    /// The feature points of each outline.
    pub feature_points: Vec<Profile>,
    /// Where the exemplar was cut from the first photograph.
    pub exemplar_window_px: Option<Rect>,
    /// Fraction of the crown through which the sky shows, 0 to 1.
    pub gap_fraction: f64,
    /// How the outline grows when drawn (She §3.3), measured on the first photograph.
    pub growth: Growth,
}

/// The significant turning points of one outline (She §3.1, fig. 8a), in pixels of its photograph, from the base to the top.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// From which side the photograph was taken: 0 is +Z, 90 is +X.
    pub azimuth_deg: f64,
    /// Left of the axis.
    pub left_px: Vec<DVec2>,
    /// Right of the axis.
    pub right_px: Vec<DVec2>,
}

impl About {
    /// The version that this program writes, and the only one it reads.
    pub const FORMAT: u32 = 2;

    /// The name and version of this program.
    pub fn this_program() -> String {
        concat!("sphereboard ", env!("CARGO_PKG_VERSION")).to_owned()
    }
}

impl TreeModel {
    /// Checks what a file or a renderer relies on: crowns there, lists of equal length, corners that exist, finite numbers, unit
    /// normals, textures within [`glb::MAX_TEXTURE_PX`].
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn check(&self) -> Result<(), String> {
        if self.crowns.is_empty() {
            return Err("the model has no crown".to_owned());
        }
        for (number, crown) in self.crowns.iter().enumerate() {
            let within = |side: u32| (1..=glb::MAX_TEXTURE_PX).contains(&side);
            check_surface(&crown.surface, true).map_err(|what| format!("crown {number}: {what}"))?;
            if !within(crown.texture.width()) || !within(crown.texture.height()) {
                return Err(format!("crown {number}: its texture is not 1 to {} pixels wide and high", glb::MAX_TEXTURE_PX));
            }
            if !crown.center.is_finite() {
                return Err(format!("crown {number}: its centre is not finite"));
            }
        }
        if let Some(trunk) = &self.trunk {
            check_surface(&trunk.surface, false).map_err(|what| format!("trunk: {what}"))?;
        }
        let about = &self.about;
        let points = || about.feature_points.iter().flat_map(|p| p.left_px.iter().chain(&p.right_px));
        let azimuths = about.feature_points.iter().map(|p| p.azimuth_deg);
        let numbers = [about.height_m, about.gap_fraction].into_iter().chain(azimuths);
        if !numbers.chain(points().flat_map(|p| p.to_array())).all(f64::is_finite) {
            return Err("a number about the model is not finite".to_owned());
        }
        if !about.growth.is_sound() {
            return Err(
                "the lengths of its growth are not within 0 to 100 m, or its shortest is longer than its longest".to_owned()
            );
        }
        Ok(())
    }

    fn checked(&self) -> Result<()> {
        self.check().map_err(|what| Error::Internal { stage: "model", what })
    }
}

fn check_surface(surface: &Surface, textured: bool) -> Result<(), String> {
    let count = surface.mesh.positions.len();
    let uvs = if textured { count } else { 0 };
    if surface.mesh.polygon_count() == 0 {
        return Err("it has no polygons".to_owned());
    }
    if (surface.normals.len(), surface.uvs.len()) != (count, uvs) {
        return Err(format!(
            "{count} vertices need {count} normals and {uvs} texture coordinates, but there are {} and {}",
            surface.normals.len(),
            surface.uvs.len()
        ));
    }
    if surface.mesh.polygons().flatten().any(|&corner| corner as usize >= count) {
        return Err(format!("a polygon has a corner beyond the {count} vertices"));
    }
    let finite = surface.mesh.positions.iter().all(|p| p.is_finite()) && surface.uvs.iter().all(|t| t.is_finite());
    if !finite {
        return Err("a position or texture coordinate is not finite".to_owned());
    }
    // The tolerance of the Khronos validator.
    let unit = |n: &Vec3| (n.length() - 1.0).abs() < 5e-4;
    if surface.normals.iter().all(unit) { Ok(()) } else { Err("a normal is not of unit length".to_owned()) }
}
